//! The part of a segment that a camera sees.

use nalgebra::{Point3, Vector3};

use super::{Occluders, View};

/// Hidden parts shorter than this part of a segment are rounding, not surfaces.
const SHORTEST_GAP: f64 = 1e-6;

/// The longest visible part of a segment, as an interval of `start + t (end − start)`.
///
/// The segment is cut at the bounds of the view and wherever a surface begins or ceases to hide it; of
/// several visible parts the longest in the image is taken, the first of equals.
///
/// * `min_length_px` — a part shorter than this in the image is not seen.
#[must_use]
pub fn visible_part(
    view: &View,
    occluders: &Occluders,
    start: &Point3<f64>,
    end: &Point3<f64>,
    min_length_px: f64,
) -> Option<[f64; 2]> {
    let [low, high] = view.clip(start, end)?;
    let along: Vector3<f64> = end - start;
    let at = |t: f64| start + along * t;
    let length = |[low, high]: [f64; 2]| {
        let one = view.project_unbounded(&at(low))?.0;
        let other = view.project_unbounded(&at(high))?.0;
        Some((other - one).norm())
    };
    // Before the search for surfaces, for most short segments end here.
    if length([low, high])? < min_length_px {
        return None;
    }
    let mut best: Option<([f64; 2], f64)> = None;
    let mut consider = |part: [f64; 2]| {
        if let Some(length) = length(part).filter(|length| *length >= min_length_px && *length > 0.0)
            && best.is_none_or(|(_, longest)| length > longest)
        {
            best = Some((part, length));
        }
    };
    let mut from = low;
    // Only what is in view can be hidden, and in it the shadows are found with less rounding.
    for [hidden_low, hidden_high] in occluders.hidden_parts(&view.center(), &at(low), &at(high)) {
        if hidden_high - hidden_low < SHORTEST_GAP {
            continue;
        }
        let [to, next] = [hidden_low, hidden_high].map(|t| low + t * (high - low));
        if to > from {
            consider([from, to]);
        }
        from = next;
    }
    if high > from {
        consider([from, high]);
    }
    best.map(|(part, _)| part)
}

#[cfg(test)]
mod tests {
    use super::super::Bounds;
    use super::super::view::tests::{camera, point, view};
    use super::*;
    use crate::geometry::Pose;
    use crate::simulate::scene::{Face, Scene};
    use proptest::prelude::*;

    fn pillar(x: [f64; 2], z: f64) -> Face {
        let corner = |x, y| Point3::new(x, y, z);
        Face::quad([corner(x[0], -5.0), corner(x[1], -5.0), corner(x[1], 5.0), corner(x[0], 5.0)], 0)
    }

    #[test]
    fn of_a_segment_behind_a_pillar_the_longer_end_is_seen() {
        let view = View::new(camera(false), &Pose::identity(), Bounds::whole_pixels([0.1, 100.0]));
        let scene = Scene { faces: vec![pillar([-0.1, 0.2], 2.0)], edges: Vec::new() };
        let (start, end) = (Point3::new(-1.0, 0.0, 4.0), Point3::new(1.0, 0.0, 4.0));
        // The pillar covers from −0.2 to 0.4 at twice its distance: 0.8 m are left of it, 0.6 m right.
        let [low, high] = visible_part(&view, &Occluders::new(&scene), &start, &end, 5.0).unwrap();
        assert!(low.abs() < 1e-12 && (high - 0.4).abs() < 1e-8, "{low} {high}");
        let longest = 535.4 * 0.8 / 4.0;
        assert!(visible_part(&view, &Occluders::new(&scene), &start, &end, longest - 0.01).is_some());
        assert!(visible_part(&view, &Occluders::new(&scene), &start, &end, longest + 0.01).is_none());
    }

    proptest! {
        #[test]
        fn every_point_of_the_part_is_seen(
            view in view(), start in point(6.0), end in point(6.0),
            corners in prop::collection::vec(prop::array::uniform3(point(3.0)), 0..12),
        ) {
            let faces = corners.into_iter().map(|corners| Face::triangle(corners, 0)).collect();
            let occluders = Occluders::new(&Scene { faces, edges: Vec::new() });
            if let Some([low, high]) = visible_part(&view, &occluders, &start, &end, 5.0) {
                prop_assert!(0.0 <= low && low < high && high <= 1.0);
                for step in 1..50 {
                    let t = low + (high - low) * f64::from(step) / 50.0;
                    let point = start + (end - start) * t;
                    prop_assert!(view.project(&point).is_some() && !occluders.hides(&view.center(), &point));
                }
            }
        }
    }
}
