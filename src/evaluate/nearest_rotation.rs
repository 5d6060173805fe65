//! The rotation nearest to a covariance of positions.

use nalgebra::{Matrix3, Vector3};

/// Sweeps over the three pairs of columns; one-sided Jacobi needs four or five for 3 × 3.
const SWEEPS: usize = 30;

/// What a covariance `A = 1/n Σ y xᵀ` says about the rotation from x to y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NearestRotation {
    /// The proper rotation R with the largest `trace(Rᵀ A)`.
    pub(super) rotation: Matrix3<f64>,
    /// That trace: `σ₁ + σ₂ ± σ₃`.
    pub(super) trace: f64,
    /// `σ₂ / σ₁`; 0 where A has rank one or less, in which case the rotation means nothing.
    pub(super) ratio: f64,
}

/// The proper rotation nearest to a matrix of rank two or three.
///
/// Of the singular value decomposition `A = U Σ Vᵀ` two pairs of vectors are enough: with `u₃ = u₁ × u₂` and `v₃ = v₁ × v₂`
/// both bases are right-handed, `R = U Vᵀ` is a rotation, and `u₃ᵀ A v₃` is σ₃ with the sign that a reflection would give
/// it. One-sided Jacobi rotations keep the digits of σ₂ when it is much smaller than σ₁, which `AᵀA` would lose.
///
/// # Source
/// Umeyama 1991, equations 39 to 43; Hestenes 1958 for the decomposition.
pub(super) fn nearest_rotation(matrix: &Matrix3<f64>) -> NearestRotation {
    let none = NearestRotation { rotation: Matrix3::identity(), trace: 0.0, ratio: 0.0 };
    let largest = matrix.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return none;
    }
    // Columns of `work` become U Σ, while `right` becomes V.
    let (mut work, mut right) = (matrix / largest, Matrix3::identity());
    for _ in 0..SWEEPS {
        let mut turned = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            turned |= orthogonalise(&mut work, &mut right, p, q);
        }
        if !turned {
            break;
        }
    }
    let mut order = [0, 1, 2];
    let norms: [f64; 3] = std::array::from_fn(|column| work.column(column).norm());
    order.sort_by(|a, b| norms[*b].total_cmp(&norms[*a]));
    let [first, second, _] = order;
    if norms[second] <= 0.0 {
        return none;
    }
    let basis =
        |one: Vector3<f64>, other: Vector3<f64>| Matrix3::from_columns(&[one, other, one.cross(&other)]);
    let u = basis(work.column(first) / norms[first], work.column(second) / norms[second]);
    let v = basis(right.column(first).into(), right.column(second).into());
    let third = u.column(2).dot(&(matrix * v.column(2)));
    NearestRotation {
        rotation: u * v.transpose(),
        trace: largest * (norms[first] + norms[second]) + third,
        ratio: norms[second] / norms[first],
    }
}

/// Turns columns p and q so that they are perpendicular; whether that was needed.
fn orthogonalise(work: &mut Matrix3<f64>, right: &mut Matrix3<f64>, p: usize, q: usize) -> bool {
    let (a, b) = (work.column(p).norm_squared(), work.column(q).norm_squared());
    let c = work.column(p).dot(&work.column(q));
    if c.abs() <= f64::EPSILON * (a * b).sqrt() {
        return false;
    }
    let zeta = (b - a) / (2.0 * c);
    let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = cosine * tangent;
    for matrix in [work, right] {
        for row in 0..3 {
            let (x, y) = (matrix[(row, p)], matrix[(row, q)]);
            matrix[(row, p)] = cosine * x - sine * y;
            matrix[(row, q)] = sine * x + cosine * y;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{pose, vector};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_rotation_times_a_covariance_gives_the_rotation_back(
            pose in pose(),
            frame in pose(),
            sizes in (1.0..2.0_f64, -9.0..0.0_f64, -9.0..0.0_f64),
        ) {
            let rotation = pose.rotation_matrix();
            let axes = frame.rotation_matrix();
            let sizes = Vector3::new(sizes.0, 10_f64.powf(sizes.1), 10_f64.powf(sizes.1 + sizes.2));
            let spread = axes * Matrix3::from_diagonal(&sizes) * axes.transpose();
            let found = nearest_rotation(&(rotation * spread));
            // Rounding of the product over the second singular value.
            let tolerance = 1e-14 / sizes.y;
            prop_assert!((found.rotation - rotation).norm() < tolerance, "{}", (found.rotation - rotation).norm());
            prop_assert!((found.trace - sizes.sum()).abs() < 1e-14);
            prop_assert!((found.rotation.transpose() * found.rotation - Matrix3::identity()).norm() < 1e-14);
            prop_assert!((found.rotation.determinant() - 1.0).abs() < 1e-14);
        }

        #[test]
        fn no_rotation_has_a_larger_trace(rows in (vector(1.0), vector(1.0), vector(1.0)), other in pose()) {
            let matrix = Matrix3::from_columns(&[rows.0, rows.1, rows.2]);
            let found = nearest_rotation(&matrix);
            prop_assert!(((found.rotation.transpose() * matrix).trace() - found.trace).abs() < 1e-14);
            prop_assert!((other.rotation_matrix().transpose() * matrix).trace() <= found.trace + 1e-14);
        }
    }

    #[test]
    fn nothing_follows_from_a_line_or_a_point() {
        let line = Vector3::new(1.0, 2.0, -1.0) * Vector3::new(0.3, 0.0, 1.0).transpose();
        assert!(nearest_rotation(&line).ratio < 1e-15);
        for matrix in [Matrix3::zeros(), Matrix3::repeat(f64::NAN), Matrix3::repeat(f64::INFINITY)] {
            assert_eq!(nearest_rotation(&matrix).ratio, 0.0);
        }
    }
}
