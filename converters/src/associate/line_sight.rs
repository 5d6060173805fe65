//! Which part of a line a frame sees.

use nalgebra::Point3;
use open_structure::geometry::{Pose, Segment};

use super::line_options::{LineOptions, focal_px};
use crate::rgbd::{DepthMap, DepthNoise, Raster, Sight};

/// Pixels around a place in which its depth may be found, for lines lie on edges.
const REACH: i64 = 2;
/// How far within the image a view stays, pixels, so that rounding does not carry it out.
const MARGIN_PX: f64 = 1e-6;
/// Most places along a view.
const MOST: f64 = 20_000.0;

/// The part of a landmark that a frame sees: two parameters along it, 0 at its start and 1 at its end.
///
/// The landmark is cut to what is in front of the camera and within the image, and the depth map is asked at places along its
/// image. The longest piece counts along which it is hidden nowhere for more than a short gap; it begins and ends where the map
/// shows it. The observation is then the exact projection of the landmark at both parameters.
///
/// * `segment` — the landmark, world, metres.
///
/// `None` where the view is too short, or too little of it is shown by the depth map.
#[must_use]
pub fn visible_part(
    raster: &Raster,
    depth: &DepthMap,
    noise: &DepthNoise,
    camera_from_world: &Pose,
    segment: &Segment,
    options: &LineOptions,
) -> Option<[f64; 2]> {
    let [start, end] = [segment.start, segment.end].map(|end| camera_from_world * end);
    let [from, to] = within_image(raster, start, end, options.nearest_m)?;
    let at = |parameter: f64| start + (end - start) * parameter;
    let image = |parameter: f64| raster.camera().project(at(parameter));
    let (near, far) = (at(from).z, at(to).z);
    let length = (image(to)? - image(from)?).norm();
    if length < options.sight_length_px {
        return None;
    }
    let steps = (length / options.sight_step_px.max(0.1)).ceil().clamp(1.0, MOST);
    // Evenly in the image: a place's inverse depth is linear there.
    let parameter = |step: usize| {
        let part = step as f64 / steps;
        from + (to - from) * (part * near / (part * near + (1.0 - part) * far))
    };
    let focal_px = focal_px(raster);
    let seen = |step: usize| {
        let point = at(parameter(step));
        let Some((_, position)) = raster.project(point) else { return false };
        depth.sight(position, point.z, focal_px, noise, REACH) == Sight::Seen
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most MOST")]
    let shown: Vec<usize> = (0..=steps as usize).filter(|step| seen(*step)).collect();
    let step_px = length / steps;
    let (first, last) = longest_run(&shown, options.sight_gap_px / step_px, options.sight_part)?;
    if ((last - first) as f64) * step_px < options.sight_length_px {
        return None;
    }
    // The parameter of the last step is exact, so that a landmark seen whole has 0 and 1.
    let exact = |step: usize| if step as f64 >= steps { to } else { parameter(step) };
    Some([exact(first), exact(last)])
}

/// The longest run of steps between which no gap is too wide and of which enough are there.
fn longest_run(shown: &[usize], gap: f64, part: f64) -> Option<(usize, usize)> {
    let runs = shown.chunk_by(|before, after| (after - before - 1) as f64 <= gap);
    let ends = runs.filter_map(|run| {
        let (first, last) = (*run.first()?, *run.last()?);
        (run.len() as f64 >= part * (last - first + 1) as f64).then_some((first, last))
    });
    // Of equally long runs, the first.
    ends.reduce(|best, run| if run.1 - run.0 > best.1 - best.0 { run } else { best })
}

/// The part of a segment in the camera that lies beyond a depth and within the image, as parameters along it.
fn within_image(raster: &Raster, start: Point3<f64>, end: Point3<f64>, nearest_m: f64) -> Option<[f64; 2]> {
    let camera = raster.camera();
    let [low_u, high_u, low_v, high_v] = raster.bounds();
    // Signed distances from five planes, positive inside; linear along the segment.
    let planes = |p: Point3<f64>| {
        let (u, v) = (camera.fx * p.x + camera.cx * p.z, camera.fy * p.y + camera.cy * p.z);
        [
            p.z - nearest_m.max(1e-6),
            u - (low_u + MARGIN_PX) * p.z,
            (high_u - MARGIN_PX) * p.z - u,
            v - (low_v + MARGIN_PX) * p.z,
            (high_v - MARGIN_PX) * p.z - v,
        ]
    };
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (a, b) in planes(start).into_iter().zip(planes(end)) {
        if !(a >= 0.0 || b >= 0.0) {
            return None;
        }
        if a < 0.0 {
            from = from.max(a / (a - b));
        } else if b < 0.0 {
            to = to.min(a / (a - b));
        }
    }
    (from < to).then_some([from, to])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rgbd::BrownConrady;
    use nalgebra::Point2;
    use open_structure::geometry::PinholeCamera;
    use open_structure::structure::{Camera, CameraId, registry};
    use proptest::prelude::*;

    const NOISE: DepthNoise = DepthNoise { constant_m: 1e-3, linear: 0.0, quadratic_per_m: 0.0 };

    fn raster(lens: bool) -> Raster {
        let pinhole = PinholeCamera { fx: 130.0, fy: -135.0, cx: 80.0, cy: 60.0, width: 160, height: 120 };
        let lens = lens.then(|| BrownConrady::new([0.2312, -0.7849, -0.0033, -0.0001, 0.9172]));
        Raster::new(&Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CENTER), lens)
    }

    fn map(depth: impl Fn(f64, f64) -> f64) -> DepthMap {
        let cells = (0..160 * 120).map(|cell| depth(f64::from(cell % 160), f64::from(cell / 160)) as f32);
        DepthMap::new(160, 120, cells.collect()).unwrap()
    }

    fn part(raster: &Raster, depth: &DepthMap, segment: &Segment) -> Option<[f64; 2]> {
        visible_part(raster, depth, &NOISE, &Pose::identity(), segment, &LineOptions::default())
    }

    fn at(segment: &Segment, parameter: f64) -> Point3<f64> {
        segment.start + (segment.end - segment.start) * parameter
    }

    /// A line on a wall 2 m away, between two image positions of a camera without lens.
    fn on_wall(from: [f64; 2], to: [f64; 2]) -> Segment {
        let camera = raster(false);
        let place = |pixel: [f64; 2]| camera.camera().back_project(Point2::from(pixel), 2.0);
        Segment { start: place(from), end: place(to) }
    }

    proptest! {
        #[test]
        fn what_is_seen_of_a_line_on_a_wall_is_what_the_image_holds(
            lens in any::<bool>(), from in (-100.0..260.0, -80.0..200.0), to in (-100.0..260.0, -80.0..200.0),
        ) {
            let raster = raster(lens);
            let segment = on_wall(from.into(), to.into());
            let depth = map(|_, _| 2.0);
            let inside = |parameter: f64| raster.project(at(&segment, parameter)).is_some();
            let Some([first, last]) = part(&raster, &depth, &segment) else {
                // Nothing of 15 px and two steps lies within the image; through the lens, in one piece.
                let pixels = (Point2::from(<[f64; 2]>::from(to)) - Point2::from(<[f64; 2]>::from(from))).norm();
                let held = (0..=1000).filter(|step| inside(f64::from(*step) / 1000.0)).count();
                prop_assert!(held as f64 / 1000.0 * pixels < 20.0 + 0.01 * pixels, "{held} of {pixels}");
                return Ok(());
            };
            prop_assert!((0.0..1.0).contains(&first) && first < last && last <= 1.0);
            prop_assert!(inside(first) && inside(last));
            let pixels = raster.camera().project(segment.end).unwrap() - raster.camera().project(segment.start).unwrap();
            // Beyond the ends the image ends, within two steps.
            let step = 4.1 / pixels.norm();
            prop_assert!(first <= 0.0 || !inside(first - step));
            prop_assert!(last >= 1.0 || !inside(last + step));
        }
    }

    #[test]
    fn a_landmark_seen_whole_is_seen_from_end_to_end() {
        let segment = on_wall([20.0, 30.0], [140.0, 90.0]);
        assert_eq!(part(&raster(false), &map(|_, _| 2.0), &segment), Some([0.0, 1.0]));
        // A slanted one as well: from 2 m to 4 m.
        let end = Point3::from(segment.end.coords * 2.0);
        let slanted = Segment { start: segment.start, end };
        // A plane through both ends and upright in the image has an inverse depth linear in u.
        let depth = map(|u, _| 1.0 / (0.5 - 0.25 * (u - 20.0) / 120.0));
        assert_eq!(part(&raster(false), &depth, &slanted), Some([0.0, 1.0]));
    }

    #[test]
    fn the_longest_piece_beside_what_hides_it_counts() {
        let raster = raster(false);
        let segment = on_wall([10.0, 60.0], [150.0, 60.0]);
        let hidden = |from: f64, to: f64| map(move |u, _| if (from..to).contains(&u) { 1.0 } else { 2.0 });
        let [first, last] = part(&raster, &hidden(50.0, 80.0), &segment).unwrap();
        // Columns 80 to 150, and what is within two pixels of its edge.
        assert!((first - 0.5).abs() < 0.03 && last >= 1.0, "{first} {last}");
        assert_eq!(part(&raster, &hidden(50.0, 54.0), &segment), Some([0.0, 1.0]), "a short gap is bridged");
        assert_eq!(part(&raster, &hidden(0.0, 160.0), &segment), None);
        assert_eq!(part(&raster, &map(|_, _| 3.0), &segment), None, "nothing is where it should be");
        assert_eq!(part(&raster, &map(|_, _| f64::NAN), &segment), None);
        // Of many short gaps none may be bridged in vain: a fence of 2 px every 6 px leaves too little.
        let fence = map(|u, _| if u.rem_euclid(9.0) < 2.0 { 2.0 } else { 1.0 });
        assert!(part(&raster, &fence, &segment).is_none_or(|[first, last]| last - first > 0.9));
    }

    #[test]
    fn what_is_behind_or_beside_the_camera_or_short_is_not_seen() {
        let raster = raster(false);
        let depth = map(|_, _| 2.0);
        let point = Point3::new;
        let unseen = [
            Segment { start: point(-0.3, 0.0, -2.0), end: point(0.3, 0.0, -2.0) },
            Segment { start: point(4.0, 0.0, 2.0), end: point(4.0, 1.0, 2.0) },
            on_wall([50.0, 50.0], [60.0, 50.0]),
            Segment { start: point(0.0, 0.0, 2.0), end: point(0.0, 0.0, 2.0) },
            Segment { start: point(f64::NAN, 0.0, 2.0), end: point(0.3, 0.0, 2.0) },
            Segment { start: point(-0.3, 0.0, 2.0), end: point(0.3, 0.0, f64::INFINITY) },
            Segment { start: point(0.0, 0.0, 0.0), end: point(0.3, 0.0, 0.0) },
        ];
        for segment in unseen {
            assert_eq!(part(&raster, &depth, &segment), None, "{segment:?}");
        }
        // Through the camera's plane, out of the image: only the part on the wall is seen, if the map has it.
        let through = Segment { start: point(0.05, 0.02, -1.0), end: point(0.6, 0.3, 4.0) };
        let floor = map(|u, v| {
            let along = |u: f64| 0.05 + 0.55 * (u + 1.0) / 5.0;
            // Depths of the line itself, for columns it crosses.
            let steps = (0..4000).map(|step| 4.0 * f64::from(step) / 4000.0 + 1e-3);
            let _ = v;
            steps
                .min_by(|a, b| {
                    let miss = |z: &f64| (130.0 * along(*z) / z + 80.0 - u).abs();
                    miss(a).total_cmp(&miss(b))
                })
                .unwrap()
        });
        let [first, last] = part(&raster, &floor, &through).unwrap();
        assert!(at(&through, first).z > 0.05 && last >= 1.0 - 1e-9, "{first} {last}");
    }
}
