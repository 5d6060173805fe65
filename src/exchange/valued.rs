//! A factor graph whose vertices have the values of an estimate, or the true ones.

use std::collections::BTreeMap;

use super::remark::Remarks;
use super::{Error, Remark};
use crate::geometry::Segment;
use crate::structure::{
    FactorGraph, FrameId, GraphFactor, GraphLine, GraphPoint, GraphPose, LineId, MapLine, MeasuredFrame,
    MeasurementNoise, PointId, PoseRow, Sequence, registry,
};

/// Values of vertices, by their ids.
#[derive(Clone, Debug, Default)]
struct Values {
    poses: BTreeMap<FrameId, PoseRow>,
    points: BTreeMap<PointId, [f64; 3]>,
    lines: BTreeMap<LineId, Segment>,
}

impl Values {
    fn of_estimate(sequence: &Sequence, name: &str) -> Self {
        let poses = sequence.trajectories.iter().filter(|row| row.estimate == name);
        let points = sequence.map_points.iter().filter(|row| row.estimate == name);
        let lines = sequence.map_lines.iter().filter(|row| row.estimate == name);
        Self {
            poses: poses.map(|row| (row.frame_id, row.world_from_camera())).collect(),
            points: points.map(|row| (row.point_id, [row.x, row.y, row.z])).collect(),
            lines: lines.map(|row| (row.line_id, MapLine::segment(row))).collect(),
        }
    }

    fn of_truth(sequence: &Sequence) -> Self {
        let poses = sequence.frames.iter();
        let points = sequence.point_landmarks.iter();
        Self {
            poses: poses.filter_map(|row| Some((row.frame_id, row.world_from_camera()?))).collect(),
            points: points.map(|row| (row.point_id, [row.x, row.y, row.z])).collect(),
            lines: sequence.line_landmarks.iter().map(|row| (row.line_id, row.segment())).collect(),
        }
    }
}

/// A graph of a sequence with the poses and the map of an estimate as its values.
///
/// Vertices that the estimate does not have, and factors of these, are left out. Where the sequence has no graph of the
/// name, the measurements become factors: each of a frame and a landmark that the estimate has; nothing is fixed then.
///
/// * `graph` — name of the graph.
/// * `estimate` — name of the estimate; `None` for the true values.
///
/// # Errors
/// [`Error::Unfit`] when there are no poses of the estimate.
pub fn valued_graph(
    sequence: &Sequence,
    graph: &str,
    estimate: Option<&str>,
) -> Result<(FactorGraph, Vec<Remark>), Error> {
    let values =
        estimate.map_or_else(|| Values::of_truth(sequence), |name| Values::of_estimate(sequence, name));
    if values.poses.is_empty() {
        let what = estimate.map_or("true values".to_owned(), |name| format!("estimate `{name}`"));
        return Err(Error::unfit(what, "poses", "none"));
    }
    let mut valued = FactorGraph::of(sequence, graph).unwrap_or_else(|| measured(sequence, graph, &values));
    let sizes =
        |graph: &FactorGraph| [graph.poses.len(), graph.points.len(), graph.lines.len(), graph.factors.len()];
    let before = sizes(&valued);
    valued.poses.retain_mut(|row| match values.poses.get(&row.frame_id) {
        Some(pose) => {
            *row = GraphPose::new(std::mem::take(&mut row.graph), row.frame_id, row.fixed, *pose);
            true
        }
        None => false,
    });
    valued.points.retain_mut(|row| match values.points.get(&row.point_id) {
        Some(position) => {
            [row.x, row.y, row.z] = *position;
            true
        }
        None => false,
    });
    valued.lines.retain_mut(|row| match values.lines.get(&row.line_id) {
        Some(segment) => {
            let ([a, b, c], [d, e, f]) = (segment.start.coords.into(), segment.end.coords.into());
            [row.start_x, row.start_y, row.start_z] = [a, b, c];
            [row.end_x, row.end_y, row.end_z] = [d, e, f];
            true
        }
        None => false,
    });
    valued.factors.retain(|row| {
        row.frame_id.is_none_or(|id| values.poses.contains_key(&id))
            && row.other_frame_id.is_none_or(|id| values.poses.contains_key(&id))
            && row.point_id.is_none_or(|id| values.points.contains_key(&id))
            && row.line_id.is_none_or(|id| values.lines.contains_key(&id))
    });
    let after = sizes(&valued);
    let mut remarks = Remarks::default();
    for (place, what) in ["poses", "points", "lines", "factors"].into_iter().enumerate() {
        remarks.lost(
            before[place] - after[place],
            format!("{what} are left out: the estimate lacks their vertices"),
        );
    }
    Ok((valued, remarks.into_vec()))
}

/// A graph of all measurements; its vertices get their values afterwards.
fn measured(sequence: &Sequence, name: &str, values: &Values) -> FactorGraph {
    let graph = || name.to_owned();
    let mut made = FactorGraph::of(&Sequence::default(), name).unwrap_or_default();
    made.name = graph();
    made.cameras.clone_from(&sequence.manifest.cameras);
    made.noise = MeasurementNoise::declared(&sequence.manifest);
    made.camera_of_frame = sequence.frames.iter().map(|row| (row.frame_id, row.camera_id)).collect();
    made.poses = values.poses.iter().map(|(id, pose)| GraphPose::new(graph(), *id, false, *pose)).collect();
    made.points = values
        .points
        .keys()
        .map(|id| GraphPoint { graph: graph(), point_id: *id, ..GraphPoint::default() })
        .collect();
    made.lines = values
        .lines
        .keys()
        .map(|id| GraphLine { graph: graph(), line_id: *id, ..GraphLine::default() })
        .collect();
    for frame in MeasuredFrame::of(sequence) {
        for row in &frame.points {
            made.factors.push(GraphFactor {
                kind: registry::POINT_REPROJECTION.to_owned(),
                frame_id: Some(frame.frame_id),
                point_id: Some(row.point_id),
                measurement: [Some(row.u), Some(row.v), row.depth].into_iter().flatten().collect(),
                ..GraphFactor::default()
            });
        }
        for row in &frame.lines {
            let measurement = match row.start_depth.zip(row.end_depth) {
                Some((start, end)) => vec![row.start_u, row.start_v, start, row.end_u, row.end_v, end],
                None => vec![row.start_u, row.start_v, row.end_u, row.end_v],
            };
            made.factors.push(GraphFactor {
                kind: registry::LINE_REPROJECTION.to_owned(),
                frame_id: Some(frame.frame_id),
                line_id: Some(row.line_id),
                measurement,
                ..GraphFactor::default()
            });
        }
    }
    for (id, factor) in (0..).zip(&mut made.factors) {
        factor.graph = graph();
        factor.factor_id = id;
    }
    made
}
