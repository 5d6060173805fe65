//! The rigid transform between two sets of points that are known to correspond.

use super::Pose;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// The transform with the least squared distances: `min Σ |b − T a|²`.
///
/// * `pairs` — `(a, b)`, metres.
///
/// `None` without pairs, or when numbers are not finite.
///
/// # Source
/// Kabsch 1976 with Umeyama's sign; points in a plane determine it, points on a line do not (one of the solutions comes out).
pub(super) fn absolute_orientation(
    pairs: impl ExactSizeIterator<Item = (Point3<f64>, Point3<f64>)> + Clone,
) -> Option<Pose> {
    let count = pairs.len();
    if count == 0 {
        return None;
    }
    let scale = 1.0 / count as f64;
    let (mut from, mut to) = (Vector3::zeros(), Vector3::zeros());
    for (a, b) in pairs.clone() {
        from += a.coords * scale;
        to += b.coords * scale;
    }
    let mut spread = Matrix3::<f64>::zeros();
    for (a, b) in pairs {
        spread += (b.coords - to) * (a.coords - from).transpose();
    }
    rotation_near(&spread).map(|rotation| Pose::new(rotation, to - rotation * from))
}

/// The rotation nearest to a matrix: `max tr(Rᵀ M)`.
pub(super) fn rotation_near(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let svd = matrix.try_svd(true, true, f64::EPSILON, 500)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = if (u.determinant() * v_t.determinant()) < 0.0 { -1.0 } else { 1.0 };
    // The sign goes to the least singular value, which nalgebra does not promise to stand last.
    let mut diagonal = Vector3::repeat(1.0);
    diagonal[svd.singular_values.imin()] = sign;
    let rotation = u * Matrix3::from_diagonal(&diagonal) * v_t;
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)))
}
