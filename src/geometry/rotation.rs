//! Rotation vectors: the exponential map of SO(3) and its inverse.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Under this angle (radians) a series replaces a quotient; its first left-out term is then below rounding.
pub(super) const SMALL_ANGLE: f64 = 0.1;

/// The rotation about `vector` by `|vector|` radians.
pub(super) fn rotation_exp(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = vector.norm();
    // sin(θ/2)/θ; the quotient is exact to rounding for any θ but zero.
    let factor = if angle < 1e-100 { 0.5 } else { libm::sin(0.5 * angle) / angle };
    UnitQuaternion::new_normalize(Quaternion::from_parts(libm::cos(0.5 * angle), vector * factor))
}

/// The rotation vector of a rotation; its length is the angle, radians in `[0, π]`.
///
/// At exactly π, where two opposite vectors name the same rotation, the one whose first component that is not zero is positive.
pub(super) fn rotation_log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (mut w, mut v) = (rotation.w, rotation.imag());
    let opposite = w < 0.0 || (w == 0.0 && v.iter().find(|c| **c != 0.0).is_some_and(|c| *c < 0.0));
    if opposite {
        (w, v) = (-w, -v);
    }
    let sine = v.norm();
    let factor = if sine < 1e-100 { 2.0 } else { 2.0 * libm::atan2(sine, w) / sine };
    v * factor
}

#[cfg(test)]
mod tests {
    use super::super::strategies::vector;
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    proptest! {
        #[test]
        fn log_undoes_exp_up_to_half_a_turn(axis in vector(1.0), angle in 0.0..PI) {
            prop_assume!(axis.norm() > 0.1);
            let vector = axis.normalize() * angle;
            // Rounding of sine and arc tangent, radians.
            prop_assert!((rotation_log(&rotation_exp(&vector)) - vector).norm() < 1e-14);
        }
    }

    #[test]
    fn log_undoes_exp_at_the_ends_of_the_range() {
        let axis = Vector3::new(0.6, -0.48, 0.64);
        for angle in [0.0, 1e-300, 1e-160, 1e-20, 1e-9, 1e-4, PI - 1e-4, PI - 1e-9, PI - 1e-15] {
            let found = rotation_log(&rotation_exp(&(axis * angle)));
            // Relative to the angle, so that tiny rotations keep their digits.
            assert!((found - axis * angle).norm() <= 1e-15 + 1e-14 * angle, "{angle}: {found}");
            assert!(found.norm() <= PI);
        }
    }

    #[test]
    fn half_a_turn_has_one_rotation_vector() {
        let about_y = UnitQuaternion::from_quaternion(Quaternion::new(0.0, 0.0, -1.0, 0.0));
        assert_eq!(rotation_log(&about_y), Vector3::new(0.0, PI, 0.0));
    }
}
