//! Errors of a map: how far its points and lines are from where they should be.

use nalgebra::Point3;

use super::reconstruction::shared;
use super::{Similarity, Statistics};
use crate::geometry::{Segment, angle_between};
use crate::structure::{LineId, PointId};

/// Errors of the points that are in both maps, by ascending id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointErrors {
    /// Points that are in both.
    pub ids: Vec<PointId>,
    /// Distances from where they should be, metres.
    pub distance_m: Vec<f64>,
    /// Points that only the reference has.
    pub missing: usize,
    /// Points that only the estimate has.
    pub extra: usize,
}

/// Errors of the lines that are in both maps, by ascending id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineErrors {
    /// Lines that are in both, and have a length in both.
    pub ids: Vec<LineId>,
    /// Angles between the directions, radians in `[0, π/2]`: which end is first does not matter.
    pub angle_rad: Vec<f64>,
    /// Distances of the middle of the reference's segment from the estimate's endless line, metres: the perpendicular
    /// offset, whatever the estimate's ends are.
    pub distance_m: Vec<f64>,
    /// Part of the reference's segment that the estimate's covers, seen across the reference, in `[0, 1]`.
    pub coverage: Vec<f64>,
    /// What both segments have in common over what they take together, along the reference, in `[0, 1]`; 1 means that
    /// their ends agree.
    pub overlap: Vec<f64>,
    /// Lines that only the reference has.
    pub missing: usize,
    /// Lines that only the estimate has.
    pub extra: usize,
    /// Lines in both that have no direction in one, because their ends are one point.
    pub without_direction: usize,
}

impl PointErrors {
    /// Compares the points that have the same id.
    ///
    /// ```text
    /// e = |P − (s R P̂ + t)|
    /// ```
    ///
    /// * `reference`, `estimate` — points by ascending id, each id once, metres.
    /// * `reference_from_estimate` — the alignment of the trajectory that the map belongs to.
    #[must_use]
    pub fn of(
        reference: &[(PointId, Point3<f64>)],
        estimate: &[(PointId, Point3<f64>)],
        reference_from_estimate: &Similarity,
    ) -> Self {
        let (both, missing, extra) = shared(reference, estimate);
        let distance = |(_, there, here): &(PointId, &Point3<f64>, &Point3<f64>)| {
            (*there - reference_from_estimate.point(**here)).norm()
        };
        Self {
            ids: both.iter().map(|(id, ..)| *id).collect(),
            distance_m: both.iter().map(distance).collect(),
            missing,
            extra,
        }
    }

    /// What the distances amount to, metres; `None` when no point is in both.
    #[must_use]
    pub fn statistics(&self) -> Option<Statistics> {
        Statistics::of(&self.distance_m)
    }
}

impl LineErrors {
    /// Compares the lines that have the same id.
    ///
    /// With the ends `s, e`, the length `l` and the direction `d` of the reference's segment, and the aligned estimate's
    /// ends at `a ≤ b` along d from s:
    ///
    /// ```text
    /// coverage = |[0, l] ∩ [a, b]| / l,   overlap = |[0, l] ∩ [a, b]| / |[0, l] ∪ [a, b]|
    /// ```
    ///
    /// * `reference`, `estimate` — lines by ascending id, each id once, metres.
    /// * `reference_from_estimate` — the alignment of the trajectory that the map belongs to.
    #[must_use]
    pub fn of(
        reference: &[(LineId, Segment)],
        estimate: &[(LineId, Segment)],
        reference_from_estimate: &Similarity,
    ) -> Self {
        let (both, missing, extra) = shared(reference, estimate);
        let mut errors = Self { missing, extra, ..Self::default() };
        for (id, there, here) in both {
            let here = reference_from_estimate.segment(here);
            let (Some(true_direction), Some(direction), Ok(line)) =
                (there.direction(), here.direction(), here.plucker())
            else {
                errors.without_direction += 1;
                continue;
            };
            let angle = angle_between(&true_direction, &direction);
            errors.ids.push(id);
            errors.angle_rad.push(angle.min(std::f64::consts::PI - angle));
            errors.distance_m.push(line.distance_to_point(there.midpoint()));
            let ends = [here.start, here.end].map(|end| true_direction.dot(&(end - there.start)));
            let (first, last) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            let length = there.length();
            let common = (last.min(length) - first.max(0.0)).max(0.0);
            let together = length + (last - first) - common;
            errors.coverage.push((common / length).min(1.0));
            errors.overlap.push((common / together).min(1.0));
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{point, similarity};
    use super::*;
    use proptest::prelude::*;

    fn segment() -> impl Strategy<Value = Segment> {
        (point(), point())
            .prop_map(|(start, end)| Segment { start, end })
            .prop_filter("a segment with a direction", |segment| segment.length() > 0.1)
    }

    fn line(start: [f64; 3], end: [f64; 3]) -> [(LineId, Segment); 1] {
        [(LineId(1), Segment { start: start.into(), end: end.into() })]
    }

    fn compared(there: &[(LineId, Segment)], here: &[(LineId, Segment)]) -> [f64; 4] {
        let found = LineErrors::of(there, here, &Similarity::identity());
        [found.angle_rad[0], found.distance_m[0], found.coverage[0], found.overlap[0]]
    }

    #[test]
    fn a_shifted_line_is_as_far_as_it_was_shifted_and_covers_what_is_left() {
        let there = line([0.0; 3], [4.0, 0.0, 0.0]);
        let here = line([6.0, 0.3, 0.4], [1.0, 0.3, 0.4]);
        let found = compared(&there, &here);
        // Rounding of numbers about one.
        let expected = [0.0, 0.5, 0.75, 0.5];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
    }

    #[test]
    fn a_line_turned_about_the_middle_has_its_angle_and_no_distance() {
        for angle in [1e-9_f64, 0.1, 1.0, 1.5] {
            let (sine, cosine) = (2.0 * angle.sin(), 2.0 * angle.cos());
            let there = line([-2.0, 1.0, 0.0], [2.0, 1.0, 0.0]);
            let here = line([-cosine, 1.0 - sine, 0.0], [cosine, 1.0 + sine, 0.0]);
            let [found, distance, coverage, overlap] = compared(&there, &here);
            assert!((found - angle).abs() < 1e-15 && distance < 1e-15, "{angle}: {found} {distance}");
            assert!((coverage - angle.cos()).abs() < 1e-15 && (overlap - angle.cos()).abs() < 1e-15);
        }
    }

    #[test]
    fn lines_side_by_side_have_nothing_in_common() {
        let found = compared(&line([0.0; 3], [1.0, 0.0, 0.0]), &line([2.0, 0.0, 0.0], [3.0, 0.0, 0.0]));
        assert_eq!(found, [0.0; 4]);
    }

    #[test]
    fn what_one_map_has_alone_and_what_has_no_direction_is_counted() {
        let here = Point3::origin();
        let ids = |ids: &[i64]| ids.iter().map(|id| (PointId(*id), here)).collect::<Vec<_>>();
        let found = PointErrors::of(&ids(&[1, 2, 4, 8]), &ids(&[0, 2, 3, 8, 9]), &Similarity::identity());
        assert_eq!((found.ids, found.missing, found.extra), (vec![PointId(2), PointId(8)], 2, 3));
        assert_eq!(PointErrors::of(&ids(&[1]), &[], &Similarity::identity()).statistics(), None);
        let point = line([1.0; 3], [1.0; 3]);
        let found = LineErrors::of(&point, &line([0.0; 3], [1.0; 3]), &Similarity::identity());
        assert_eq!((found.without_direction, found.ids.len(), found.missing), (1, 0, 0));
    }

    proptest! {
        #[test]
        fn a_map_that_was_moved_is_found_where_it_should_be(
            points in prop::collection::vec(point(), 1..8),
            segments in prop::collection::vec(segment(), 1..8),
            by in similarity(),
        ) {
            let there: Vec<_> = (0..).map(PointId).zip(points.iter().map(|point| by.point(*point))).collect();
            let here: Vec<_> = (0..).map(PointId).zip(points).collect();
            let found = PointErrors::of(&there, &here, &by);
            prop_assert!(found.statistics().unwrap().max < 1e-15);
            let there: Vec<_> = (0..).map(LineId).zip(segments.iter().map(|line| by.segment(line))).collect();
            let turned = |line: &Segment| Segment { start: line.end, end: line.start };
            let here: Vec<_> = (0..).map(LineId).zip(segments.iter().map(turned)).collect();
            let found = LineErrors::of(&there, &here, &by);
            prop_assert_eq!(found.ids.len(), here.len());
            // Rounding of coordinates up to 45 m over segments of at least 2 cm.
            prop_assert!(found.angle_rad.iter().chain(&found.distance_m).all(|error| *error < 1e-11));
            prop_assert!(found.coverage.iter().chain(&found.overlap).all(|part| (part - 1.0).abs() < 1e-11));
        }

        #[test]
        fn parts_are_parts(there in segment(), here in segment()) {
            let [angle, distance, coverage, overlap] = compared(&[(LineId(0), there)], &[(LineId(0), here)]);
            prop_assert!((0.0..=std::f64::consts::FRAC_PI_2).contains(&angle) && distance >= 0.0);
            prop_assert!(0.0 <= overlap && overlap <= coverage + 1e-15 && coverage <= 1.0);
        }
    }
}
