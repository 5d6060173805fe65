//! The initial factor graph of a sequence.

use super::landmarks::{Points, Segments, points, segments};
use super::ledger::Ledger;
use super::poses::{Poses, is_frame, poses};
use crate::text_release::Association;
use open_structure::structure::{
    FrameId, GraphFactor, GraphLine, GraphPoint, GraphPose, LineId, PointId, Sequence, registry,
};

/// Name of the graph.
pub const INITIAL: &str = "initial";

/// Initial values of the graph's vertices. Where a file has several blocks, the last value of an id holds.
#[derive(Default)]
pub(super) struct Vertices {
    pub(super) poses: Poses,
    pub(super) points: Points,
    pub(super) lines: Segments,
}

impl Vertices {
    /// The vertices of a graph.
    pub(super) fn of(graph: &Association, ledger: &mut Ledger) -> Self {
        let mut vertices = Self::default();
        let file = &graph.file;
        for block in &graph.rows.vertices {
            vertices.poses.extend(poses(&block.rows, file, ledger));
        }
        for block in &graph.rows.points {
            vertices.points.extend(points(&block.rows, file, ledger));
        }
        for block in &graph.rows.lines {
            vertices.lines.extend(segments(&block.rows, file, ledger));
        }
        vertices
    }
}

/// Puts vertices and factors into the sequence; the pose of the smallest id is held fixed.
pub(super) fn add_graph(
    graph: &Association,
    vertices: &Vertices,
    sequence: &mut Sequence,
    ledger: &mut Ledger,
) {
    let name = || INITIAL.to_owned();
    let first = vertices.poses.keys().next().copied();
    sequence.graph_poses = vertices
        .poses
        .iter()
        .map(|(id, pose)| GraphPose::new(name(), *id, Some(*id) == first, pose.row))
        .collect();
    sequence.graph_points = vertices
        .points
        .iter()
        .map(|(id, at)| GraphPoint { graph: name(), point_id: *id, x: at.x, y: at.y, z: at.z })
        .collect();
    sequence.graph_lines =
        vertices.lines.iter().map(|(id, segment)| GraphLine::new(name(), *id, segment)).collect();

    // In the order of the file, whose line numbers say it.
    let mut factors: Vec<(u32, GraphFactor)> = Vec::new();
    let absent = "factor names a vertex that the graph lacks, or a negative id";
    for row in &graph.rows.point_observations {
        let (frame, point) = (FrameId(row.frame), PointId(row.point));
        if !is_frame(row.frame)
            || !vertices.poses.contains_key(&frame)
            || !vertices.points.contains_key(&point)
        {
            ledger.exclude(&graph.file, absent, Some(row.row));
            continue;
        }
        let factor = GraphFactor {
            graph: name(),
            kind: registry::POINT_REPROJECTION.to_owned(),
            frame_id: Some(frame),
            point_id: Some(point),
            measurement: vec![row.u, row.v],
            ..GraphFactor::default()
        };
        factors.push((row.row, factor));
    }
    for row in &graph.rows.line_observations {
        let (frame, line) = (FrameId(row.frame), LineId(row.line));
        if !is_frame(row.frame) || !vertices.poses.contains_key(&frame) || !vertices.lines.contains_key(&line)
        {
            ledger.exclude(&graph.file, absent, Some(row.row));
            continue;
        }
        let factor = GraphFactor {
            graph: name(),
            kind: registry::LINE_REPROJECTION.to_owned(),
            frame_id: Some(frame),
            line_id: Some(line),
            measurement: row.start.iter().chain(&row.end).copied().collect(),
            ..GraphFactor::default()
        };
        factors.push((row.row, factor));
    }
    factors.sort_by_key(|(line, _)| *line);
    sequence.graph_factors =
        (0..).zip(factors).map(|(factor_id, (_, factor))| GraphFactor { factor_id, ..factor }).collect();
}
