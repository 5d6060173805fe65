//! `evaluate`: how far estimates are from the truth.

use std::collections::BTreeMap;

use open_structure::evaluate::{
    Alignment, AlignmentKind, Delta, EvaluateOptions, Evaluated, Relation, Step, per_frame_table,
    summary_table,
};
use open_structure::format::results_batch;
use open_structure::stations::{self, EvaluateRequest};
use open_structure::structure::{FrameId, ResultTable, Sequence as Rows};
use pyo3::prelude::*;

use crate::arguments::{Given, at_least_one, choice};
use crate::errors;
use crate::table::Table;
use crate::work;

/// One name or several.
#[derive(FromPyObject)]
pub(crate) enum Names {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

impl Names {
    fn all(names: Option<Self>) -> Vec<String> {
        match names {
            None => Vec::new(),
            Some(Self::One(name)) => vec![name],
            Some(Self::Several(names)) => names,
        }
    }
}

/// Relations by the names of the command line.
const RELATIONS: [(&str, Relation); 7] = [
    ("trans", Relation::Translation),
    ("rot", Relation::RotationPart),
    ("full", Relation::Full),
    ("angle-deg", Relation::AngleDeg),
    ("angle-rad", Relation::AngleRad),
    ("point-distance", Relation::PointDistance),
    ("point-distance-ratio", Relation::PointDistanceRatio),
];

/// How estimates are compared: what both functions take.
struct Asked<'a> {
    estimate: Option<Names>,
    reference: String,
    align: &'a str,
    align_first: Option<usize>,
    rpe_delta: f64,
    rpe_unit: &'a str,
    all_pairs: bool,
    pairs_from_reference: bool,
}

impl Asked<'_> {
    fn request(self) -> PyResult<EvaluateRequest> {
        let kind = choice(
            "align",
            self.align,
            &[
                ("none", AlignmentKind::None),
                ("origin", AlignmentKind::Origin),
                ("se3", AlignmentKind::Se3),
                ("sim3", AlignmentKind::Sim3),
                ("scale", AlignmentKind::Scale),
            ],
        )?;
        let delta = match self.rpe_unit {
            "f" => Delta::Frames(frames(self.rpe_delta)?),
            unit => choice(
                "rpe_unit",
                unit,
                // The first is there for the message alone.
                &[
                    ("f", Delta::Frames(1)),
                    ("m", Delta::Metres(self.rpe_delta)),
                    ("d", Delta::Degrees(self.rpe_delta)),
                    ("r", Delta::Radians(self.rpe_delta)),
                ],
            )?,
        };
        let step =
            Step { all_pairs: self.all_pairs, of_reference: self.pairs_from_reference, ..Step::new(delta) };
        if let Some(first) = self.align_first {
            at_least_one("align_first", first)?;
        }
        if matches!(&self.estimate, Some(Names::Several(names)) if names.is_empty()) {
            return Err(errors::option("estimate: expected a name, found none"));
        }
        let options = EvaluateOptions { alignment: Alignment { kind, first: self.align_first }, step };
        Ok(EvaluateRequest { estimates: Names::all(self.estimate), reference: self.reference, options })
    }

    fn compare(
        self,
        py: Python<'_>,
        sequence: &Given<'_>,
    ) -> PyResult<(Vec<Evaluated>, std::sync::Arc<Rows>)> {
        let request = self.request()?;
        let (rows, title) = (sequence.rows()?, sequence.title());
        let found = work::run(py, errors::of_station, |_| stations::evaluate(&title, &rows, &request))?;
        complain(py, &found)?;
        Ok((found, rows))
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded before")]
fn frames(delta: f64) -> PyResult<usize> {
    if (1.0..=1e15).contains(&delta) && delta.fract() == 0.0 {
        Ok(delta as usize)
    } else {
        Err(errors::option(format!("rpe_delta: expected a whole number of frames from 1 on, found {delta}")))
    }
}

/// Warns of what could not be compared; fails where that is everything.
fn complain(py: Python<'_>, rows: &[Evaluated]) -> PyResult<()> {
    let mut failed = Vec::new();
    for row in rows {
        let found = &row.evaluation;
        // A map without a path has no errors of a path.
        if found.matched + found.extra == 0 && (found.points.is_some() || found.lines.is_some()) {
            continue;
        }
        let Some(error) = found.absolute.as_ref().err().or(found.relative.as_ref().err()) else { continue };
        if found.absolute.is_err() && found.relative.is_err() {
            failed.push(error);
        }
        py.import("warnings")?
            .call_method1("warn", (format!("{}, {}: {error}", row.sequence, found.name),))?;
    }
    match failed.first() {
        Some(error) if failed.len() == rows.len() => Err(errors::of_evaluate(error)),
        _ => Ok(()),
    }
}

fn table(results: &ResultTable) -> PyResult<Table> {
    Ok(Table::new(&results.name, results_batch(results).map_err(errors::of_format)?))
}

/// How far estimates are from the truth: a row for each, with evo's definitions; options as of ``os evaluate``.
///
/// * ``estimate``: compare only this one, or these; by default all.
/// * ``reference``: ``truth``, or the estimate to compare with.
/// * ``align``: what may be moved to lay an estimate on its reference: ``none``, ``origin``, ``se3``, ``sim3`` or ``scale``.
/// * ``align_first``: align over the first N matched poses alone.
/// * ``relation``: one or several of ``trans``, ``rot``, ``full``, ``angle-deg``, ``angle-rad``, ``point-distance`` and
///   ``point-distance-ratio``; by default ``trans`` and ``angle-rad``.
/// * ``rpe_delta``: how far the two poses of a pair of a relative error are apart.
/// * ``rpe_unit``: unit of it: ``f`` (frames), ``m`` (metres along the path), ``d`` (degrees) or ``r`` (radians).
/// * ``all_pairs``: take relative errors over all pairs, not over those that follow each other.
/// * ``pairs_from_reference``: measure the distance of a pair along the reference, not along the estimate.
///
/// Columns say their unit in their names, such as ``ape_translation_rmse_m``; what they mean is their metadata.
#[pyfunction]
#[pyo3(signature = (sequence, *, estimate = None, reference = "truth", align = "se3", align_first = None, relation = None, rpe_delta = 1.0, rpe_unit = "f", all_pairs = false, pairs_from_reference = false))]
#[expect(clippy::too_many_arguments, reason = "the options of a command, by name")]
pub(crate) fn evaluate(
    py: Python<'_>,
    sequence: Given<'_>,
    estimate: Option<Names>,
    reference: &str,
    align: &str,
    align_first: Option<usize>,
    relation: Option<Names>,
    rpe_delta: f64,
    rpe_unit: &str,
    all_pairs: bool,
    pairs_from_reference: bool,
) -> PyResult<Table> {
    let mut relations: Vec<Relation> = Vec::new();
    for name in Names::all(relation) {
        let relation = choice("relation", &name, &RELATIONS)?;
        if !relations.contains(&relation) {
            relations.push(relation);
        }
    }
    if relations.is_empty() {
        relations = vec![Relation::Translation, Relation::AngleRad];
    }
    let reference = reference.to_owned();
    let asked = Asked {
        estimate,
        reference,
        align,
        align_first,
        rpe_delta,
        rpe_unit,
        all_pairs,
        pairs_from_reference,
    };
    let (found, _) = asked.compare(py, &sequence)?;
    table(&summary_table(&found, &relations))
}

/// The errors of each frame, as ``os evaluate --per-frame`` writes them; options as of ``evaluate``.
#[pyfunction]
#[pyo3(signature = (sequence, *, estimate = None, reference = "truth", align = "se3", align_first = None, rpe_delta = 1.0, rpe_unit = "f", all_pairs = false, pairs_from_reference = false))]
#[expect(clippy::too_many_arguments, reason = "the options of a command, by name")]
pub(crate) fn evaluate_frames(
    py: Python<'_>,
    sequence: Given<'_>,
    estimate: Option<Names>,
    reference: &str,
    align: &str,
    align_first: Option<usize>,
    rpe_delta: f64,
    rpe_unit: &str,
    all_pairs: bool,
    pairs_from_reference: bool,
) -> PyResult<Table> {
    let reference = reference.to_owned();
    let asked = Asked {
        estimate,
        reference,
        align,
        align_first,
        rpe_delta,
        rpe_unit,
        all_pairs,
        pairs_from_reference,
    };
    let (found, rows) = asked.compare(py, &sequence)?;
    let stamps: BTreeMap<FrameId, i64> =
        rows.frames.iter().map(|frame| (frame.frame_id, frame.stamp_nanos)).collect();
    let both: Vec<(&Evaluated, &BTreeMap<FrameId, i64>)> = found.iter().map(|row| (row, &stamps)).collect();
    table(&per_frame_table(&both))
}
