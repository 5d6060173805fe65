//! Residuals of relative poses, as pose graphs have them.

use super::factor::Factor;
use super::parametrisation::{quaternion, rotation, translation};
use super::pose_factor::adjoint;
use super::problem::{Values, Variable};
use crate::geometry::Pose;
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

/// A frame as seen from another.
///
/// `r = W [2 vec q; t]` of `Z⁻¹ T = (q, t)`, with the measured `Z` and the predicted `T = frame_from_world · world_from_other`; of the two
/// quaternions the one with `q_w ≥ 0`. Where the error is small, it is `Ad(Z⁻¹) ξ` of `Exp(ξ) Z = T`.
///
/// # Source
/// Kümmerle et al. 2011, `g2o`, whose error `vec q` is doubled here, so that information is per radian: Ceres, GTSAM and SE-Sync read its
/// files so.
pub(super) struct RelativePoseFactor {
    /// The frame and the other frame.
    variables: [Variable; 2],
    /// `q` and `Rᵀ` of `Z⁻¹`, and the translation of `Z`.
    turn_back: UnitQuaternion<f64>,
    rotation_back: Matrix3<f64>,
    shift: Vector3<f64>,
    /// `W`: `WᵀW` is the information over `[2 vec q; t]`.
    root: Matrix6<f64>,
}

impl RelativePoseFactor {
    /// A measured relative pose.
    ///
    /// * `variables` — the frame and the other frame; `frame_from_other` — `Z`.
    /// * `root` — `W` with `WᵀW` the information over the tangent `ξ`.
    pub(super) fn new(variables: [Variable; 2], frame_from_other: &Pose, root: &Matrix6<f64>) -> Self {
        let back = frame_from_other.inverse();
        Self {
            variables,
            turn_back: back.rotation(),
            rotation_back: back.rotation_matrix(),
            shift: frame_from_other.translation(),
            root: root * adjoint(frame_from_other),
        }
    }
}

impl Factor for RelativePoseFactor {
    const RESIDUALS: usize = 6;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    #[inline]
    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (frame, other) = (values.of(self.variables[0]), values.of(self.variables[1]));
        let turn = rotation(frame) * rotation(other).transpose();
        let shift = translation(frame) - turn * translation(other);
        let q = self.turn_back.into_inner() * quaternion(frame) * quaternion(other).conjugate();
        let q = if q.w < 0.0 { -q } else { q };
        let vector = q.imag();
        let away = self.rotation_back * (shift - self.shift);
        let error = Vector6::new(2.0 * vector.x, 2.0 * vector.y, 2.0 * vector.z, away.x, away.y, away.z);
        residual.copy_from_slice((self.root * error).as_slice());
        if let Some(jacobian) = jacobian {
            // Z⁻¹ Exp(δ₁) T: 2 vec q moves by (w I − [vec q]ₓ) Rᵀω, t by Rᵀ(v + ω × T.t).
            let (upright, cross) = (Matrix3::from_diagonal_element(q.w), vector.cross_matrix());
            let by_turn = (upright - cross) * self.rotation_back;
            let by_arm = -self.rotation_back * shift.cross_matrix();
            // Z⁻¹ T Exp(−δ₂): 2 vec q moves by −(w I + [vec q]ₓ) ω, t by −R v.
            let by_other_turn = -(upright + cross);
            let by_other_shift = -self.rotation_back * turn;
            let (of_turn, of_shift) = (self.root.fixed_columns::<3>(0), self.root.fixed_columns::<3>(3));
            let blocks = [
                of_turn * by_turn + of_shift * by_arm,
                of_shift * self.rotation_back,
                of_turn * by_other_turn,
                of_shift * by_other_shift,
            ];
            for (row, line) in jacobian.chunks_exact_mut(12).enumerate() {
                for (block, part) in blocks.iter().zip(line.chunks_exact_mut(3)) {
                    for (column, entry) in part.iter_mut().enumerate() {
                        *entry = block[(row, column)];
                    }
                }
            }
        }
        residual.iter().all(|number| number.is_finite())
    }
}
