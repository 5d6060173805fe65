//! Unit vectors, without overflow or underflow on the way.

use nalgebra::Vector3;

/// How far a squared norm may be from one and still be taken for one: rounding of three or four squares.
pub(super) const UNIT_TOLERANCE: f64 = 4.0 * f64::EPSILON;

/// The unit vector along `vector`, and its length.
///
/// A vector that is a unit vector up to rounding comes back bit by bit.
/// `None` for the zero vector, a vector that is not finite, or a length that is not finite.
pub(super) fn unit(vector: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    if (vector.norm_squared() - 1.0).abs() <= UNIT_TOLERANCE {
        return Some((vector, 1.0));
    }
    let largest = vector.amax();
    if !(largest > 0.0 && vector.iter().all(|component| component.is_finite())) {
        return None;
    }
    let scaled = vector / largest;
    // The quotient of two subnormal numbers may still be off by a whole digit; it is finite and near one.
    let norm = scaled.norm();
    let length = largest * norm;
    length.is_finite().then(|| (scaled / norm, length))
}

/// A unit vector perpendicular to the unit vector `direction`.
///
/// The axis x, y or z to which `direction` has the smallest component (the first of equals), less its part along `direction`.
pub(super) fn perpendicular(direction: Vector3<f64>) -> Vector3<f64> {
    let axis = Vector3::ith_axis(direction.iamin()).into_inner();
    (axis - direction * direction.dot(&axis)).normalize()
}

/// The angle between two directions of any length, radians in `[0, π]`.
#[must_use]
pub fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b))
}

/// The angle between two endless lines of these directions, radians in `[0, π/2]`.
pub(super) fn unsigned_angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b).abs())
}

#[cfg(test)]
mod tests {
    use super::super::strategies::vector;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn unit_vector_has_length_one_whatever_the_scale(v in vector(1.0), exponent in -300..300_i32) {
            prop_assume!(v.amax() > 0.1);
            let scale = 10_f64.powi(exponent);
            let (direction, length) = unit(v * scale).unwrap();
            // Rounding of a handful of operations.
            prop_assert!((direction.norm() - 1.0).abs() < 1e-15);
            prop_assert!((length / scale - v.norm()).abs() < 1e-14);
            prop_assert_eq!(unit(direction).unwrap().0, direction);
        }

        #[test]
        fn perpendicular_is_a_unit_vector_at_a_right_angle(v in vector(1.0)) {
            prop_assume!(v.norm() > 0.1);
            let direction = v.normalize();
            let other = perpendicular(direction);
            prop_assert!((other.norm() - 1.0).abs() < 1e-15);
            prop_assert!(other.dot(&direction).abs() < 1e-15);
        }
    }

    #[test]
    fn nothing_comes_from_zero_or_from_what_is_not_finite() {
        assert_eq!(unit(Vector3::zeros()), None);
        assert_eq!(unit(Vector3::new(1.0, f64::NAN, 0.0)), None);
        assert_eq!(unit(Vector3::new(1.0, f64::INFINITY, 0.0)), None);
        assert_eq!(unit(Vector3::repeat(f64::MAX)), None);
    }
}
