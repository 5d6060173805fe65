//! Points by direction and inverse depth in a frame that sees them.

use super::factor::Factor;
use super::parametrisation::{rotation, translation};
use super::point_factor::write_pose_columns;
use super::point_sight::PointSight;
use super::problem::{Values, Variable};
use nalgebra::{Matrix3, Vector3};

/// A point `[x, y, ρ]` of its host, `ʰp = (x, y, 1)/ρ`, seen from another frame.
///
/// `ᵗp = ᵗT_w · (ʰT_w)⁻¹ · ʰp`
///
/// # Source
/// Civera, Davison and Montiel 2008, *Inverse depth parametrization for monocular SLAM*, with slopes in place of angles.
pub(super) struct InverseDepthFactor<S, const R: usize> {
    /// Frame, host and point.
    pub(super) variables: [Variable; 3],
    pub(super) sight: S,
}

/// The point in its host, metres, and its derivative by `[x, y, ρ]`.
pub(super) fn point_in_host(numbers: &[f64]) -> (Vector3<f64>, Matrix3<f64>) {
    let depth = 1.0 / numbers[2];
    let ray = Vector3::new(numbers[0], numbers[1], 1.0);
    let by_depth = ray * -(depth * depth);
    let columns = [Vector3::x() * depth, Vector3::y() * depth, by_depth];
    (ray * depth, Matrix3::from_columns(&columns))
}

/// `[x, y, ρ]` of a point in its host.
pub(super) fn numbers_in_host(p: &Vector3<f64>) -> [f64; 3] {
    [p.x / p.z, p.y / p.z, 1.0 / p.z]
}

impl<S: PointSight<R>, const R: usize> Factor for InverseDepthFactor<S, R> {
    const RESIDUALS: usize = R;
    type Variables = [Variable; 3];

    fn variables(&self) -> [Variable; 3] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let [frame, host, numbers] = self.variables.map(|variable| values.of(variable));
        let (in_host, by_numbers) = point_in_host(numbers);
        let turn = rotation(frame) * rotation(host).transpose();
        let p = turn * (in_host - translation(host)) + translation(frame);
        let Some((found, by_point)) = self.sight.look(&p) else { return false };
        residual.copy_from_slice(found.as_slice());
        if let Some(jacobian) = jacobian {
            // A step of the host moves the point in the host by its inverse.
            let by_host = by_point * -turn;
            let by_form = by_point * (turn * by_numbers);
            for row in 0..R {
                let line = &mut jacobian[row * 15..(row + 1) * 15];
                write_pose_columns(&by_point, row, &p, &mut line[..6]);
                write_pose_columns(&by_host, row, &in_host, &mut line[6..12]);
                for k in 0..3 {
                    line[12 + k] = by_form[(row, k)];
                }
            }
        }
        true
    }
}

/// A point `[x, y, ρ]` seen from its host itself, whose pose does not matter.
pub(super) struct HostFactor<S, const R: usize> {
    /// The point.
    pub(super) variables: [Variable; 1],
    pub(super) sight: S,
}

impl<S: PointSight<R>, const R: usize> Factor for HostFactor<S, R> {
    const RESIDUALS: usize = R;
    type Variables = [Variable; 1];

    fn variables(&self) -> [Variable; 1] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (p, by_numbers) = point_in_host(values.of(self.variables[0]));
        let Some((found, by_point)) = self.sight.look(&p) else { return false };
        residual.copy_from_slice(found.as_slice());
        if let Some(jacobian) = jacobian {
            let by_form = by_point * by_numbers;
            for row in 0..R {
                for k in 0..3 {
                    jacobian[row * 3 + k] = by_form[(row, k)];
                }
            }
        }
        true
    }
}
