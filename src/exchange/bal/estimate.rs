//! Cameras and points of a problem of BAL as an estimate.

use nalgebra::Point3;

use super::import::half_turn;
use super::problem::BalProblem;
use crate::structure::{Estimate, FrameId, MapPoint, PointId, PoseRow, TrajectoryPose};

/// The poses and points of a problem as an estimate for the sequence that [`from_bal`](super::from_bal()) makes of it.
///
/// Poses get right-down-forward axes and become `world_from_camera`; ids are places in the file. Intrinsics have no place
/// in an estimate: the sequence's cameras have them.
#[must_use]
pub fn bal_estimate(problem: &BalProblem, name: &str) -> Estimate {
    let id = |place: usize| i64::try_from(place).unwrap_or(i64::MAX);
    let trajectory = problem.cameras.iter().enumerate().map(|(place, camera)| {
        let camera_from_world = half_turn() * camera.camera_from_world();
        TrajectoryPose::new(name.to_owned(), FrameId(id(place)), PoseRow::from(&camera_from_world.inverse()))
    });
    let points = problem
        .points
        .iter()
        .enumerate()
        .map(|(place, point)| MapPoint::new(name.to_owned(), PointId(id(place)), &Point3::from(*point)));
    Estimate {
        name: name.to_owned(),
        trajectory: trajectory.collect(),
        points: points.collect(),
        ..Estimate::default()
    }
}
