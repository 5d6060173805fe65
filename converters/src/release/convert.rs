//! The conversion of one sequence, step by step.

use super::decide::{Assignment, Judgement, Origin, assign};
use super::describe::{Findings, manifest};
use super::estimates::{Estimates, Known, add_estimates, estimates, frames as estimate_frames};
use super::graph::{Vertices, add_graph};
use super::groups::groups;
use super::judged::{Judged, depth_misses, judged, plucker, sights, verdict};
use super::landmarks::{line_landmarks, point_landmarks};
use super::ledger::Ledger;
use super::noise::FoundNoise;
use super::poses::{Poses, is_coarse, true_poses};
use super::remarks::remark;
use super::rows::Rows;
use super::tables::{Scene, add_lines, add_points};
use crate::family::{Clues, choose};
use crate::text_release::TextSequence;
use open_structure::geometry::PinholeCamera;
use open_structure::structure::{
    CameraId, Frame, FrameId, Sequence, frame_statistics, line_correspondences, point_correspondences,
};
use std::collections::BTreeSet;

/// Frame rate of the clock that is made for the release, which has no time stamps; hertz.
pub(super) const RATE_HZ: i64 = 30;

/// How a sequence is converted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// The camera, instead of the one that fits best.
    pub camera: Option<PinholeCamera>,
}

/// A converted sequence.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The sequence, sorted, with its manifest.
    pub sequence: Sequence,
    /// What was found on the way.
    pub findings: Findings,
}

/// Why a sequence cannot be converted.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// Nothing names a frame.
    #[error("{name}: expected poses or observations of at least one frame, found none")]
    NoFrames {
        /// The sequence.
        name: String,
    },
}

/// Converts one sequence.
///
/// # Errors
/// [`Error::NoFrames`]. Everything else that cannot be used is counted in the manifest.
pub fn convert(text: &TextSequence, options: &Options) -> Result<Converted, Error> {
    let mut ledger = Ledger::default();
    ledger.take_problems(&text.problems);

    let truth = true_poses(text, &mut ledger);
    let points = point_landmarks(text.point_landmarks.as_ref(), &mut ledger);
    let lines = line_landmarks(&text.line_landmarks, &mut ledger);
    let association = text.association.as_ref().map(|file| Rows::of(file, &mut ledger)).unwrap_or_default();
    let mut quiet = Ledger::default();
    let graph = text.graph.as_ref().map(|file| Rows::of(file, &mut quiet)).unwrap_or_default();
    let vertices = text.graph.as_ref().map(|file| Vertices::of(file, &mut ledger)).unwrap_or_default();
    let known = Known { truth: &truth, points: &points, lines: &lines, graph: &vertices };
    let results = estimates(text, &known, &mut ledger);

    let choice = choose(&Clues {
        name: &text.name,
        sights: &sights(&association, &graph, &known),
        pixels: &association.pixels().chain(graph.pixels()).collect::<Vec<_>>(),
        coarse_poses: is_coarse(&truth),
        given: options.camera,
    });
    let camera = choice.camera;

    let same_points = association.points == graph.points;
    let same_lines = association.lines == graph.lines;
    let directions = plucker(&lines);
    let judge = |rows: Rows| judged(rows, &truth, &camera, &points, &directions);
    let association = judge(association);
    let graph = if same_points && same_lines {
        Judged { rows: graph, fits: association.fits.clone(), ..association }
    } else {
        judge(graph)
    };
    let point_tables =
        assign(verdict(association.points.as_ref()), verdict(graph.points.as_ref()), same_points);
    let line_tables = assign(verdict(association.lines.as_ref()), verdict(graph.lines.as_ref()), same_lines);
    let of = |origin: Origin| if origin == Origin::Association { &association } else { &graph };
    // Rows that went nowhere but into factors have their flaws counted there.
    if [point_tables, line_tables].iter().any(|tables| {
        tables.measurements == Some(Origin::Graph) || tables.observations == Some(Origin::Graph)
    }) {
        ledger.take(quiet);
    }

    let mut sequence = Sequence::default();
    let scene = Scene { truth: &truth, camera: &camera, points: &points, lines: &lines };
    let from_points = |origin: Option<Origin>| origin.map(|origin| &of(origin).rows);
    let mut recovered = add_points(
        from_points(point_tables.observations),
        from_points(point_tables.measurements),
        &scene,
        &mut sequence,
        &mut ledger,
    );
    recovered.extend(add_lines(
        line_tables.observations.map(of),
        line_tables.measurements.map(of),
        &scene,
        &mut sequence,
        &mut ledger,
    ));
    sequence.sort();

    sequence.structural_groups =
        groups(text.association.as_ref(), text.graph.as_ref(), &sequence.line_landmarks, &mut ledger);
    if let Some(file) = &text.graph {
        add_graph(file, &vertices, &mut sequence, &mut ledger);
    }
    add_estimates(&results, &mut sequence);

    sequence.frames = frames(&truth, [&association.rows, &graph.rows], &vertices.poses, &results);
    if sequence.frames.is_empty() {
        return Err(Error::NoFrames { name: text.name.clone() });
    }
    sequence.point_correspondences =
        point_correspondences(&sequence.point_measurements, &sequence.point_observations);
    sequence.line_correspondences =
        line_correspondences(&sequence.line_measurements, &sequence.line_observations);
    sequence.sort();

    let depths = line_tables
        .measurements
        .map(|origin| depth_misses(of(origin), &association, &directions, &truth, &camera));
    let judgement = |tables: Assignment, of_kind: fn(&Judged) -> Option<&Judgement>| {
        tables.measurements.and_then(|origin| of_kind(of(origin)))
    };
    let noise = FoundNoise::of(
        judgement(point_tables, |judged| judged.points.as_ref()),
        judgement(line_tables, |judged| judged.lines.as_ref()),
        depths.as_deref().unwrap_or_default(),
    );
    remark(text, &choice, [point_tables, line_tables], &sequence, &mut ledger);

    let (excluded, notes) = ledger.finish();
    let findings = Findings {
        choice,
        association_points: association.points,
        association_lines: association.lines,
        graph_points: graph.points,
        graph_lines: graph.lines,
        noise,
        recovered,
        excluded,
        notes,
    };
    sequence.manifest = manifest(text, &sequence, &findings, options);
    // After the manifest, whose cameras are needed.
    sequence.frame_statistics = frame_statistics(&sequence);
    Ok(Converted { sequence, findings })
}

/// Every frame that anything names, stamped by a clock of 30 Hz.
fn frames(truth: &Poses, rows: [&Rows; 2], graph: &Poses, results: &Estimates) -> Vec<Frame> {
    let mut ids: BTreeSet<FrameId> = truth.keys().chain(graph.keys()).copied().collect();
    ids.extend(estimate_frames(results));
    for rows in rows {
        ids.extend(rows.points.iter().map(|row| row.frame_id));
        ids.extend(rows.lines.iter().map(|row| row.frame_id));
    }
    ids.into_iter()
        .map(|id| Frame::new(id, stamp_nanos(id), CameraId(0), truth.get(&id).map(|pose| pose.row)))
        .collect()
}

/// `round(id / 30 s)`, nanoseconds, without overflow for any id that is a frame's.
fn stamp_nanos(FrameId(id): FrameId) -> i64 {
    let (seconds, rest) = (id / RATE_HZ, id % RATE_HZ);
    seconds * 1_000_000_000 + (rest * 1_000_000_000 + RATE_HZ / 2) / RATE_HZ
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_follow_a_clock_of_thirty_hertz() {
        assert_eq!(
            [0, 1, 2, 3, 30].map(|id| stamp_nanos(FrameId(id))),
            [0, 33_333_333, 66_666_667, 100_000_000, 1_000_000_000]
        );
        assert!(stamp_nanos(FrameId(super::super::poses::LARGEST_FRAME)) > 0);
    }
}
