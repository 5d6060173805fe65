//! Residuals of points that are kept by their place in the world.

use super::factor::Factor;
use super::parametrisation::{rotation, translation};
use super::point_sight::PointSight;
use super::problem::{Values, Variable};
use nalgebra::{SMatrix, Vector3};

/// A point `[x, y, z]` of the world seen from a pose.
///
/// `p = R P + t`; by the pose's tangent `∂p = [−[p]ₓ, I]`, by the point `∂p = R`.
pub(super) struct PointFactor<S, const R: usize> {
    /// Pose and point.
    pub(super) variables: [Variable; 2],
    pub(super) sight: S,
}

impl<S: PointSight<R>, const R: usize> Factor for PointFactor<S, R> {
    const RESIDUALS: usize = R;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    #[inline]
    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (pose, point) = (values.of(self.variables[0]), values.of(self.variables[1]));
        let r = rotation(pose);
        let t = translation(pose);
        let along =
            |row: usize| r[(row, 0)] * point[0] + r[(row, 1)] * point[1] + r[(row, 2)] * point[2] + t[row];
        let p = Vector3::new(along(0), along(1), along(2));
        let Some((found, by_point)) = self.sight.look(&p) else { return false };
        residual.copy_from_slice(found.as_slice());
        if let Some(jacobian) = jacobian {
            for (row, line) in jacobian.chunks_exact_mut(9).enumerate().take(R) {
                write_pose_columns(&by_point, row, &p, line);
                let [a, b, c] = [by_point[(row, 0)], by_point[(row, 1)], by_point[(row, 2)]];
                for column in 0..3 {
                    line[6 + column] = a * r[(0, column)] + b * r[(1, column)] + c * r[(2, column)];
                }
            }
        }
        true
    }
}

/// Writes one row of the derivative by a pose's tangent: `[p × j, j]` for the row `j` of the derivative by `p`.
#[inline]
pub(super) fn write_pose_columns<const R: usize>(
    by_point: &SMatrix<f64, R, 3>,
    row: usize,
    p: &Vector3<f64>,
    line: &mut [f64],
) {
    let [x, y, z] = [by_point[(row, 0)], by_point[(row, 1)], by_point[(row, 2)]];
    // j · (ω × p) = ω · (p × j)
    line[..6].copy_from_slice(&[p.y * z - p.z * y, p.z * x - p.x * z, p.x * y - p.y * x, x, y, z]);
}
