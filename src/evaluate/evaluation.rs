//! Everything that is said of one estimate.

use super::{
    Absolute, Alignment, Error, LineErrors, Matched, PointErrors, Reconstruction, Relative, Similarity, Step,
};
use crate::structure::FrameId;

/// How estimates are compared with their reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluateOptions {
    /// How the estimate is laid on the reference.
    pub alignment: Alignment,
    /// Over which pairs of poses relative errors are taken.
    pub step: Step,
}

impl Default for EvaluateOptions {
    /// SE(3) alignment over all poses, and steps from frame to frame.
    fn default() -> Self {
        Self { alignment: Alignment::SE3, step: Step::FRAME }
    }
}

/// Everything that is said of one estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Name of the estimate.
    pub name: String,
    /// Poses that are in both.
    pub matched: usize,
    /// Poses that only the reference has.
    pub missing: usize,
    /// Poses that only the estimate has.
    pub extra: usize,
    /// Absolute errors, or why there are none.
    pub absolute: Result<Absolute<FrameId>, Error>,
    /// Relative errors, or why there are none.
    pub relative: Result<Relative<FrameId>, Error>,
    /// Errors of the points; `None` where one side has none, or the estimate could not be aligned.
    pub points: Option<PointErrors>,
    /// Errors of the lines; `None` where one side has none, or the estimate could not be aligned.
    pub lines: Option<LineErrors>,
}

/// Compares an estimate with its reference: the path, and then the map where the path's alignment lays it.
///
/// A map without a path is compared as it lies.
#[must_use]
pub fn evaluate(
    reference: &Reconstruction,
    estimate: &Reconstruction,
    options: &EvaluateOptions,
) -> Evaluation {
    let matched = Matched::by_id(reference.poses(), estimate.poses());
    let mut found = evaluate_matched(estimate.name(), matched, options);
    if found.absolute.is_err() {
        // Without a match nothing was counted.
        (found.missing, found.extra) =
            (reference.poses().len() - found.matched, estimate.poses().len() - found.matched);
    }
    let alignment = match &found.absolute {
        Ok(absolute) => Some(absolute.reference_from_estimate),
        Err(_) => estimate.poses().is_empty().then(Similarity::identity),
    };
    if let Some(alignment) = alignment {
        if !(reference.points().is_empty() || estimate.points().is_empty()) {
            found.points = Some(PointErrors::of(reference.points(), estimate.points(), &alignment));
        }
        if !(reference.lines().is_empty() || estimate.lines().is_empty()) {
            found.lines = Some(LineErrors::of(reference.lines(), estimate.lines(), &alignment));
        }
    }
    found
}

/// Compares a path whose poses are matched already, by stamp perhaps.
#[must_use]
pub fn evaluate_matched(
    name: &str,
    matched: Result<Matched<FrameId>, Error>,
    options: &EvaluateOptions,
) -> Evaluation {
    let count = |count: fn(&Matched<FrameId>) -> usize| matched.as_ref().map_or(0, count);
    Evaluation {
        name: name.to_owned(),
        matched: count(|matched| matched.ids.len()),
        missing: count(|matched| matched.missing),
        extra: count(|matched| matched.extra),
        relative: matched.clone().and_then(|matched| Relative::of(matched, options.alignment, options.step)),
        absolute: matched.and_then(|matched| Absolute::of(matched, options.alignment)),
        points: None,
        lines: None,
    }
}
