//! Residuals of single poses: priors, and the scale that pixels leave open.

use super::factor::Factor;
use super::parametrisation::{PoseSpace, rotation, translation};
use super::problem::{Values, Variable};
use crate::geometry::Pose;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

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
/// With `J_l` of SO(3) and its mixed block `Q(ω, v)`: `J⁻¹ = [J_l⁻¹, 0; −J_l⁻¹ Q J_l⁻¹, J_l⁻¹]`.
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

/// The distance between a pose's centre and a place that is held: it fixes the scale that pixels alone leave open.
///
/// It is met where it begins and is the only one of its kind, so that it changes no cost.
pub(super) struct ScaleFactor {
    pub(super) variables: [Variable; 1],
    pub(super) from: Vector3<f64>,
    pub(super) distance_m: f64,
    pub(super) sigma_m: f64,
}

impl Factor for ScaleFactor {
    const RESIDUALS: usize = 1;
    type Variables = [Variable; 1];

    fn variables(&self) -> [Variable; 1] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let numbers = values.of(self.variables[0]);
        let (r, t) = (rotation(numbers), translation(numbers));
        let along = -(r.transpose() * t) - self.from;
        let distance = along.norm();
        residual[0] = (distance - self.distance_m) / self.sigma_m;
        if let Some(jacobian) = jacobian {
            // c = −Rᵀ t moves by −Rᵀ v.
            let by_shift = -(r * along) / (distance * self.sigma_m);
            jacobian[..3].fill(0.0);
            jacobian[3..].copy_from_slice(by_shift.as_slice());
        }
        distance > 0.0
    }
}
