//! A landmark's estimate after one more measurement.

use nalgebra::{Matrix3, Matrix6, Point3, SMatrix, SVector, Vector3};

use crate::geometry::{PinholeCamera, Pose, Residual, product};

/// A shift of a landmark, and its covariance after it.
pub(super) struct Fused<const L: usize> {
    pub(super) shift: SVector<f64, L>,
    pub(super) covariance: SMatrix<f64, L, L>,
}

/// What a measurement does to a landmark of a covariance: the Kalman update.
///
/// `K = Σ Jᵀ (J Σ Jᵀ + R + J_T Σ_T J_Tᵀ)⁻¹`, `δ = −K e`, `Σ ← (I − K J) Σ`
///
/// * `pose` — covariance of the tangent of `camera_from_world`.
///
/// `None` when the covariances are not positive definite.
pub(super) fn fuse<const M: usize, const L: usize>(
    residual: &Residual<M, L>,
    prior: &SMatrix<f64, L, L>,
    pose: &Matrix6<f64>,
) -> Option<Fused<L>> {
    let noise = residual.noise + congruent(&residual.by_pose, pose);
    let spread = product(prior, &residual.by_landmark.transpose());
    let innovation = noise + product(&residual.by_landmark, &spread);
    let gain = product(&spread, &inverse(&innovation)?);
    let shift = product(&-gain, &residual.error);
    let rest = SMatrix::<f64, L, L>::identity() - product(&gain, &residual.by_landmark);
    // Joseph's form, which stays symmetric and positive.
    let covariance = congruent(&rest, prior) + congruent(&gain, &noise);
    let covariance = (covariance + covariance.transpose()) * 0.5;
    (shift.iter().chain(covariance.iter()).all(|number| number.is_finite()))
        .then_some(Fused { shift, covariance })
}

/// `J Σ Jᵀ`: a covariance as it is seen through a derivative.
pub(super) fn congruent<const M: usize, const N: usize>(
    derivative: &SMatrix<f64, M, N>,
    covariance: &SMatrix<f64, N, N>,
) -> SMatrix<f64, M, M> {
    product(&product(derivative, covariance), &derivative.transpose())
}

/// The inverse of a positive definite matrix.
pub(super) fn inverse<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    // Gauss and Jordan, scaled to a unit diagonal; pivots of a positive definite matrix need no exchange.
    let scale = matrix.diagonal().map(|entry| 1.0 / entry.sqrt());
    if !scale.iter().all(|entry| entry.is_finite() && *entry > 0.0) {
        return None;
    }
    let mut left =
        SMatrix::<f64, N, N>::from_fn(|row, column| matrix[(row, column)] * scale[row] * scale[column]);
    let mut right = SMatrix::<f64, N, N>::identity();
    for pivot in 0..N {
        let head = left[(pivot, pivot)];
        if head.is_nan() || head <= 1e-15 {
            return None;
        }
        for column in 0..N {
            left[(pivot, column)] /= head;
            right[(pivot, column)] /= head;
        }
        for row in 0..N {
            let factor = left[(row, pivot)];
            if row != pivot && factor != 0.0 {
                for column in 0..N {
                    left[(row, column)] -= factor * left[(pivot, column)];
                    right[(row, column)] -= factor * right[(pivot, column)];
                }
            }
        }
    }
    Some(SMatrix::from_fn(|row, column| right[(row, column)] * scale[row] * scale[column]))
}

/// Covariance of a point that was back-projected, in the world.
///
/// * `in_camera` — the point; `sigma_z` — of its depth, metres; `pose` — covariance of the tangent of `camera_from_world`.
pub(super) fn back_projected(
    camera: &PinholeCamera,
    camera_from_world: &Pose,
    in_camera: &Point3<f64>,
    sigmas: (f64, f64),
    pose: &Matrix6<f64>,
) -> Matrix3<f64> {
    let (sigma_px, sigma_z) = sigmas;
    let z = in_camera.z;
    let by_measurement = Matrix3::from_columns(&[
        Vector3::new(z / camera.fx * sigma_px, 0.0, 0.0),
        Vector3::new(0.0, z / camera.fy * sigma_px, 0.0),
        in_camera.coords / z * sigma_z,
    ]);
    let mut by_pose = nalgebra::Matrix3x6::zeros();
    by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&-in_camera.coords.cross_matrix());
    by_pose.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    let in_camera = by_measurement * by_measurement.transpose() + by_pose * pose * by_pose.transpose();
    let rotation = camera_from_world.rotation_matrix();
    rotation.transpose() * in_camera * rotation
}
