//! A g2o graph with its vertices where an estimate has them.

use std::collections::BTreeMap;

use super::element::{G2oGraph, G2oKind};
use super::export::flattened;
use crate::structure::{Estimate, PoseRow};

/// The graph with poses and points of an estimate in place of its vertices' values; all else keeps its digits.
///
/// Vertices that the estimate does not have stay where they are. Ids are those that [`from_g2o`](super::from_g2o()) gives.
#[must_use]
pub fn with_estimate(graph: &G2oGraph, estimate: &Estimate) -> G2oGraph {
    let poses: BTreeMap<i64, PoseRow> =
        estimate.trajectory.iter().map(|row| (row.frame_id.0, row.world_from_camera())).collect();
    let points: BTreeMap<i64, [f64; 3]> =
        estimate.points.iter().map(|row| (row.point_id.0, [row.x, row.y, row.z])).collect();
    let mut moved = graph.clone();
    for element in &mut moved.elements {
        let id = element.id();
        let found: Vec<f64> = match element.kind {
            G2oKind::VertexSe2 => poses.get(&id).map(|pose| flattened(pose).to_vec()),
            G2oKind::VertexSe3 | G2oKind::VertexExpmap | G2oKind::VertexCam => {
                poses.get(&id).map(|pose| pose.numbers().to_vec())
            }
            G2oKind::VertexPoint => points.get(&graph.point_id(id)).map(|place| place.to_vec()),
            _ => None,
        }
        .unwrap_or_default();
        // What stands behind the pose of a vertex, its camera, stays.
        for (number, found) in element.numbers.iter_mut().zip(found) {
            *number = found;
        }
    }
    moved
}
