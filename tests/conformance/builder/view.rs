//! The little geometry that a scene needs: how a camera sees points, and the forms of a line.

use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};

/// A camera's numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    pub(crate) fx: f64,
    pub(crate) fy: f64,
    pub(crate) cx: f64,
    pub(crate) cy: f64,
}

/// `world_from_camera`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) position: Vector3<f64>,
    pub(crate) rotation: UnitQuaternion<f64>,
}

impl Placement {
    /// * `rotation` — rotation vector, radians.
    pub(crate) fn new(position: Vector3<f64>, rotation: Vector3<f64>) -> Self {
        Self { position, rotation: UnitQuaternion::from_scaled_axis(rotation) }
    }

    pub(crate) fn numbers(&self) -> [f64; 7] {
        let quaternion = self.rotation.quaternion().coords;
        let position = self.position;
        [position.x, position.y, position.z, quaternion.x, quaternion.y, quaternion.z, quaternion.w]
    }

    /// `self⁻¹ · other`.
    pub(crate) fn between(&self, other: &Self) -> Self {
        let back = self.rotation.inverse();
        Self { position: back * (other.position - self.position), rotation: back * other.rotation }
    }

    /// `(u, v, depth)` of a point in `world`.
    pub(crate) fn project(&self, lens: &Lens, point: Vector3<f64>) -> [f64; 3] {
        let seen = self.rotation.inverse() * (point - self.position);
        [lens.fx * seen.x / seen.z + lens.cx, lens.fy * seen.y / seen.z + lens.cy, seen.z]
    }
}

/// Moment, direction, rotation vector and angle of the line through two points.
pub(crate) fn line_forms(start: Vector3<f64>, end: Vector3<f64>) -> [f64; 10] {
    let direction = (end - start).normalize();
    let moment = start.cross(&direction);
    let first = Unit::new_normalize(moment).into_inner();
    let frame = Matrix3::from_columns(&[first, direction, first.cross(&direction)]);
    let phi = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(frame)).scaled_axis();
    let varphi = 1.0_f64.atan2(moment.norm());
    [moment.x, moment.y, moment.z, direction.x, direction.y, direction.z, phi.x, phi.y, phi.z, varphi]
}
