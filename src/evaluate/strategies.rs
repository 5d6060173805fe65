//! Random poses, paths and similarities for the tests of this room.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::Similarity;
use crate::geometry::Pose;
use crate::structure::FrameId;

/// A vector in a cube of this half side.
pub(super) fn vector(half: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-half..half).prop_map(Vector3::from)
}

/// A point within 5 m of the origin along each axis.
pub(super) fn point() -> impl Strategy<Value = Point3<f64>> {
    vector(5.0).prop_map(Point3::from)
}

/// Any rotation, and a translation within 5 m along each axis.
pub(super) fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform4(-1.0..1.0), vector(5.0))
        .prop_filter("a quaternion with a direction", |(q, _)| q.iter().map(|c| c * c).sum::<f64>() > 0.01)
        .prop_map(|(q, t)| Pose::from_components(t.into(), q).unwrap())
}

/// Any motion and a scale from 0.2 to 5.
pub(super) fn similarity() -> impl Strategy<Value = Similarity> {
    (pose(), 0.2..5.0_f64).prop_map(|(pose, scale)| Similarity { scale, pose })
}

/// Twelve poses, of which four at least span a volume.
pub(super) fn path() -> impl Strategy<Value = Vec<(FrameId, Pose)>> {
    prop::collection::vec(pose(), 12).prop_map(|mut poses| {
        for (corner, pose) in [Vector3::zeros(), Vector3::x() * 6.0, Vector3::y() * 7.0, Vector3::z() * 8.0]
            .iter()
            .zip(&mut poses)
        {
            *pose = Pose::new(pose.rotation(), pose.translation() * 0.1 + corner);
        }
        (0..).map(FrameId).zip(poses).collect()
    })
}
