//! A point seen from a pose: what every residual of pixels begins with.

use nalgebra::{Matrix2x3, Matrix3, Quaternion, UnitQuaternion, Vector3};

/// A point of the world in a camera.
pub struct SeenPoint {
    /// In the camera.
    pub p: Vector3<f64>,
    camera_from_world: Matrix3<f64>,
}

impl SeenPoint {
    /// Sees a point from `world_from_camera`, `[tx ty tz qw qx qy qz]`.
    pub fn new(pose: &[f64], point: &[f64]) -> Self {
        let camera_from_world = rotation(pose).inverse();
        let p = camera_from_world * (vector(point) - vector(pose));
        Self { p, camera_from_world: camera_from_world.to_rotation_matrix().into_inner() }
    }

    /// Writes the derivative of two residuals by pose and point: `∂p = −ρ − θ × p` by the tangent `[ρ, θ]` on the right.
    pub fn write(&self, by_p: &Matrix2x3<f64>, point_column: usize, jacobian: &mut faer::MatMut<'_, f64>) {
        let by_turn = by_p * self.p.cross_matrix();
        let by_point = by_p * self.camera_from_world;
        for row in 0..2 {
            for column in 0..3 {
                jacobian[(row, column)] = -by_p[(row, column)];
                jacobian[(row, 3 + column)] = by_turn[(row, column)];
                jacobian[(row, point_column + column)] = by_point[(row, column)];
            }
        }
    }
}

/// The rotation of a pose, `[tx ty tz qw qx qy qz]`.
pub fn rotation(pose: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(pose[3], pose[4], pose[5], pose[6]))
}

/// The first three numbers.
pub fn vector(numbers: &[f64]) -> Vector3<f64> {
    Vector3::new(numbers[0], numbers[1], numbers[2])
}

/// A pose as apex-solver keeps it, from a translation and a quaternion x y z w.
pub fn pose(t: &Vector3<f64>, xyzw: [f64; 4]) -> nalgebra::DVector<f64> {
    let [x, y, z, w] = xyzw;
    let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    nalgebra::DVector::from_row_slice(&[t.x, t.y, t.z, q.w, q.i, q.j, q.k])
}
