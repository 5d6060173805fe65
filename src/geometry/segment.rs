//! A straight piece of the world between two points.

use super::direction::unit;
use super::{Error, PluckerLine, Pose};
use nalgebra::{Point3, Vector3, center};

/// Two ends in one space, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// The first end, metres.
    pub start: Point3<f64>,
    /// The second end, metres.
    pub end: Point3<f64>,
}

impl Segment {
    /// Distance between the ends, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        let difference = self.end - self.start;
        unit(difference).map_or_else(|| difference.norm(), |(_, length)| length)
    }

    /// The point halfway.
    #[must_use]
    pub fn midpoint(&self) -> Point3<f64> {
        center(&self.start, &self.end)
    }

    /// The unit vector from start to end; `None` when both ends are the same point, or not finite.
    #[must_use]
    pub fn direction(&self) -> Option<Vector3<f64>> {
        unit(self.end - self.start).map(|(direction, _)| direction)
    }

    /// The endless line through both ends, directed from start to end.
    ///
    /// # Errors
    /// Those of [`PluckerLine::through`].
    pub fn plucker(&self) -> Result<PluckerLine, Error> {
        PluckerLine::through(self.start, self.end)
    }

    /// The segment in another space.
    #[must_use]
    pub fn transformed(&self, to_from: &Pose) -> Self {
        Self { start: to_from * self.start, end: to_from * self.end }
    }

    /// Distance from a point to the nearest point of the segment, its ends included, metres.
    #[must_use]
    pub fn distance_to_point(&self, point: Point3<f64>) -> f64 {
        let Some((direction, length)) = unit(self.end - self.start) else {
            return (point - self.start).norm();
        };
        let along = direction.dot(&(point - self.start)).clamp(0.0, length);
        (point - (self.start + direction * along)).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{point, pose, segment};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn transforming_then_plucker_is_plucker_then_transforming(segment in segment(), pose in pose()) {
            let first = segment.transformed(&pose).plucker().unwrap();
            let second = segment.plucker().unwrap().transformed(&pose);
            // Metres, for coordinates up to about 20 and a segment of at least 0.1: the direction's rounding times the distance.
            prop_assert!((first.direction - second.direction).norm() < 1e-12);
            prop_assert!((first.moment - second.moment).norm() < 1e-11);
        }

        #[test]
        fn no_point_of_the_segment_is_nearer_than_its_distance(segment in segment(), p in point(), t in 0.0..=1.0) {
            let on_segment = segment.start + (segment.end - segment.start) * t;
            prop_assert!(segment.distance_to_point(on_segment) < 1e-14);
            prop_assert!(segment.distance_to_point(p) <= (p - on_segment).norm() + 1e-14);
            prop_assert!(segment.distance_to_point(p) >= segment.plucker().unwrap().distance_to_point(p) - 1e-13);
        }

        #[test]
        fn length_and_direction_lead_from_start_to_end(segment in segment()) {
            let end = segment.start + segment.direction().unwrap() * segment.length();
            prop_assert!((end - segment.end).norm() < 1e-14);
            prop_assert!(((segment.midpoint() - segment.start) - (segment.end - segment.midpoint())).norm() < 1e-14);
        }
    }

    #[test]
    fn a_segment_of_length_zero_has_no_direction() {
        let here = Point3::new(1.0, 2.0, 3.0);
        let segment = Segment { start: here, end: here };
        assert!(segment.length() <= 0.0);
        assert_eq!(segment.direction(), None);
        assert!(matches!(segment.plucker(), Err(Error::NoDirection { .. })));
        assert!((segment.distance_to_point(Point3::new(1.0, 2.0, 5.0)) - 2.0).abs() < 1e-15);
    }
}
