//! An endless line by four numbers, for optimisation.

use super::direction::{perpendicular, unit};
use super::rotation::{rotation_exp, rotation_log};
use super::{Error, PluckerLine};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3, Vector4};
use std::f64::consts::{FRAC_PI_2, PI};

/// A line nearer to the origin than this (metres) is taken to pass through it: its moment is rounding and names no axis.
const THROUGH_ORIGIN_M: f64 = 1e-15;

/// The least `varphi` an update leads to, radians: a line 1e12 m from the origin.
const LEAST_VARPHI: f64 = 1e-12;

/// A line in the orthonormal form: `U ∈ SO(3)` as a rotation vector and `W ∈ SO(2)` as an angle.
///
/// For the Plücker line `[n; d]`, `U = [ n/|n|, d/|d|, (n × d)/|n × d| ]` and `W = [[cos φ, −sin φ], [sin φ, cos φ]]` with
/// `(cos φ, sin φ) = (|n|, |d|)/√(|n|² + |d|²)`.
///
/// A line through the origin has no `n/|n|`. Its first axis is then the one of x, y, z to which `d` has the smallest component (the first
/// of equals), less its part along `d`, scaled to length one; so each line has one form.
///
/// # Source
/// Bartoli and Sturm 2005, *Structure-from-motion using lines*; Open-Structure (Li et al. 2024), `𝒪 = [ϕ; φ]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrthonormalLine {
    /// `ϕ`, the rotation vector of `U`, radians, its length in `[0, π]`.
    pub phi: Vector3<f64>,
    /// `φ = atan2(|d|, |n|)`, radians in `(0, π/2]`; π/2 for a line through the origin, smaller the farther away.
    pub varphi: f64,
}

impl OrthonormalLine {
    /// A line whose four numbers were looked at.
    ///
    /// * `phi` — rotation vector, radians; `varphi` — radians.
    ///
    /// # Errors
    /// [`Error::NotFinite`]; [`Error::OutOfRange`] when `|phi| > π` or `varphi` is not in `(0, π/2]`.
    pub fn new(phi: Vector3<f64>, varphi: f64) -> Result<Self, Error> {
        Error::check_finite("orthonormal phi", phi.iter())?;
        Error::check_finite("orthonormal varphi", [&varphi])?;
        let angle = phi.norm();
        // The norm of a vector of length π may round to the next number.
        if angle > PI * (1.0 + 4.0 * f64::EPSILON) {
            return Err(Error::OutOfRange {
                what: "orthonormal |phi|",
                expected: "0 to π rad",
                found: angle,
            });
        }
        if varphi <= 0.0 || varphi > FRAC_PI_2 {
            let expected = "more than 0 and at most π/2 rad";
            return Err(Error::OutOfRange { what: "orthonormal varphi", expected, found: varphi });
        }
        Ok(Self { phi, varphi })
    }

    /// The form of a Plücker line.
    pub(super) fn from_plucker(line: &PluckerLine) -> Self {
        let direction = line.direction;
        let across = line.moment - direction * direction.dot(&line.moment);
        let (moment_axis, distance) = match unit(across) {
            Some((axis, distance)) if distance > THROUGH_ORIGIN_M => {
                // Once more, for what cancelled above left the axis only as perpendicular as its few digits.
                ((axis - direction * direction.dot(&axis)).normalize(), distance)
            }
            _ => (perpendicular(direction), 0.0),
        };
        let frame = Matrix3::from_columns(&[moment_axis, direction, moment_axis.cross(&direction)]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(frame));
        let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        Self { phi: rotation_log(&rotation), varphi: libm::atan2(1.0, distance) }
    }

    /// `U`, whose columns are the unit vectors of moment, direction, and moment × direction.
    pub(super) fn frame(&self) -> Matrix3<f64> {
        rotation_exp(&self.phi).to_rotation_matrix().into_inner()
    }

    /// The same line by moment and direction: `d = u₂`, `n = cot φ · u₁`.
    #[must_use]
    pub fn plucker(&self) -> PluckerLine {
        let frame = self.frame();
        // The number nearest to π/2 stands for π/2.
        let distance =
            if self.varphi >= FRAC_PI_2 { 0.0 } else { libm::cos(self.varphi) / libm::sin(self.varphi) };
        PluckerLine { moment: frame.column(0) * distance, direction: frame.column(1).into_owned() }
    }

    /// The line after a step in its four degrees of freedom: `U ← U · Exp(δ₁, δ₂, δ₃)`, `φ ← φ + δ₄`.
    ///
    /// Multiplied on the right, as Bartoli and Sturm do, but with one rotation vector where they take three turns about x, y and z in
    /// sequence; the two agree to first order. The result is again in the form's range (`φ ∈ (0, π/2]`), keeps the sense of its direction,
    /// and stays under 1e12 m from the origin.
    ///
    /// * `delta` — radians.
    #[must_use]
    pub fn update(&self, delta: &Vector4<f64>) -> Self {
        let mut rotation = rotation_exp(&self.phi) * rotation_exp(&delta.xyz());
        // (n, d) and (−n, −d) are one line, so φ and φ + π are.
        let mut varphi = (self.varphi + delta.w).rem_euclid(PI);
        if varphi > FRAC_PI_2 {
            // The line went through the origin to its other side: the first axis turns round, and the third with it.
            varphi = PI - varphi;
            rotation *= UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(0.0, 0.0, 1.0, 0.0));
        }
        Self { phi: rotation_log(&rotation), varphi: varphi.max(LEAST_VARPHI) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{line, vector};
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    /// Largest difference of two lines, relative to one metre or to the distance from the origin where that is more.
    fn difference(a: &PluckerLine, b: &PluckerLine) -> f64 {
        let scale = a.moment.norm().max(1.0);
        ((a.moment - b.moment).norm() / scale).max((a.direction - b.direction).norm())
    }

    proptest! {
        #[test]
        fn a_line_through_the_three_forms_and_back(line in line(), exponent in -20..7_i32) {
            let line = PluckerLine { moment: line.moment * 10_f64.powi(exponent), ..line };
            let form = line.orthonormal();
            prop_assert!(difference(&line, &form.plucker()) < 1e-14);
            prop_assert!(form.phi.norm() <= PI && form.varphi > 0.0 && form.varphi <= FRAC_PI_2);
            prop_assert_eq!(OrthonormalLine::new(form.phi, form.varphi).unwrap(), form);
            let again = form.plucker().orthonormal();
            prop_assert!(difference(&again.plucker(), &line) < 1e-14);
        }

        #[test]
        fn a_line_through_the_origin_has_one_form(v in vector(1.0)) {
            prop_assume!(v.norm() > 0.1);
            let line = PluckerLine::through(Point3::origin(), Point3::from(v)).unwrap();
            let noisy = PluckerLine { moment: perpendicular(line.direction) * -1e-17, ..line };
            let form = line.orthonormal();
            prop_assert!(form.varphi >= FRAC_PI_2);
            prop_assert_eq!(form.plucker().moment, Vector3::zeros());
            prop_assert!((form.plucker().direction - line.direction).norm() < 1e-14);
            prop_assert_eq!(noisy.orthonormal(), form);
        }

        #[test]
        fn steps_have_the_documented_differentials(line in line()) {
            let form = line.orthonormal();
            let frame = form.frame();
            let [u1, u2, u3] = [0, 1, 2].map(|column| frame.column(column).into_owned());
            let distance = line.moment.norm();
            let (cos, sin) = (form.varphi.cos(), form.varphi.sin());
            // n = cot φ · u₁, d = u₂, and d(U Exp δ) = U [δ]ₓ.
            let expected = [
                (Vector3::zeros(), u3),
                (-u3 * distance, Vector3::zeros()),
                (u2 * distance, -u1),
                (u1 * -(1.0 + (cos / sin).powi(2)), Vector3::zeros()),
            ];
            let step = 1e-6;
            for (row, (moment, direction)) in expected.into_iter().enumerate() {
                let delta = Vector4::ith(row, step);
                let (after, before) = (form.update(&delta).plucker(), form.update(&-delta).plucker());
                // Central differences: 1e-12 from the third derivative, 1e-9 from rounding, over the step.
                let scale = 1.0 + distance.powi(3);
                prop_assert!(((after.moment - before.moment) / (2.0 * step) - moment).norm() < 1e-8 * scale);
                prop_assert!(((after.direction - before.direction) / (2.0 * step) - direction).norm() < 1e-8);
            }
        }

        #[test]
        fn no_step_leaves_the_range(line in line(), turn in vector(3.0), step in -9.0..9.0) {
            let form = line.orthonormal().update(&Vector4::new(turn.x, turn.y, turn.z, step));
            prop_assert!(OrthonormalLine::new(form.phi, form.varphi).is_ok());
        }
    }

    #[test]
    fn no_step_is_no_step() {
        let line = PluckerLine::through(Point3::new(1.0, 2.0, 3.0), Point3::new(2.0, 2.0, -1.0)).unwrap();
        let form = line.orthonormal();
        let after = form.update(&Vector4::zeros());
        assert!((after.phi - form.phi).norm() < 1e-15 && (after.varphi - form.varphi).abs() < 1e-15);
    }

    #[test]
    fn a_line_walks_through_the_origin_without_turning() {
        let line = PluckerLine::through(Point3::new(0.01, 0.0, 0.0), Point3::new(0.01, 0.0, 1.0)).unwrap();
        let beyond = line.orthonormal().update(&Vector4::new(0.0, 0.0, 0.0, 0.02)).plucker();
        assert!((beyond.direction - Vector3::z()).norm() < 1e-15);
        // cot(atan2(1, 0.01) + 0.02), metres.
        let expected = -((0.02 - 0.01_f64.atan()).tan());
        assert!((beyond.closest_point_to_origin() - Point3::new(expected, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn a_step_to_infinity_stays_finite() {
        let line = PluckerLine::through(Point3::new(1.0, 2.0, 3.0), Point3::new(2.0, 2.0, -1.0)).unwrap();
        let form = line.orthonormal();
        let far = form.update(&Vector4::new(0.0, 0.0, 0.0, -form.varphi)).plucker();
        assert!((far.moment.norm() - 1e12).abs() < 1.0);
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let turn = Vector3::new(0.1, 0.2, 0.3);
        for varphi in [0.0, -0.1, 1.6] {
            let found = OrthonormalLine::new(turn, varphi);
            assert!(matches!(found, Err(Error::OutOfRange { what: "orthonormal varphi", .. })), "{varphi}");
        }
        assert!(matches!(OrthonormalLine::new(turn * 10.0, 1.0), Err(Error::OutOfRange { .. })));
        assert!(matches!(OrthonormalLine::new(turn, f64::NAN), Err(Error::NotFinite { .. })));
    }
}
