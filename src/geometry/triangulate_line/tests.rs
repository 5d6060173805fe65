use super::super::least_squares::gradient_error;
use super::super::line_residual;
use super::super::strategies::{camera, circle, line, visible_segment};
use super::*;
use crate::geometry::Segment;
use nalgebra::UnitQuaternion;
use proptest::prelude::*;

fn views(segment: &Segment, cameras: &[(PinholeCamera, Pose)]) -> Vec<LineView> {
    let seen = |camera: &PinholeCamera, pose: &Pose| {
        [segment.start, segment.end].map(|end| camera.project(pose * end).unwrap())
    };
    cameras.iter().map(|(camera, pose)| (*camera, *pose, seen(camera, pose))).collect()
}

fn rms(observations: &[LineView], line: &PluckerLine) -> f64 {
    let squares =
        observations.iter().map(|(camera, pose, ends)| line_residual(camera, pose, line, *ends).unwrap());
    (squares.map(|r| r.norm_squared()).sum::<f64>() / (2 * observations.len()) as f64).sqrt()
}

/// Shortest observed segment, pixels: seen end-on, a line has no direction to speak of.
fn shortest(observations: &[LineView]) -> f64 {
    observations.iter().map(|(_, _, [start, end])| (end - start).norm()).fold(f64::INFINITY, f64::min)
}

proptest! {
    #[test]
    fn exact_observations_give_back_the_line(
        segment in visible_segment(), cameras in prop::collection::vec((camera(), circle()), 2..12),
    ) {
        let observations = views(&segment, &cameras);
        prop_assume!(shortest(&observations) > 5.0);
        let Some(found) = triangulate_line(&observations) else { panic!("not triangulated") };
        prop_assume!(found.parallax > 0.05);
        let truth = segment.plucker().unwrap();
        // Metres: 1e-13 px of rounding, over the parallax and the least length seen.
        prop_assert!((found.line.direction - truth.direction).norm() < 1e-9);
        prop_assert!((found.line.moment - truth.moment).norm() < 1e-9);
        prop_assert!(found.rms_px < 1e-9);
        prop_assert!(found.line.constraint().abs() < 1e-14);
        prop_assert_eq!((found.count, found.skipped), (cameras.len(), 0));
    }

    #[test]
    fn order_and_place_of_the_ends_do_not_matter(
        segment in visible_segment(), cameras in prop::collection::vec((camera(), circle()), 3..8),
        parts in prop::collection::vec((0.0..0.4, 0.6..1.0, any::<bool>()), 8),
    ) {
        let observations: Vec<LineView> = cameras.iter().zip(parts).map(|((camera, pose), (from, to, turn))| {
            let along = segment.end - segment.start;
            let seen = [segment.start + along * from, segment.start + along * to];
            let [start, end] = seen.map(|end| camera.project(pose * end).unwrap());
            (*camera, *pose, if turn { [end, start] } else { [start, end] })
        }).collect();
        prop_assume!(shortest(&observations) > 5.0);
        let Some(found) = triangulate_line(&observations) else { panic!("not triangulated") };
        prop_assume!(found.parallax > 0.05);
        prop_assert!(found.line.distance_to_point(segment.start) < 1e-9);
        prop_assert!(found.line.distance_to_point(segment.end) < 1e-9);
    }

    #[test]
    fn no_nearby_line_agrees_better_with_noisy_observations(
        segment in visible_segment(),
        cameras in prop::collection::vec(((camera(), circle()), prop::array::uniform4(-2.0..2.0)), 4..12),
        step in prop::array::uniform4(-1e-3..1e-3),
    ) {
        let (cameras, noise): (Vec<_>, Vec<_>) = cameras.into_iter().unzip();
        let mut observations = views(&segment, &cameras);
        prop_assume!(shortest(&observations) > 20.0);
        for (view, noise) in observations.iter_mut().zip(noise) {
            view.2[0] += nalgebra::Vector2::new(noise[0], noise[1]);
            view.2[1] += nalgebra::Vector2::new(noise[2], noise[3]);
        }
        let Some(found) = triangulate_line(&observations) else { panic!("not triangulated") };
        prop_assert!((found.rms_px - rms(&observations, &found.line)).abs() < 1e-9);
        let beside = found.line.orthonormal().update(&Vector4::from(step)).plucker();
        prop_assert!(found.rms_px <= rms(&observations, &beside) + 1e-12);
    }

    #[test]
    fn the_distances_have_the_gradient_of_their_cost(
        segment in visible_segment(), cameras in prop::collection::vec((camera(), circle()), 2..5),
        turn in line(), unit_m in 0.5..5.0,
    ) {
        let observations = views(&segment, &cameras);
        prop_assume!(shortest(&observations) > 5.0);
        let gauge = Gauge { centre: centre_of(&cameras[0].1), unit_m };
        // A line near the seen one, but not the minimum, where the gradient is zero.
        let shifted = Pose::new(UnitQuaternion::identity(), -gauge.centre.coords);
        let seen = segment.plucker().unwrap().transformed(&shifted);
        let scaled = PluckerLine { moment: seen.moment / unit_m, ..seen };
        let delta = Vector4::new(turn.direction.x, turn.direction.y, turn.direction.z, 0.5) * 0.02;
        let form = scaled.orthonormal().update(&delta);
        let normal = |form: &OrthonormalLine| distances(&observations, &gauge, form);
        // Central differences of a curved cost with steps of 1e-6 rad.
        let error = gradient_error(&form, normal, OrthonormalLine::update, 1e-6);
        prop_assert!(error < 1e-4, "{error}");
    }

    #[test]
    fn numbers_of_any_kind_give_a_line_or_nothing(
        numbers in prop::collection::vec(prop::array::uniform4(any::<f64>()), 2..6),
        cameras in prop::collection::vec((camera(), circle()), 6),
    ) {
        let observations: Vec<LineView> = numbers.iter().zip(&cameras).map(|(n, (camera, pose))| {
            (*camera, *pose, [Point2::new(n[0], n[1]), Point2::new(n[2], n[3])])
        }).collect();
        if let Some(found) = triangulate_line(&observations) {
            prop_assert!(found.line.moment.iter().all(|number| number.is_finite()));
        }
    }
}

#[test]
fn noise_does_not_draw_a_line_of_small_parallax_away_from_its_best_place() {
    let camera = PinholeCamera::new(500.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
    // A reproducible stand-in for noise, between -1 and 1.
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    for case in 0..200 {
        // A camera moves 20 cm past a line about 5 m away, seen 25 to 100 px long.
        let middle = Point3::new(noise(), noise(), 5.0 + noise());
        let half = Vector3::new(noise(), noise(), noise()).normalize() * 0.3;
        let segment = Segment { start: middle - half, end: middle + half };
        let motion = Vector3::new(noise(), noise(), 0.3 * noise()) * 0.2;
        let cameras: Vec<_> = (0..60)
            .map(|n| (camera, Pose::new(UnitQuaternion::identity(), motion * (f64::from(n) / 60.0))))
            .collect();
        let mut observations = views(&segment, &cameras);
        if shortest(&observations) < 25.0 {
            continue;
        }
        for end in observations.iter_mut().flat_map(|view| &mut view.2) {
            *end += nalgebra::Vector2::new(noise(), noise()) * 1.7;
        }
        let truth = rms(&observations, &segment.plucker().unwrap());
        // Nothing at all is a fair answer where the motion is along the line.
        if let Some(found) = triangulate_line(&observations) {
            assert!(found.rms_px <= truth, "case {case}: {} px, but {truth} px at the truth", found.rms_px);
        }
    }
}

fn camera_at(x: f64, y: f64) -> (PinholeCamera, Pose) {
    let camera = PinholeCamera::new(500.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
    (camera, Pose::new(UnitQuaternion::identity(), Vector3::new(-x, -y, 0.0)))
}

#[test]
fn planes_that_do_not_meet_give_nothing() {
    let level = Segment { start: Point3::new(-1.0, 0.3, 4.0), end: Point3::new(1.0, 0.3, 5.0) };
    assert_eq!(triangulate_line(&[]), None);
    assert_eq!(triangulate_line(&views(&level, &[camera_at(0.0, 0.0)])), None);
    // One place.
    assert_eq!(triangulate_line(&views(&level, &[camera_at(0.0, 0.0), camera_at(0.0, 0.0)])), None);
    // Cameras that move in the plane of the line they see.
    let plane_through_line = Segment { start: Point3::new(-1.0, 0.0, 4.0), end: Point3::new(1.0, 0.0, 5.0) };
    let along = [camera_at(0.0, 0.0), camera_at(0.5, 0.0), camera_at(1.0, 0.0)];
    assert_eq!(triangulate_line(&views(&plane_through_line, &along)), None);
    let across = [camera_at(0.0, 0.0), camera_at(0.0, 0.5)];
    assert!(triangulate_line(&views(&level, &across)).is_some());
}

#[test]
fn planes_that_meet_behind_the_cameras_give_nothing() {
    let [(camera, low), (_, high)] = [camera_at(0.0, 0.0), camera_at(0.0, 1.0)];
    let at = |v: f64| [Point2::new(100.0, v), Point2::new(500.0, v)];
    // fy is negative: from 1 m higher up a thing in front appears farther down, at larger v.
    assert!(triangulate_line(&[(camera, low, at(240.0)), (camera, high, at(340.0))]).is_some());
    assert_eq!(triangulate_line(&[(camera, low, at(240.0)), (camera, high, at(140.0))]), None);
}

#[test]
fn segments_of_length_zero_are_skipped_and_counted() {
    let segment = Segment { start: Point3::new(-1.0, 0.3, 4.0), end: Point3::new(1.0, 0.3, 5.0) };
    let mut observations = views(&segment, &[camera_at(0.0, 0.0), camera_at(0.0, 0.5), camera_at(1.0, 1.0)]);
    let expected = triangulate_line(&observations).unwrap();
    let (camera, pose) = camera_at(3.0, 3.0);
    observations.insert(0, (camera, pose, [Point2::new(9.0, 9.0); 2]));
    let found = triangulate_line(&observations).unwrap();
    assert_eq!(found, LineTriangulation { skipped: 1, ..expected });
}
