//! An endless line by moment and direction.

use super::direction::{UNIT_TOLERANCE, unit, unsigned_angle};
use super::{Error, OrthonormalLine, PinholeCamera, Pose};
use nalgebra::{Point3, Vector3};

/// How far `n · d` may be from zero, relative to `max(|n|, 1 m)`, for a unit `d`.
const ORTHOGONALITY_TOLERANCE: f64 = 1e-9;

/// Lines at a smaller angle than this (radians) are measured as parallel ones.
const PARALLEL_ANGLE: f64 = 1e-9;

/// An endless, directed line: `moment = p × direction` for every point `p` on it.
///
/// For a line through two points, `direction = (end − start)/|end − start|` and `moment = start × direction`, so that `|moment|` is the
/// distance of the line from the origin, metres. The paper writes `[n; d]` for the same pair and leaves its scale free; here the
/// direction has length one.
///
/// [`PluckerLine::new`] and [`PluckerLine::through`] make valid lines; one put together from its fields is not checked, and what it
/// gives is meaningful only as far as its direction has length one and its [`PluckerLine::constraint`] is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PluckerLine {
    /// `n`, the normal of the plane through origin and line, as long as their distance, metres.
    pub moment: Vector3<f64>,
    /// `d`, a unit vector.
    pub direction: Vector3<f64>,
}

impl PluckerLine {
    /// The line of a moment and a direction of any common scale.
    ///
    /// Both are divided by `|direction|`; what the moment has along the direction, which can only be rounding, is taken off.
    ///
    /// * `moment`, `direction` — `[n; d]`; `|n|/|d|` is in metres.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::NoDirection`] for a direction of length zero, and [`Error::NotOrthogonal`] when
    /// `|n · d| > 1e-9 max(|n|, 1 m)` (for a unit `d`).
    pub fn new(moment: Vector3<f64>, direction: Vector3<f64>) -> Result<Self, Error> {
        Error::check_finite("plücker moment", moment.iter())?;
        Error::check_finite("plücker direction", direction.iter())?;
        let (direction, length) = unit(direction).ok_or(Error::NoDirection { what: "plücker line" })?;
        let mut moment = moment / length;
        Error::check_finite("plücker moment", moment.iter())?;
        let found = moment.dot(&direction);
        let distance = moment.norm();
        let tolerance = ORTHOGONALITY_TOLERANCE * distance.max(1.0);
        if found.is_nan() || found.abs() > tolerance {
            return Err(Error::NotOrthogonal { tolerance, found });
        }
        if found.abs() > UNIT_TOLERANCE * distance {
            moment -= direction * found;
        }
        Ok(Self { moment, direction })
    }

    /// The line through two points, directed from the first to the second.
    ///
    /// `d = (end − start)/|end − start|`, `n = start × d`
    ///
    /// * `start`, `end` — metres.
    ///
    /// # Errors
    /// [`Error::NotFinite`], and [`Error::NoDirection`] when both are the same point.
    pub fn through(start: Point3<f64>, end: Point3<f64>) -> Result<Self, Error> {
        let difference = end - start;
        Error::check_finite("line through two points", difference.iter())?;
        let (direction, _) =
            unit(difference).ok_or(Error::NoDirection { what: "line through two points" })?;
        let moment = start.coords.cross(&direction);
        Error::check_finite("line through two points", moment.iter())?;
        Ok(Self { moment, direction })
    }

    /// The line in another space: `d' = R d`, `n' = R n + t × R d`.
    #[must_use]
    pub fn transformed(&self, to_from: &Pose) -> Self {
        let direction = to_from.transform_vector(&self.direction);
        let moment = to_from.transform_vector(&self.moment) + to_from.translation().cross(&direction);
        Self { moment, direction }
    }

    /// The point of the line nearest to the origin: `d × n`.
    #[must_use]
    pub fn closest_point_to_origin(&self) -> Point3<f64> {
        Point3::from(self.direction.cross(&self.moment))
    }

    /// The point of the line nearest to a point.
    #[must_use]
    pub fn closest_point_to(&self, point: Point3<f64>) -> Point3<f64> {
        point + self.direction.cross(&self.moment_about(point))
    }

    /// Distance from a point to the line, metres.
    #[must_use]
    pub fn distance_to_point(&self, point: Point3<f64>) -> f64 {
        self.moment_about(point).norm()
    }

    /// The point of this line nearest to another line; `None` when they are parallel (within 1e-9 rad).
    ///
    /// With `other` the ray of a pixel, this is where on the line an observed end lies.
    #[must_use]
    pub fn closest_point_to_line(&self, other: &PluckerLine) -> Option<Point3<f64>> {
        let across = self.direction.cross(&other.direction);
        if across.norm() <= PARALLEL_ANGLE {
            return None;
        }
        let near = self.closest_point_to_origin();
        // With `near` for origin, `s d₁` and the other's nearest point differ by a multiple of `d₁ × d₂`.
        let along = other.moment_about(near).dot(&across) / across.norm_squared();
        Some(near + self.direction * along)
    }

    /// Least distance between two endless lines, metres.
    ///
    /// `|d₁ · n₂ + d₂ · n₁| / |d₁ × d₂|`; lines at under 1e-9 rad to each other are taken for parallel.
    #[must_use]
    pub fn distance_to_line(&self, other: &PluckerLine) -> f64 {
        // Measured from a point of this line, whose own moment is then zero.
        let moment = other.moment_about(self.closest_point_to_origin());
        let sine = self.direction.cross(&other.direction).norm();
        if sine <= PARALLEL_ANGLE { moment.norm() } else { self.direction.dot(&moment).abs() / sine }
    }

    /// The angle between two lines, whichever way they are directed, radians in `[0, π/2]`.
    #[must_use]
    pub fn angle_to(&self, other: &PluckerLine) -> f64 {
        unsigned_angle(&self.direction, &other.direction)
    }

    /// `n · d`, metres: zero for a line, and the measure of how far these six numbers are from being one.
    #[must_use]
    pub fn constraint(&self) -> f64 {
        self.moment.dot(&self.direction)
    }

    /// The same line by four numbers.
    #[must_use]
    pub fn orthonormal(&self) -> OrthonormalLine {
        OrthonormalLine::from_plucker(self)
    }

    /// The image of the line: `l = K̃ · moment(ᶜL)`, scaled to `l₀² + l₁² = 1`.
    ///
    /// `l · (u, v, 1)` is then the signed distance of a pixel from the line, pixels. The sign is that of `ũ_s × ũ_e` for two points in
    /// the order of the line's direction.
    ///
    /// * `camera_from_world` — pose of the world in the camera, metres.
    ///
    /// # Errors
    /// [`Error::NoImage`] when the line passes through the camera centre, or its plane through the centre is parallel to the image.
    pub fn image(&self, camera: &PinholeCamera, camera_from_world: &Pose) -> Result<Vector3<f64>, Error> {
        let moment = self.transformed(camera_from_world).moment;
        let no_image = Error::NoImage { moment: moment.into() };
        // What is left when two numbers of this size cancel is rounding.
        let rounding = 16.0 * f64::EPSILON * (self.moment.norm() + camera_from_world.translation().norm());
        if moment.norm() <= rounding {
            return Err(no_image);
        }
        let line = camera.line_matrix() * moment;
        let scale = libm::hypot(line.x, line.y);
        // A line over 1e12 px away.
        if scale > 1e-12 * line.z.abs() && scale.is_finite() { Ok(line / scale) } else { Err(no_image) }
    }

    /// The moment with `point` for origin.
    fn moment_about(&self, point: Point3<f64>) -> Vector3<f64> {
        self.moment - point.coords.cross(&self.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{camera, line, point, pose, segment, vector};
    use super::*;
    use proptest::prelude::*;

    /// Rounding of a few products of numbers up to about 20 m.
    const ROUNDING_M: f64 = 1e-12;

    proptest! {
        #[test]
        fn both_ends_lie_on_the_line_and_the_moment_is_its_distance(segment in segment()) {
            let line = segment.plucker().unwrap();
            prop_assert!(line.distance_to_point(segment.start) < ROUNDING_M);
            prop_assert!(line.distance_to_point(segment.end) < ROUNDING_M);
            prop_assert!((line.distance_to_point(Point3::origin()) - line.moment.norm()).abs() < ROUNDING_M);
            prop_assert!(line.constraint().abs() < ROUNDING_M);
            prop_assert!(line.direction.dot(&(segment.end - segment.start)) > 0.0);
        }

        #[test]
        fn the_scale_does_not_matter(line in line(), scale in 1e-3..1e3) {
            let again = PluckerLine::new(line.moment * scale, line.direction * scale).unwrap();
            prop_assert!((again.moment - line.moment).norm() < ROUNDING_M);
            prop_assert!((again.direction - line.direction).norm() < 1e-14);
            // What is valid already stays as it is.
            prop_assert_eq!(PluckerLine::new(again.moment, again.direction).unwrap(), again);
        }

        #[test]
        fn there_and_back_is_the_same_line(line in line(), pose in pose()) {
            let again = line.transformed(&pose).transformed(&pose.inverse());
            prop_assert!((again.moment - line.moment).norm() < ROUNDING_M);
            prop_assert!((again.direction - line.direction).norm() < ROUNDING_M);
        }

        #[test]
        fn the_closest_point_is_on_the_line_and_no_other_is_nearer(line in line(), p in point(), s in -9.0..9.0_f64) {
            let closest = line.closest_point_to(p);
            prop_assert!(line.distance_to_point(closest) < ROUNDING_M);
            prop_assert!(((closest - p).norm() - line.distance_to_point(p)).abs() < ROUNDING_M);
            prop_assert!((closest + line.direction * s - p).norm() >= (closest - p).norm() - ROUNDING_M);
            let origin = Point3::origin();
            prop_assert!((line.closest_point_to(origin) - line.closest_point_to_origin()).norm() < ROUNDING_M);
        }

        #[test]
        fn two_lines_are_as_far_apart_as_their_closest_points(a in line(), b in line()) {
            prop_assume!(a.angle_to(&b) > 0.01);
            let (on_a, on_b) = (a.closest_point_to_line(&b).unwrap(), b.closest_point_to_line(&a).unwrap());
            // Metres; the closest points are up to 1000 m away, and an angle of 0.01 rad costs two digits.
            prop_assert!(a.distance_to_point(on_a) < 1e-10 && b.distance_to_point(on_b) < 1e-10);
            prop_assert!((a.distance_to_line(&b) - (on_a - on_b).norm()).abs() < 1e-9);
            prop_assert!((a.distance_to_line(&b) - b.distance_to_line(&a)).abs() < 1e-9);
            prop_assert!((on_a - on_b).dot(&a.direction).abs() < 1e-9);
        }

        #[test]
        fn parallel_lines_are_as_far_apart_as_they_were_moved(line in line(), shift in vector(5.0)) {
            let pose = Pose::new(nalgebra::UnitQuaternion::identity(), shift);
            let moved = line.transformed(&pose);
            let back = PluckerLine { moment: -moved.moment, direction: -moved.direction };
            let expected = (shift - line.direction * shift.dot(&line.direction)).norm();
            for other in [moved, back] {
                prop_assert!((line.distance_to_line(&other) - expected).abs() < ROUNDING_M);
                prop_assert!(line.angle_to(&other) < 1e-15);
                prop_assert_eq!(line.closest_point_to_line(&other), None);
            }
        }

        #[test]
        fn ends_of_the_landmark_lie_on_its_own_image(camera in camera(), pose in pose(), segment in segment()) {
            let ends = [segment.start, segment.end].map(|end| camera.project(pose * end));
            let [Some(start), Some(end)] = ends else { return Ok(()) };
            // Pixels far outside any image carry the rounding of large numbers.
            prop_assume!(start.coords.amax() < 1e4 && end.coords.amax() < 1e4);
            let Ok(image) = segment.plucker().unwrap().image(&camera, &pose) else { return Ok(()) };
            prop_assume!((end - start).norm() > 1.0);
            let (start, end) = (start.to_homogeneous(), end.to_homogeneous());
            prop_assert!(image.dot(&start).abs() < 1e-6, "{}", image.dot(&start));
            prop_assert!(image.dot(&end).abs() < 1e-6, "{}", image.dot(&end));
            // The documented sign.
            prop_assert!(image.dot(&start.cross(&end)) > 0.0);
        }
    }

    #[test]
    fn a_line_through_the_camera_centre_has_no_image() {
        let camera = PinholeCamera::new(500.0, 500.0, 320.0, 240.0, 640, 480).unwrap();
        let camera_from_world = Pose::new(nalgebra::UnitQuaternion::identity(), Vector3::new(0.1, 0.2, 0.3));
        let centre = Point3::new(-0.1, -0.2, -0.3);
        let seen_end_on = PluckerLine::through(centre, Point3::new(0.3, 0.1, 5.0)).unwrap();
        assert!(matches!(seen_end_on.image(&camera, &camera_from_world), Err(Error::NoImage { .. })));
        let beside = PluckerLine::through(Point3::new(2.0, 0.0, -0.3), Point3::new(2.0, 1.0, -0.3)).unwrap();
        assert!(matches!(beside.image(&camera, &camera_from_world), Err(Error::NoImage { .. })));
    }

    #[test]
    fn numbers_that_are_no_line_are_refused() {
        let (x, z) = (Vector3::x(), Vector3::z());
        let found = PluckerLine::new(x + z * 1e-8, z);
        assert!(matches!(found, Err(Error::NotOrthogonal { .. })));
        assert!(matches!(PluckerLine::new(x, Vector3::zeros()), Err(Error::NoDirection { .. })));
        assert!(matches!(PluckerLine::new(x * f64::NAN, z), Err(Error::NotFinite { .. })));
        assert!(matches!(PluckerLine::new(x * 1e200, z * 1e-200), Err(Error::NotFinite { .. })));
        let far = Point3::new(f64::MAX, 0.0, 0.0);
        assert!(matches!(PluckerLine::through(far, -far), Err(Error::NotFinite { .. })));
        assert!(matches!(PluckerLine::through(far, far), Err(Error::NoDirection { .. })));
    }

    #[test]
    fn a_moment_within_tolerance_is_made_perpendicular() {
        let line = PluckerLine::new(Vector3::x() * 3.0 + Vector3::z() * 1e-9, Vector3::z() * 2.0).unwrap();
        assert_eq!(line, PluckerLine { moment: Vector3::x() * 1.5, direction: Vector3::z() });
    }
}
