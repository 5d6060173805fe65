//! Rigid transforms between two spaces.

use super::Error;
use super::direction::UNIT_TOLERANCE;
use super::rotation::{SMALL_ANGLE, rotation_exp, rotation_log};
use nalgebra::{Matrix3, Matrix6, Point3, Quaternion, UnitQuaternion, Vector3, Vector4, Vector6};
use std::ops::Mul;

/// A quaternion shorter than this names no rotation: its direction would be noise.
const SHORTEST_QUATERNION: f64 = 1e-9;

/// A rigid transform from one space to another: `x ↦ R x + t`, metres.
///
/// The variable says both ends, `to_from`: `point_in_camera = camera_from_world * point_in_world`.
///
/// A tangent is `[rotation; translation]` (radians, metres) and is applied on the left:
/// `moved = Pose::exp(&tangent) * pose`, and `(moved * pose.inverse()).log()` gives it back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    rotation: UnitQuaternion<f64>,
    translation: Vector3<f64>,
}

impl Pose {
    /// The transform that moves nothing.
    #[must_use]
    pub fn identity() -> Self {
        Self { rotation: UnitQuaternion::identity(), translation: Vector3::zeros() }
    }

    /// The transform `x ↦ R x + t`.
    ///
    /// * `translation` — where the origin goes, metres.
    #[must_use]
    pub fn new(rotation: UnitQuaternion<f64>, translation: Vector3<f64>) -> Self {
        Self { rotation, translation }
    }

    /// The transform written as seven numbers; a quaternion not of norm 1 is scaled to it.
    ///
    /// * `translation` — x, y, z, metres.
    /// * `rotation_xyzw` — Hamilton quaternion, the real part last.
    ///
    /// A quaternion of norm 1 up to rounding is taken as it is, so that [`Pose::components`] gives back the same bits.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a number that is NaN or infinite, [`Error::NoRotation`] for a quaternion of (nearly) norm zero.
    pub fn from_components(translation: [f64; 3], rotation_xyzw: [f64; 4]) -> Result<Self, Error> {
        Error::check_finite("translation", &translation)?;
        Error::check_finite("rotation", &rotation_xyzw)?;
        let vector = Vector4::from(rotation_xyzw);
        let norm_squared = vector.norm_squared();
        let unit = if (norm_squared - 1.0).abs() <= UNIT_TOLERANCE {
            vector
        } else {
            // Scaled first, for squares of large numbers overflow.
            let largest = vector.amax();
            if largest < SHORTEST_QUATERNION {
                return Err(Error::NoRotation { norm: norm_squared.sqrt() });
            }
            (vector / largest).normalize()
        };
        let rotation = UnitQuaternion::new_unchecked(Quaternion::from_vector(unit));
        Ok(Self { rotation, translation: translation.into() })
    }

    /// Translation (x, y, z, metres) and rotation (x, y, z, w).
    #[must_use]
    pub fn components(&self) -> ([f64; 3], [f64; 4]) {
        (self.translation.into(), self.rotation.coords.into())
    }

    /// The rotation `R`.
    #[must_use]
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.rotation
    }

    /// The translation `t`, metres: where the origin of the space on the right lies in the space on the left.
    #[must_use]
    pub fn translation(&self) -> Vector3<f64> {
        self.translation
    }

    /// The rotation as a matrix, for many products with one pose.
    #[must_use]
    pub fn rotation_matrix(&self) -> Matrix3<f64> {
        self.rotation.to_rotation_matrix().into_inner()
    }

    /// The transform back: `x ↦ Rᵀ (x − t)`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// Turns a vector, which unlike a point has no place: `R v`.
    #[must_use]
    pub fn transform_vector(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * vector
    }

    /// The transform a tangent leads to: the exponential map of SE(3).
    ///
    /// `R = Exp(ω)`, `t = V(ω) v`, `V = I + (1 − cos θ)/θ² [ω]ₓ + (θ − sin θ)/θ³ [ω]ₓ²`, `θ = |ω|`
    ///
    /// * `tangent` — `[ω; v]`, radians and metres, of any size.
    #[must_use]
    pub fn exp(tangent: &Vector6<f64>) -> Self {
        let turn = tangent.fixed_rows::<3>(0).into_owned();
        let shift = tangent.fixed_rows::<3>(3).into_owned();
        let angle = turn.norm();
        let squared = angle * angle;
        // (1 − cos θ)/θ² without the difference.
        let half = 0.5 * angle;
        let sinc = if half < 1e-100 { 1.0 } else { libm::sin(half) / half };
        let first = 0.5 * sinc * sinc;
        let second = if angle < SMALL_ANGLE {
            (1.0 - squared / 20.0 * (1.0 - squared / 42.0 * (1.0 - squared / 72.0 * (1.0 - squared / 110.0))))
                / 6.0
        } else {
            (angle - libm::sin(angle)) / (squared * angle)
        };
        let across = turn.cross(&shift);
        let translation = shift + across * first + turn.cross(&across) * second;
        Self { rotation: rotation_exp(&turn), translation }
    }

    /// The tangent that leads here from the identity, its rotation at most half a turn: the inverse of [`Pose::exp`].
    ///
    /// `v = V(ω)⁻¹ t`, `V⁻¹ = I − ½ [ω]ₓ + (1 − θ/2 · cot(θ/2))/θ² [ω]ₓ²`
    #[must_use]
    pub fn log(&self) -> Vector6<f64> {
        let turn = rotation_log(&self.rotation);
        let angle = turn.norm();
        let squared = angle * angle;
        let second = if angle < SMALL_ANGLE {
            (1.0 + squared / 60.0
                * (1.0 + squared / 42.0 * (1.0 + squared / 40.0 * (1.0 + squared * 5.0 / 198.0))))
                / 12.0
        } else {
            let half = 0.5 * angle;
            (1.0 - half * libm::cos(half) / libm::sin(half)) / squared
        };
        let across = turn.cross(&self.translation);
        let shift = self.translation - across * 0.5 + turn.cross(&across) * second;
        Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
    }

    /// The adjoint: takes a tangent of the space on the right to the one on the left, `self · Exp(ξ) = Exp(Ad ξ) · self`.
    ///
    /// ```text
    ///       ⎡   R     0 ⎤
    /// Ad =  ⎢           ⎥    over [rotation; translation]
    ///       ⎣ [t]ₓR   R ⎦
    /// ```
    #[must_use]
    pub fn adjoint(&self) -> Matrix6<f64> {
        let rotation = self.rotation_matrix();
        let mut adjoint = Matrix6::zeros();
        adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
        adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&(self.translation.cross_matrix() * rotation));
        adjoint
    }

    /// How far the transform turns, radians in `[0, π]`.
    #[must_use]
    pub fn rotation_angle(&self) -> f64 {
        2.0 * libm::atan2(self.rotation.imag().norm(), self.rotation.w.abs())
    }

    /// A pose between two: the rotation goes the short way at constant speed, the translation on a straight line.
    ///
    /// * `t` — 0 gives `self`, 1 gives `other`; values outside extrapolate.
    #[must_use]
    pub fn interpolate(&self, other: &Pose, t: f64) -> Self {
        let turn = rotation_log(&(self.rotation.inverse() * other.rotation));
        Self {
            rotation: self.rotation * rotation_exp(&(turn * t)),
            translation: self.translation.lerp(&other.translation, t),
        }
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl Mul<Pose> for Pose {
    type Output = Pose;

    fn mul(self, right: Pose) -> Pose {
        Pose {
            rotation: self.rotation * right.rotation,
            translation: self.rotation * right.translation + self.translation,
        }
    }
}

impl Mul<&Pose> for &Pose {
    type Output = Pose;

    fn mul(self, right: &Pose) -> Pose {
        *self * *right
    }
}

impl Mul<Point3<f64>> for Pose {
    type Output = Point3<f64>;

    fn mul(self, point: Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * point.coords + self.translation)
    }
}

impl Mul<Point3<f64>> for &Pose {
    type Output = Point3<f64>;

    fn mul(self, point: Point3<f64>) -> Point3<f64> {
        *self * point
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{point, pose, tangent, vector};
    use super::*;
    use nalgebra::Matrix4;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    /// Rounding of a few products of numbers up to about ten.
    const ROUNDING_M: f64 = 1e-13;

    fn distance(a: &Pose, b: &Pose) -> f64 {
        (a.inverse() * *b).rotation_angle() + (a.translation - b.translation).norm()
    }

    fn matrix(pose: &Pose) -> Matrix4<f64> {
        let mut matrix = pose.rotation_matrix().to_homogeneous();
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&pose.translation);
        matrix
    }

    proptest! {
        #[test]
        fn a_pose_times_its_inverse_is_the_identity(a in pose()) {
            prop_assert!(distance(&(a * a.inverse()), &Pose::identity()) < ROUNDING_M);
            prop_assert!(distance(&(a.inverse() * a), &Pose::identity()) < ROUNDING_M);
        }

        #[test]
        fn products_associate_with_points(a in pose(), b in pose(), p in point()) {
            prop_assert!(((a * b) * p - a * (b * p)).norm() < ROUNDING_M);
            let (left, right) = (&a, &b);
            prop_assert_eq!(left * right, a * b);
            prop_assert_eq!(left * p, a * p);
        }

        #[test]
        fn a_vector_turns_as_the_difference_of_two_points(a in pose(), p in point(), v in vector(5.0)) {
            prop_assert!((a.transform_vector(&v) - (a * (p + v) - a * p)).norm() < ROUNDING_M);
        }

        #[test]
        fn components_give_back_the_same_bits(a in pose()) {
            let (translation, rotation_xyzw) = a.components();
            prop_assert_eq!(Pose::from_components(translation, rotation_xyzw).unwrap(), a);
        }

        #[test]
        fn the_scale_of_the_quaternion_does_not_matter(a in pose(), exponent in -8..300_i32) {
            let (translation, rotation_xyzw) = a.components();
            let scaled = rotation_xyzw.map(|c| c * 10_f64.powi(exponent));
            prop_assert!(distance(&Pose::from_components(translation, scaled).unwrap(), &a) < ROUNDING_M);
        }

        #[test]
        fn exp_undoes_log(a in pose()) {
            prop_assert!(distance(&Pose::exp(&a.log()), &a) < ROUNDING_M);
        }

        #[test]
        fn log_undoes_exp(t in tangent()) {
            // Near half a turn V⁻¹ is at most π/2 times longer.
            prop_assert!((Pose::exp(&t).log() - t).norm() < ROUNDING_M);
        }

        #[test]
        fn exp_is_the_exponential_of_the_matrix(t in tangent()) {
            let mut generator = t.fixed_rows::<3>(0).into_owned().cross_matrix().to_homogeneous();
            generator.fixed_view_mut::<3, 1>(0, 3).copy_from(&t.fixed_rows::<3>(3));
            generator[(3, 3)] = 0.0;
            prop_assert!((matrix(&Pose::exp(&t)) - generator.exp()).norm() < ROUNDING_M);
        }

        #[test]
        fn interpolation_goes_from_one_to_the_other_at_constant_speed(a in pose(), b in pose(), t in 0.0..1.0) {
            prop_assert!(distance(&a.interpolate(&b, 0.0), &a) < ROUNDING_M);
            prop_assert!(distance(&a.interpolate(&b, 1.0), &b) < ROUNDING_M);
            let (whole, part) = (a.inverse() * b, a.inverse() * a.interpolate(&b, t));
            prop_assert!((part.rotation_angle() - t * whole.rotation_angle()).abs() < ROUNDING_M);
            prop_assert!((part.translation - whole.translation * t).norm() < ROUNDING_M);
        }

        #[test]
        fn the_adjoint_takes_a_tangent_to_the_other_side(a in pose(), t in tangent()) {
            prop_assert!(distance(&(a * Pose::exp(&t)), &(Pose::exp(&(a.adjoint() * t)) * a)) < 10.0 * ROUNDING_M);
        }

        #[test]
        fn the_angle_is_the_length_of_the_rotation_vector(a in pose()) {
            prop_assert!((a.rotation_angle() - a.log().fixed_rows::<3>(0).norm()).abs() < ROUNDING_M);
        }
    }

    #[test]
    fn exp_and_log_keep_their_digits_from_nothing_to_half_a_turn() {
        let (axis, shift) = (Vector3::new(0.6, -0.48, 0.64), Vector3::new(3.0, -1.0, 2.0));
        let angles = [0.0, 1e-300, 1e-20, 1e-9, 1e-5, 1e-2, 0.0999, 0.1001, 1.0, PI - 1e-6, PI - 1e-12];
        for angle in angles {
            let turn = axis * angle;
            let tangent = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            let error = Pose::exp(&tangent).log() - tangent;
            assert!(error.norm() < 1e-14, "angle {angle}: {error}");
        }
    }

    #[test]
    fn numbers_that_are_no_pose_are_refused() {
        let found = Pose::from_components([0.0, f64::NAN, 0.0], [0.0, 0.0, 0.0, 1.0]);
        assert!(matches!(found, Err(Error::NotFinite { what: "translation", .. })));
        let found = Pose::from_components([0.0; 3], [f64::INFINITY, 0.0, 0.0, 1.0]);
        assert!(matches!(found, Err(Error::NotFinite { what: "rotation", .. })));
        for length in [0.0, 1e-300, 1e-10] {
            let found = Pose::from_components([0.0; 3], [length, 0.0, 0.0, 0.0]);
            assert!(matches!(found, Err(Error::NoRotation { .. })), "{length}");
        }
    }

    #[test]
    fn the_real_part_stands_last() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let quarter_turn_about_z = Pose::from_components([1.0, 0.0, 0.0], [0.0, 0.0, half, half]).unwrap();
        let moved = quarter_turn_about_z * Point3::new(1.0, 0.0, 0.0);
        assert!((moved - Point3::new(1.0, 1.0, 0.0)).norm() < 1e-15);
    }
}
