//! Information of a relative pose, between g2o's error and the tangent of our registry.
//!
//! Ours is `ξ = [rotation; translation]` of `Exp(ξ) · Z = T`, with the measured `Z` and the predicted
//! `T = frame_from_other`. That of a g2o file is `e = [t; 2 q]`, the translation and twice the vector part of the
//! quaternion of `Z⁻¹ T = Z⁻¹ Exp(ξ) Z = Exp(Ad(Z⁻¹) ξ)`: the program g2o leaves out the 2, but those who publish such
//! files, and Ceres, GTSAM and SE-Sync, mean information per radian. Where the error is small, it is that tangent with
//! the translation first, so
//!
//! ```text
//! e = P Ad(Z⁻¹) ξ,   P = ⎡0  I⎤,   Ad(Z⁻¹) = ⎡ R      0⎤  with Z⁻¹ = (R, t)
//!                        ⎣I  0⎦              ⎣[t]ₓ R  R⎦
//! Ω_ξ = (P Ad)ᵀ Ω_e (P Ad),   Ω_e = (P Ad)⁻ᵀ Ω_ξ (P Ad)⁻¹
//! ```
//!
//! In the plane, the error is `[x y θ]` of `Z⁻¹ T`: three rows of the same.

use nalgebra::{Matrix3, Matrix6, SMatrix};

use crate::geometry::Pose;

/// `Ad(Z)`: takes a tangent `[rotation; translation]` on the right of `Z` to the left: `Z Exp(ξ) = Exp(Ad(Z) ξ) Z`.
fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = pose.rotation_matrix();
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&(pose.translation().cross_matrix() * rotation));
    adjoint
}

/// `P`, between `[rotation; translation]` and `[t; 2 vec q]`: either way, it is its own inverse.
fn swap() -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&Matrix3::identity());
    matrix
}

/// A symmetric matrix from its upper triangle, row by row.
pub(super) fn symmetric<const N: usize>(upper: &[f64]) -> SMatrix<f64, N, N> {
    let mut matrix = SMatrix::zeros();
    let mut numbers = upper.iter();
    for row in 0..N {
        for column in row..N {
            let number = numbers.next().copied().unwrap_or(0.0);
            matrix[(row, column)] = number;
            matrix[(column, row)] = number;
        }
    }
    matrix
}

/// The upper triangle of a matrix, row by row.
pub(super) fn upper<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Vec<f64> {
    (0..N).flat_map(|row| (row..N).map(move |column| (row, column))).map(|place| matrix[place]).collect()
}

/// Information over our tangent, 21 numbers, from a g2o file's over `[t; 2 vec q]`.
pub(super) fn from_space(measured: &Pose, information: &[f64]) -> Vec<f64> {
    let jacobian = swap() * adjoint(&measured.inverse());
    upper(&(jacobian.transpose() * symmetric::<6>(information) * jacobian))
}

/// The inverse of [`from_space`].
pub(super) fn to_space(measured: &Pose, information: &[f64]) -> Vec<f64> {
    let inverse = adjoint(measured) * swap();
    upper(&(inverse.transpose() * symmetric::<6>(information) * inverse))
}

/// Where x, y and θ of the plane stand in `[x y z roll pitch yaw]`.
const PLANE: [usize; 3] = [0, 1, 5];

/// Information over our tangent, 21 numbers, from that over `[x y θ]`; z, roll and pitch have none.
pub(super) fn from_plane(measured: &Pose, information: &[f64]) -> Vec<f64> {
    let jacobian = swap() * adjoint(&measured.inverse());
    let plane = symmetric::<3>(information);
    let mut lifted = Matrix6::zeros();
    for (row, place) in PLANE.into_iter().enumerate() {
        for (column, other) in PLANE.into_iter().enumerate() {
            lifted[(place, other)] = plane[(row, column)];
        }
    }
    upper(&(jacobian.transpose() * lifted * jacobian))
}

/// The inverse of [`from_plane`], of a pose that keeps the plane.
pub(super) fn to_plane(measured: &Pose, information: &[f64]) -> Vec<f64> {
    let inverse = adjoint(measured) * swap();
    let all = inverse.transpose() * symmetric::<6>(information) * inverse;
    upper(&Matrix3::from_fn(|row, column| all[(PLANE[row], PLANE[column])]))
}
