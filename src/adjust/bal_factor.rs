//! Residuals of points seen by cameras with intrinsics of their own.

use super::bal_camera::intrinsics;
use super::factor::Factor;
use super::parametrisation::{rotation, translation};
use super::problem::{Values, Variable};
use nalgebra::Vector3;

/// Nearer to the plane of the camera than this nothing has an image.
const NEAREST_Z: f64 = 1e-12;

/// A point of the world seen by a camera of BAL.
///
/// `r = f ρ m − u`, `m = −(P.x, P.y)/P.z`, `P = R X + t`, `ρ = 1 + k1 |m|² + k2 |m|⁴`: pixels, predicted less measured. A point behind the
/// camera has an image too.
///
/// # Source
/// Agarwal et al. 2010, *Bundle Adjustment in the Large*.
pub(super) struct BalFactor {
    /// Camera and point.
    pub(super) variables: [Variable; 2],
    /// `u`, pixels from the middle of the image, y up.
    pub(super) pixel: [f64; 2],
}

/// Columns of the Jacobian: nine of the camera, three of the point.
const COLUMNS: usize = 12;

impl Factor for BalFactor {
    const RESIDUALS: usize = 2;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    #[inline]
    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (camera, point) = (values.of(self.variables[0]), values.of(self.variables[1]));
        let [focal, k1, k2] = *intrinsics(camera) else { return false };
        let r = rotation(camera);
        let turned = r * Vector3::new(point[0], point[1], point[2]);
        let p = turned + translation(camera);
        if p.z.abs() < NEAREST_Z || p.z.is_nan() {
            return false;
        }
        let inverse = 1.0 / p.z;
        let m = [-p.x * inverse, -p.y * inverse];
        let squared = m[0] * m[0] + m[1] * m[1];
        let radial = 1.0 + squared * (k1 + squared * k2);
        residual[0] = focal * radial * m[0] - self.pixel[0];
        residual[1] = focal * radial * m[1] - self.pixel[1];
        let Some((lines, [])) = jacobian.map(|all| all.as_chunks_mut::<COLUMNS>()) else { return true };
        // ∂r/∂m = f (ρ I + c m mᵀ) with c = 2 k1 + 4 k2 |m|², and ∂m/∂P = −[I, m]/P.z.
        let slope = 2.0 * k1 + 4.0 * k2 * squared;
        let scale = -focal * inverse;
        for (row, line) in lines.iter_mut().enumerate() {
            let mut by_image = [slope * m[row] * m[0], slope * m[row] * m[1]];
            by_image[row] += radial;
            let by_depth = by_image[0] * m[0] + by_image[1] * m[1];
            let j = Vector3::new(scale * by_image[0], scale * by_image[1], scale * by_depth);
            // j · (ω × R X) = ω · (R X × j)
            let by_turn = turned.cross(&j);
            let by_point = r.tr_mul(&j);
            *line = [
                by_turn.x,
                by_turn.y,
                by_turn.z,
                j.x,
                j.y,
                j.z,
                radial * m[row],
                focal * squared * m[row],
                focal * squared * squared * m[row],
                by_point.x,
                by_point.y,
                by_point.z,
            ];
        }
        true
    }
}
