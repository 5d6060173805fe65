//! Poses and relative poses between them.

use nalgebra::{Matrix6, Vector6};

use super::key_frames::{Vertex, vertices};
use super::loops::loops;
use super::{Error, GraphOptions, relative_pose};
use crate::geometry::Pose;
use crate::structure::{
    Camera, Estimate, FactorGraph, GraphFactor, GraphPose, MeasuredFrame, MeasurementNoise, PoseRow, registry,
};

/// Standard deviations of a relative pose that no shared landmark supports: rad, m.
const GUESSED: [f64; 2] = [0.1, 0.5];

/// What went into a pose graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoseGraphSummary {
    /// Pose vertices.
    pub poses: usize,
    /// Relative poses between neighbours.
    pub neighbours: usize,
    /// Those among them that no shared landmark supports, so that their information is a guess.
    pub guessed: usize,
    /// Loop closures.
    pub loops: usize,
    /// Loop closures that were found, but whose relative pose could not be computed.
    pub loops_refused: usize,
    /// Frames without an estimated pose.
    pub frames_without_pose: usize,
    /// Frames that no rule chose as key frames.
    pub frames_left_out: usize,
}

/// A pose graph: the poses of an estimate, relative poses between neighbours, and loop closures.
///
/// Between neighbours, the measured relative pose is that of the estimate, with the information that the landmarks
/// give which both frames measured. A loop closure is computed from the measurements of its two frames alone, with a
/// consensus first: it knows nothing of the drift in between. The first pose is fixed.
///
/// * `frames` — measurements in the order of stamps.
/// * `seed` — seed of the samples of loop closures.
///
/// # Errors
/// [`Error::NoPoses`], [`Error::Pose`], [`Error::Camera`], [`Error::Option`].
pub fn pose_graph(
    frames: &[MeasuredFrame],
    estimate: &Estimate,
    cameras: &[Camera],
    noise: MeasurementNoise,
    options: &GraphOptions,
    seed: u64,
) -> Result<(FactorGraph, PoseGraphSummary), Error> {
    let (chosen, frames_without_pose) = vertices(frames, estimate, cameras, options)?;
    let mut summary = PoseGraphSummary {
        poses: chosen.len(),
        frames_without_pose,
        frames_left_out: frames.len() - frames_without_pose - chosen.len(),
        ..PoseGraphSummary::default()
    };
    let mut factors = Vec::new();
    for pair in chosen.windows(2) {
        let [before, after] = pair else { continue };
        let estimated = after.world_from_camera.inverse() * before.world_from_camera;
        let found = between(after, before, &noise, Some(&estimated), seed);
        let information = found.map_or_else(guessed, |found| found.information);
        summary.guessed += usize::from(found.is_none());
        summary.neighbours += 1;
        factors.push(factor(&options.name, factors.len(), [after, before], &estimated, &information));
    }
    if let Some(rule) = options.loops {
        for (later, earlier) in loops(&chosen, rule) {
            let (later, earlier) = (&chosen[later], &chosen[earlier]);
            match between(later, earlier, &noise, None, seed) {
                Some(found) => {
                    let (measured, information) = (found.frame_from_other, found.information);
                    factors.push(factor(
                        &options.name,
                        factors.len(),
                        [later, earlier],
                        &measured,
                        &information,
                    ));
                    summary.loops += 1;
                }
                None => summary.loops_refused += 1,
            }
        }
    }
    let mut poses: Vec<GraphPose> = chosen
        .iter()
        .enumerate()
        .map(|(place, vertex)| {
            let row = vertex.row.world_from_camera();
            GraphPose::new(options.name.clone(), vertex.frame.frame_id, place == 0, row)
        })
        .collect();
    poses.sort_by_key(|row| row.frame_id);
    let graph = FactorGraph {
        name: options.name.clone(),
        cameras: cameras.to_vec(),
        camera_of_frame: frames.iter().map(|frame| (frame.frame_id, frame.camera_id)).collect(),
        noise,
        poses,
        factors,
        ..FactorGraph::default()
    };
    Ok((graph, summary))
}

fn between(
    frame: &Vertex<'_>,
    other: &Vertex<'_>,
    noise: &MeasurementNoise,
    start: Option<&Pose>,
    seed: u64,
) -> Option<super::RelativePose> {
    relative_pose((frame.frame, &frame.camera), (other.frame, &other.camera), noise, start, seed)
}

fn guessed() -> Matrix6<f64> {
    let [turn, shift] = GUESSED.map(|sigma| 1.0 / (sigma * sigma));
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
}

fn factor(
    graph: &str,
    factor_id: usize,
    [frame, other]: [&Vertex<'_>; 2],
    frame_from_other: &Pose,
    information: &Matrix6<f64>,
) -> GraphFactor {
    let upper = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    GraphFactor {
        graph: graph.to_owned(),
        factor_id: i64::try_from(factor_id).unwrap_or(i64::MAX),
        kind: registry::RELATIVE_POSE.to_owned(),
        frame_id: Some(frame.frame.frame_id),
        other_frame_id: Some(other.frame.frame_id),
        measurement: PoseRow::from(frame_from_other).numbers().to_vec(),
        information: Some(upper.map(|place| information[place]).collect()),
        ..GraphFactor::default()
    }
}
