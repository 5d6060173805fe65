//! Residuals of poses alone: relative poses and priors.

use super::factor::Factor;
use super::parametrisation::PoseSpace;
use super::problem::{Values, Variable};
use crate::geometry::Pose;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// A frame as seen from another: `ξ` of `Exp(ξ) · measured = frame_from_world · world_from_other`.
pub(super) struct RelativePoseFactor {
    /// The frame and the other frame.
    pub(super) variables: [Variable; 2],
    pub(super) other_from_frame: Pose,
    /// `W`: `WᵀW` is the information over `ξ`.
    pub(super) root: Matrix6<f64>,
}

impl Factor for RelativePoseFactor {
    const RESIDUALS: usize = 6;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let frame = PoseSpace::pose_of(values.of(self.variables[0]));
        let other = PoseSpace::pose_of(values.of(self.variables[1]));
        let predicted = frame * other.inverse();
        let error = (predicted * self.other_from_frame).log();
        residual.copy_from_slice((self.root * error).as_slice());
        if let Some(jacobian) = jacobian {
            // Exp(δ₁) E, and E' = frame Exp(−δ₂) other⁻¹ measured⁻¹ = Exp(−Ad(predicted) δ₂) E.
            let by_frame = self.root * inverse_left_jacobian(&error);
            let by_other = -by_frame * adjoint(&predicted);
            for row in 0..6 {
                for column in 0..6 {
                    jacobian[row * 12 + column] = by_frame[(row, column)];
                    jacobian[row * 12 + 6 + column] = by_other[(row, column)];
                }
            }
        }
        residual.iter().all(|number| number.is_finite())
    }
}

/// A pose that is known beforehand: `ξ` of `Exp(ξ) · known = camera_from_world`.
pub(super) struct PosePriorFactor {
    pub(super) variables: [Variable; 1],
    pub(super) world_from_camera: Pose,
    pub(super) root: Matrix6<f64>,
}

impl Factor for PosePriorFactor {
    const RESIDUALS: usize = 6;
    type Variables = [Variable; 1];

    fn variables(&self) -> [Variable; 1] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let error = (PoseSpace::pose_of(values.of(self.variables[0])) * self.world_from_camera).log();
        residual.copy_from_slice((self.root * error).as_slice());
        if let Some(jacobian) = jacobian {
            let by_pose = self.root * inverse_left_jacobian(&error);
            for row in 0..6 {
                for column in 0..6 {
                    jacobian[row * 6 + column] = by_pose[(row, column)];
                }
            }
        }
        residual.iter().all(|number| number.is_finite())
    }
}

/// `Ad(T)`: `T Exp(ξ) = Exp(Ad(T) ξ) T`, for tangents `[rotation; translation]`.
pub(super) fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = pose.rotation_matrix();
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(pose.translation().cross_matrix() * rotation));
    matrix
}

/// `J⁻¹(ξ)`: `log(Exp(δ) Exp(ξ)) = ξ + J⁻¹(ξ) δ`.
///
/// `J⁻¹ = I − ½ ad + Σ B₂ₖ/(2k)! ad²ᵏ`, summed by halving: the series converges for turns under 2π, and fast where they are small. For larger
/// turns the closed form of its SO(3) part is used, with the mixed part by the product rule on quaternion terms.
///
/// # Source
/// Barfoot, *State Estimation for Robotics*, sections 7.1.5 and 8.
fn inverse_left_jacobian(tangent: &Vector6<f64>) -> Matrix6<f64> {
    let w = Vector3::new(tangent[0], tangent[1], tangent[2]);
    let v = Vector3::new(tangent[3], tangent[4], tangent[5]);
    let (left, mixed) = (inverse_left_rotation(&w), mixed_block(&w, &v));
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&left);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&left);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-left * mixed * left));
    matrix
}

/// `I − ½ [ω]ₓ + (1 − θ/2 · cot(θ/2))/θ² [ω]ₓ²`.
fn inverse_left_rotation(w: &Vector3<f64>) -> Matrix3<f64> {
    let angle = w.norm();
    let cross = w.cross_matrix();
    let second = if angle < 1e-2 {
        let s = angle * angle;
        (1.0 + s / 60.0 * (1.0 + s / 42.0)) / 12.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * libm::cos(half) / libm::sin(half)) / (angle * angle)
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * second
}

/// `Q(ω, v)`, the lower left block of the left Jacobian of SE(3).
fn mixed_block(w: &Vector3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    let angle = w.norm();
    let s = angle * angle;
    let (a, b) = (w.cross_matrix(), v.cross_matrix());
    // (θ − sin θ)/θ³, (θ²/2 + cos θ − 1)/θ⁴, and (θ − sin θ − θ³/6)/θ⁵.
    let (c1, c2, c3) = if angle < 0.3 {
        (
            1.0 / 6.0 - s / 120.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0))),
            1.0 / 24.0 - s / 720.0 * (1.0 - s / 56.0 * (1.0 - s / 90.0 * (1.0 - s / 132.0))),
            -1.0 / 120.0 + s / 5040.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0 * (1.0 - s / 156.0))),
        )
    } else {
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        (
            (angle - sine) / (s * angle),
            (0.5 * s + cosine - 1.0) / (s * s),
            (angle - sine - s * angle / 6.0) / (s * s * angle),
        )
    };
    let (ab, ba) = (a * b, b * a);
    b * 0.5
        + (ab + ba + a * ba) * c1
        + (a * ab + ba * a - a * ba * 3.0) * c2
        + (a * ba * a + a * a * ba) * (0.5 * (c2 + 3.0 * c3))
}
