//! Estimates of a sequence against its truth, or against one of them.

use super::Error;
use crate::evaluate::{self, EvaluateOptions, Evaluated, Evaluation, Reconstruction};
use crate::structure::Sequence;

/// What to compare with what.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluateRequest {
    /// Estimates to compare; all but the reference where there are none.
    pub estimates: Vec<String>,
    /// `truth`, or the estimate that is the reference.
    pub reference: String,
    /// How they are compared.
    pub options: EvaluateOptions,
}

impl Default for EvaluateRequest {
    fn default() -> Self {
        Self {
            estimates: Vec::new(),
            reference: Reconstruction::TRUTH.to_owned(),
            options: EvaluateOptions::default(),
        }
    }
}

/// Compares estimates of a sequence with a reference; a row for each estimate.
///
/// * `title` — what the sequence is called in the rows.
///
/// # Errors
/// [`Error::Unknown`], [`Error::NoTruth`], [`Error::Missing`] without estimates, and [`Error::Evaluate`] for rows that cannot be compared.
pub fn evaluate(
    title: &str,
    sequence: &Sequence,
    request: &EvaluateRequest,
) -> Result<Vec<Evaluated>, Error> {
    let mut names: Vec<&str> = sequence.trajectories.iter().map(|row| row.estimate.as_str()).collect();
    names.extend(sequence.map_points.iter().map(|row| row.estimate.as_str()));
    names.extend(sequence.map_lines.iter().map(|row| row.estimate.as_str()));
    names.sort_unstable();
    names.dedup();
    let there = || if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let wrong = |name: &str| {
        let name = name.to_owned();
        |cause| Error::Evaluate { name, cause }
    };
    let named = |name: &str| {
        if !names.contains(&name) {
            return Err(Error::Unknown { kind: "an estimate", name: name.to_owned(), there: there() });
        }
        let (poses, points, lines) = (&sequence.trajectories, &sequence.map_points, &sequence.map_lines);
        Reconstruction::named(name, poses, points, lines).map_err(wrong(name))
    };
    let reference = if request.reference == Reconstruction::TRUTH {
        let (points, lines) = (&sequence.point_landmarks, &sequence.line_landmarks);
        let truth =
            Reconstruction::truth(&sequence.frames, points, lines).map_err(wrong(Reconstruction::TRUTH))?;
        if truth.poses().is_empty() {
            return Err(Error::NoTruth { there: there() });
        }
        truth
    } else {
        named(&request.reference)?
    };
    let wanted: Vec<&str> = if request.estimates.is_empty() {
        names.iter().copied().filter(|name| *name != request.reference).collect()
    } else {
        request.estimates.iter().map(String::as_str).collect()
    };
    if wanted.is_empty() {
        return Err(Error::Unknown { kind: "an estimate", name: "to compare".to_owned(), there: there() });
    }
    let compared = |name: &str| {
        let evaluation = evaluate::evaluate(&reference, &named(name)?, &request.options);
        Ok(evaluated(title, &request.reference, evaluation, &request.options))
    };
    wanted.into_iter().map(compared).collect()
}

/// A result with the names that tell it apart.
#[must_use]
pub fn evaluated(
    sequence: &str,
    reference: &str,
    evaluation: Evaluation,
    options: &EvaluateOptions,
) -> Evaluated {
    let pairs = if options.step.all_pairs { ", all pairs" } else { "" };
    Evaluated {
        sequence: sequence.to_owned(),
        reference: reference.to_owned(),
        evaluation,
        alignment: options.alignment.to_string(),
        step: format!("{}{pairs}", options.step.delta),
    }
}
