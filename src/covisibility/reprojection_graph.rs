//! Poses, points, lines, and a factor for each measurement.

use std::collections::{BTreeMap, BTreeSet};

use super::key_frames::vertices;
use super::{Error, GraphOptions};
use crate::structure::{
    Camera, Estimate, FactorGraph, GraphFactor, GraphLine, GraphPoint, GraphPose, LineId, LineMeasurement,
    MeasuredFrame, MeasurementNoise, PointId, PointMeasurement, StructuralGroup, registry,
};

/// What went into a graph and what did not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GraphSummary {
    /// Pose vertices.
    pub poses: usize,
    /// Point vertices.
    pub points: usize,
    /// Line vertices.
    pub lines: usize,
    /// Factors of points.
    pub point_factors: usize,
    /// Factors of lines.
    pub line_factors: usize,
    /// Factors of parallel groups.
    pub parallelism_factors: usize,
    /// Frames without an estimated pose.
    pub frames_without_pose: usize,
    /// Frames that no rule chose as key frames.
    pub frames_left_out: usize,
    /// Landmarks that were measured and are not in the estimate's map.
    pub landmarks_not_in_map: usize,
    /// Landmarks of the map with fewer views than asked for.
    pub landmarks_with_few_views: usize,
    /// Measurements that are not finite.
    pub measurements_not_finite: usize,
}

/// A co-visibility graph: initial values of an estimate, and a factor for each measurement of its landmarks.
///
/// The first pose is fixed. Factors have no information matrix: the declared noise applies. A depth that was measured
/// is the third number of a point's factor; a line's factor has depths when both ends do. A line that belongs to a
/// `parallel` group has a `parallelism` factor.
///
/// * `frames` — measurements in the order of stamps.
/// * `estimate` — poses and map to begin with.
/// * `groups` — structural groups; only kinds and lines are used.
///
/// # Errors
/// [`Error::NoPoses`], [`Error::Pose`], [`Error::Camera`], [`Error::Option`].
///
/// # Source
/// Open-Structure (Li et al. 2024), section "Co-visibility Factor Graph Construction".
pub fn reprojection_graph(
    frames: &[MeasuredFrame],
    estimate: &Estimate,
    cameras: &[Camera],
    noise: MeasurementNoise,
    groups: &[StructuralGroup],
    options: &GraphOptions,
) -> Result<(FactorGraph, GraphSummary), Error> {
    let (chosen, frames_without_pose) = vertices(frames, estimate, cameras, options)?;
    let mut summary = GraphSummary {
        frames_without_pose,
        frames_left_out: frames.len() - frames_without_pose - chosen.len(),
        ..GraphSummary::default()
    };
    let mut point_views: BTreeMap<PointId, usize> = BTreeMap::new();
    let mut line_views: BTreeMap<LineId, usize> = BTreeMap::new();
    for vertex in &chosen {
        for row in vertex.frame.points.iter().filter(|row| is_finite_point(row)) {
            *point_views.entry(row.point_id).or_default() += 1;
        }
        for row in vertex.frame.lines.iter().filter(|row| is_finite_line(row)) {
            *line_views.entry(row.line_id).or_default() += 1;
        }
    }
    let graph = options.name.clone();
    let points: Vec<GraphPoint> = estimate
        .points
        .iter()
        .filter(|row| point_views.get(&row.point_id).is_some_and(|views| *views >= options.least_views))
        .map(|row| GraphPoint { graph: graph.clone(), point_id: row.point_id, x: row.x, y: row.y, z: row.z })
        .collect();
    let lines: Vec<GraphLine> = estimate
        .lines
        .iter()
        .filter(|row| line_views.get(&row.line_id).is_some_and(|views| *views >= options.least_views))
        .map(|row| GraphLine::new(graph.clone(), row.line_id, &row.segment()))
        .collect();
    let in_map: BTreeSet<PointId> = estimate.points.iter().map(|row| row.point_id).collect();
    let lines_in_map: BTreeSet<LineId> = estimate.lines.iter().map(|row| row.line_id).collect();
    summary.landmarks_not_in_map = point_views.keys().filter(|id| !in_map.contains(id)).count()
        + line_views.keys().filter(|id| !lines_in_map.contains(id)).count();
    let few = |views: &usize| *views < options.least_views;
    summary.landmarks_with_few_views =
        point_views.iter().filter(|(id, views)| in_map.contains(id) && few(views)).count()
            + line_views.iter().filter(|(id, views)| lines_in_map.contains(id) && few(views)).count();

    let known_points: BTreeSet<PointId> = points.iter().map(|row| row.point_id).collect();
    let known_lines: BTreeSet<LineId> = lines.iter().map(|row| row.line_id).collect();
    let mut factors: Vec<GraphFactor> = Vec::new();
    let factor = |kind: &str, factors: &Vec<GraphFactor>| GraphFactor {
        graph: graph.clone(),
        factor_id: i64::try_from(factors.len()).unwrap_or(i64::MAX),
        kind: kind.to_owned(),
        ..GraphFactor::default()
    };
    for vertex in &chosen {
        let frame_id = Some(vertex.frame.frame_id);
        for row in &vertex.frame.points {
            if !is_finite_point(row) {
                summary.measurements_not_finite += 1;
            } else if known_points.contains(&row.point_id) {
                let measurement = [Some(row.u), Some(row.v), row.depth].into_iter().flatten().collect();
                let (kind, point_id) = (registry::POINT_REPROJECTION, Some(row.point_id));
                factors.push(GraphFactor { frame_id, point_id, measurement, ..factor(kind, &factors) });
                summary.point_factors += 1;
            }
        }
        for row in &vertex.frame.lines {
            if !is_finite_line(row) {
                summary.measurements_not_finite += 1;
            } else if known_lines.contains(&row.line_id) {
                let (kind, line_id) = (registry::LINE_REPROJECTION, Some(row.line_id));
                let measurement = line_numbers(row);
                factors.push(GraphFactor { frame_id, line_id, measurement, ..factor(kind, &factors) });
                summary.line_factors += 1;
            }
        }
    }
    for group in groups.iter().filter(|group| group.kind == registry::PARALLEL) {
        for line_id in group.line_ids.iter().filter(|line_id| known_lines.contains(line_id)) {
            let (group_id, line_id) = (Some(group.group_id), Some(*line_id));
            factors.push(GraphFactor { line_id, group_id, ..factor(registry::PARALLELISM, &factors) });
            summary.parallelism_factors += 1;
        }
    }
    let poses: Vec<GraphPose> = chosen
        .iter()
        .enumerate()
        .map(|(place, vertex)| {
            let row = vertex.row.world_from_camera();
            GraphPose::new(graph.clone(), vertex.frame.frame_id, place == 0, row)
        })
        .collect();
    summary.poses = poses.len();
    summary.points = points.len();
    summary.lines = lines.len();
    let camera_of_frame = frames.iter().map(|frame| (frame.frame_id, frame.camera_id)).collect();
    let mut built = FactorGraph {
        name: graph.clone(),
        cameras: cameras.to_vec(),
        camera_of_frame,
        noise,
        poses,
        points,
        lines,
        factors,
        groups: groups.iter().map(StructuralGroup::without_direction).collect(),
    };
    built.poses.sort_by_key(|row| row.frame_id);
    built.points.sort_by_key(|row| row.point_id);
    built.lines.sort_by_key(|row| row.line_id);
    Ok((built, summary))
}

fn is_finite_point(row: &PointMeasurement) -> bool {
    row.u.is_finite() && row.v.is_finite() && row.depth.is_none_or(f64::is_finite)
}

fn is_finite_line(row: &LineMeasurement) -> bool {
    [row.start_u, row.start_v, row.end_u, row.end_v].into_iter().all(f64::is_finite)
        && [row.start_depth, row.end_depth].into_iter().flatten().all(f64::is_finite)
}

/// The numbers of a line's factor: with depths when both ends have one.
fn line_numbers(row: &LineMeasurement) -> Vec<f64> {
    match (row.start_depth, row.end_depth) {
        (Some(start), Some(end)) => vec![row.start_u, row.start_v, start, row.end_u, row.end_v, end],
        _ => vec![row.start_u, row.start_v, row.end_u, row.end_v],
    }
}
