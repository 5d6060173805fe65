//! Remarks for people, which no figure of the manifest carries.

use super::decide::Assignment;
use super::ledger::Ledger;
use super::poses::REPEATED_TRUTH;
use crate::family::Choice;
use crate::text_release::TextSequence;
use open_structure::geometry::PinholeCamera;
use open_structure::structure::{FrameId, LineId, Sequence, registry};
use std::collections::{BTreeMap, BTreeSet};

/// Looks at a converted sequence once more.
pub(super) fn remark(
    text: &TextSequence,
    choice: &Choice,
    tables: [Assignment; 2],
    sequence: &Sequence,
    ledger: &mut Ledger,
) {
    if choice.is_doubtful() {
        ledger.note(format!(
            "no known camera fits: the best ({}) misses by {:.1} px in the median; give the right one with --camera",
            choice.family_name(),
            choice.residual_px.unwrap_or_default()
        ));
    } else if choice.family.is_none() && choice.by != "given" {
        ledger.note("neither rows nor name tell the camera; that of the simulated sequences is assumed, give the right one with --camera".to_owned());
    }
    if choice.beyond_image > 0 {
        let PinholeCamera { width, height, .. } = choice.camera;
        ledger.note(format!(
            "{} positions lie far beyond the image of {width}x{height} px",
            choice.beyond_image
        ));
    }
    for (kind, tables) in ["points", "lines"].into_iter().zip(tables) {
        if tables.graph_apart {
            ledger.note(format!(
                "{kind}: the noisy rows of the association are the measurements; the graph has other ones, which stand in its factors"
            ));
        }
    }
    let blind = sequence.frames.iter().filter(|frame| frame.world_from_camera().is_none()).count();
    if blind > 0 {
        ledger.note(format!("{blind} frames have no true pose"));
    }
    let apart = largest_step(sequence);
    if apart > REPEATED_TRUTH {
        ledger.note(format!(
            "poses of the graph and of {} are up to {apart:.3} m apart: two runs",
            registry::MAP_TO_FRAME
        ));
    }
    if text.association.is_none() {
        ledger.note("no association: measurements are those of the graph".to_owned());
    }
    let lines: BTreeSet<LineId> = sequence.line_landmarks.iter().map(|line| line.line_id).collect();
    let shown: BTreeSet<LineId> = sequence
        .line_observations
        .iter()
        .map(|row| row.line_id)
        .chain(sequence.line_measurements.iter().map(|row| row.line_id))
        .collect();
    let unknown = shown.difference(&lines).count();
    if unknown > 0 && !lines.is_empty() {
        ledger.note(format!("{unknown} lines are seen and have no landmark"));
    }
}

/// The largest distance between a pose of the graph and the tracker's, metres.
fn largest_step(sequence: &Sequence) -> f64 {
    let graph: BTreeMap<FrameId, [f64; 3]> =
        sequence.graph_poses.iter().map(|row| (row.frame_id, row.world_from_camera().translation)).collect();
    let tracked = sequence.trajectories.iter().filter(|row| row.estimate == registry::MAP_TO_FRAME);
    tracked
        .filter_map(|row| {
            let (one, other) = (row.world_from_camera().translation, graph.get(&row.frame_id)?);
            Some((0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum::<f64>().sqrt())
        })
        .fold(0.0, f64::max)
}
