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
        let p = r * Vector3::new(point[0], point[1], point[2]) + translation(pose);
        let Some((found, by_point)) = self.sight.look(&p) else { return false };
        residual.copy_from_slice(found.as_slice());
        if let Some(jacobian) = jacobian {
            let by_world = by_point * r;
            for row in 0..R {
                let line = &mut jacobian[row * 9..(row + 1) * 9];
                write_pose_columns(&by_point, row, &p, line);
                line[6] = by_world[(row, 0)];
                line[7] = by_world[(row, 1)];
                line[8] = by_world[(row, 2)];
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
    let j = Vector3::new(by_point[(row, 0)], by_point[(row, 1)], by_point[(row, 2)]);
    // j · (ω × p) = ω · (p × j)
    let turned = p.cross(&j);
    line[..3].copy_from_slice(turned.as_slice());
    line[3..6].copy_from_slice(j.as_slice());
}
