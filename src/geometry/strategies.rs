//! Random poses, cameras, points and lines for the tests of this room.

use super::{PinholeCamera, PluckerLine, Pose, Segment};
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// A vector in a cube of this half side.
pub(super) fn vector(half: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-half..half).prop_map(Vector3::from)
}

/// A point within 5 m of the origin along each axis.
pub(super) fn point() -> impl Strategy<Value = Point3<f64>> {
    vector(5.0).prop_map(Point3::from)
}

/// A tangent whose rotation is shorter than half a turn.
pub(super) fn tangent() -> impl Strategy<Value = Vector6<f64>> {
    (vector(1.8), vector(5.0))
        .prop_map(|(turn, shift)| Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z))
}

/// Any rotation, and a translation within 5 m along each axis.
pub(super) fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform4(-1.0..1.0), vector(5.0))
        .prop_filter("a quaternion with a direction", |(q, _)| q.iter().map(|c| c * c).sum::<f64>() > 0.01)
        .prop_map(|(q, t)| Pose::from_components(t.into(), q).unwrap())
}

/// A segment at least 0.1 m long.
pub(super) fn segment() -> impl Strategy<Value = Segment> {
    (point(), point())
        .prop_map(|(start, end)| Segment { start, end })
        .prop_filter("a segment with a direction", |segment| segment.length() > 0.1)
}

/// The line of such a segment.
pub(super) fn line() -> impl Strategy<Value = PluckerLine> {
    segment().prop_map(|segment| segment.plucker().unwrap())
}

/// A camera of 640 by 480 pixels, with `fy` of either sign.
pub(super) fn camera() -> impl Strategy<Value = PinholeCamera> {
    (300.0..600.0_f64, 300.0..600.0_f64, any::<bool>(), 300.0..340.0, 220.0..260.0).prop_map(
        |(fx, fy, flip, cx, cy)| {
            PinholeCamera::new(fx, if flip { -fy } else { fy }, cx, cy, 640, 480).unwrap()
        },
    )
}

/// A `camera_from_world` that looks at about the world's origin from 4 to 8 m.
pub(super) fn circle() -> impl Strategy<Value = Pose> {
    (0.0..TAU, -0.8..0.8_f64, 4.0..8.0_f64, 0.0..TAU, vector(0.3)).prop_map(
        |(azimuth, height, distance, roll, aim)| {
            let radius = (1.0 - height * height).sqrt();
            let centre = Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), height) * distance;
            let forward = (aim - centre).normalize();
            let right = forward.cross(&Vector3::z()).normalize();
            let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
            let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
            let rolled = rotation * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
            Pose::new(rolled, centre).inverse()
        },
    )
}

/// A point every camera of [`circle`] sees in front of it.
pub(super) fn visible_point() -> impl Strategy<Value = Point3<f64>> {
    vector(1.0).prop_map(Point3::from)
}

/// A segment every camera of [`circle`] sees in front of it, at least 0.3 m long.
pub(super) fn visible_segment() -> impl Strategy<Value = Segment> {
    (visible_point(), visible_point())
        .prop_map(|(start, end)| Segment { start, end })
        .prop_filter("a segment with a direction", |segment| segment.length() > 0.3)
}

/// A point in a camera, in front of it.
pub(super) fn in_front() -> impl Strategy<Value = Point3<f64>> {
    (vector(1.0), 2.0..8.0).prop_map(|(p, z)| Point3::new(p.x, p.y, z))
}
