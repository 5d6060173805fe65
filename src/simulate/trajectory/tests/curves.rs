//! Figures of eight and splines through waypoints.

use super::*;
use nalgebra::Vector3;
use proptest::prelude::*;

fn positions(recipe: &str) -> Vec<Vector3<f64>> {
    walk(recipe).iter().map(|pose| pose.world_from_camera.translation()).collect()
}

#[test]
fn figures_of_eight_lie_on_their_curves() {
    let a2 = 9.0;
    for speed in ["true", "false"] {
        let recipe = |shape| {
            format!(
                "kind = 'figure-eight'\nframes = 500\nhalf_width_m = 3\nshape = '{shape}'\nconstant_speed = {speed}"
            )
        };
        for p in positions(&recipe("gerono")) {
            // Rounding of fourth powers of 3.
            assert!((p.x.powi(4) - a2 * (p.x * p.x - p.y * p.y)).abs() < 1e-12, "{p}");
        }
        for p in positions(&recipe("bernoulli")) {
            let square = p.x * p.x + p.y * p.y;
            assert!((square * square - a2 * (p.x * p.x - p.y * p.y)).abs() < 1e-12, "{p}");
        }
    }
}

#[test]
fn the_speed_round_a_figure_of_eight_is_constant() {
    for shape in ["gerono", "bernoulli"] {
        for rise in [0.0, 0.7] {
            let recipe =
                format!("kind = 'figure-eight'\nframes = 2000\nshape = '{shape}'\nrise_m = {rise}\nlaps = 2");
            let poses = walk(&recipe);
            let closing = (poses[1999].world_from_camera, poses[0].world_from_camera);
            let steps: Vec<_> = pairs(&poses).chain([closing]).map(|(a, b)| distance(&a, &b)).collect();
            let mean = steps.iter().sum::<f64>() / 2000.0;
            for step in steps {
                // A chord is shorter than its arc by the square of its angle over 24: (3°)²/24 at most.
                assert!((step / mean - 1.0).abs() < 2e-4, "{shape}: {step} of {mean}");
            }
            assert_eq!(poses[0].world_from_camera, poses[1000].world_from_camera);
        }
    }
}

#[test]
fn a_camera_that_looks_forward_sees_where_it_goes() {
    for recipe in [
        "kind = 'figure-eight'\nframes = 4000\nrise_m = 0.5",
        "kind = 'waypoints'\nframes = 4000\nclosed = true\nwaypoints = [{position_m = [0, 0, 0]}, {position_m = [4, 0, 1]}, \
         {position_m = [0, 4, 0]}]",
    ] {
        for (a, b) in pairs(&walk(recipe)) {
            let ahead = (b.translation() - a.translation()).normalize();
            // The path bends by up to 0.5° within a step.
            assert!((a.rotation() * Vector3::z()).dot(&ahead) > 0.9999);
        }
    }
}

#[test]
fn a_camera_with_a_target_keeps_it_in_the_middle_of_its_image() {
    let target = Vector3::new(1.0, 9.0, -2.0);
    for recipe in [
        "kind = 'figure-eight'\nframes = 100\nlook = { target_m = [1, 9, -2] }",
        "kind = 'random'\nframes = 100\nlook = { target_m = [1, 9, -2] }",
        "kind = 'waypoints'\nframes = 100\nlook = { target_m = [1, 9, -2] }\nwaypoints = [{position_m = [0, 0, 0]}, \
         {position_m = [4, 0, 1]}]",
    ] {
        for pose in walk(recipe) {
            let in_camera = pose.world_from_camera.inverse() * nalgebra::Point3::from(target);
            assert!(in_camera.z > 1.0 && in_camera.x.hypot(in_camera.y) < 1e-12, "{recipe}: {in_camera}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_path_goes_through_its_waypoints_at_constant_speed(
        points in prop::collection::vec(prop::array::uniform3(-5.0..5.0_f64), 3..8),
        closed: bool,
    ) {
        let apart = |a: &[f64; 3], b: &[f64; 3]| (Vector3::from(*a) - Vector3::from(*b)).norm() > 0.5;
        prop_assume!(points.windows(2).all(|pair| apart(&pair[0], &pair[1])));
        prop_assume!(apart(&points[0], &points[points.len() - 1]));
        let waypoints: Vec<_> = points
            .iter()
            .map(|p| Waypoint { position_m: *p, yaw_deg: None, pitch_deg: None })
            .collect();
        let frames = 5000;
        let path = Waypoints { frames: Some(frames), waypoints, closed, ..Waypoints::default() };
        let poses = Trajectory::Waypoints(path).poses(30.0, 0, FilePath::new("")).unwrap();
        prop_assert_eq!(poses.len() as u64, frames);
        let steps: Vec<_> = pairs(&poses).map(|(a, b)| distance(&a, &b)).collect();
        let longest = steps.iter().copied().fold(0.0, f64::max);
        for point in &points {
            let nearest = poses
                .iter()
                .map(|pose| (pose.world_from_camera.translation() - Vector3::from(*point)).norm())
                .fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= 0.51 * longest, "{nearest} of steps of {longest}");
        }
        // Where the path turns back sharply a chord is shorter than its arc.
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        prop_assert!(longest < 1.01 * mean, "{longest} {mean}");
        let slow = steps.iter().filter(|step| **step < 0.99 * mean).count();
        prop_assert!(slow * 50 < steps.len(), "{slow} of {} steps are short", steps.len());
        if closed {
            let seam = distance(&poses[0].world_from_camera, &poses[poses.len() - 1].world_from_camera);
            prop_assert!(seam < 1.01 * longest);
        } else {
            prop_assert_eq!(poses[0].world_from_camera.translation(), Vector3::from(points[0]));
            let last = poses[poses.len() - 1].world_from_camera.translation();
            prop_assert!((last - Vector3::from(points[points.len() - 1])).norm() < 1e-9);
        }
    }
}

#[test]
fn waypoints_give_the_angles_and_the_yaw_goes_the_short_way() {
    let path = |rest: &str| {
        walk(&format!(
            "kind = 'waypoints'\nlook = 'waypoint'\n{rest}\nwaypoints = [{{position_m = [0, 0, 0], yaw_deg = 170}}, \
             {{position_m = [2, 0, 0], yaw_deg = -100, pitch_deg = 20}}, {{position_m = [2, 2, 0], yaw_deg = -10}}, \
             {{position_m = [0, 2, 0], yaw_deg = 80}}]"
        ))
    };
    let expected = |yaw: f64, pitch: f64| attitude::attitude(yaw.to_radians(), pitch.to_radians(), 0.0);
    let open = path("frames = 7");
    // Whole waypoints at every second frame, for the square is the same on each side but the ends.
    assert!(open[0].world_from_camera.rotation().angle_to(&expected(170.0, 0.0)) < 1e-9);
    assert!(open[6].world_from_camera.rotation().angle_to(&expected(80.0, 0.0)) < 1e-9);
    // From 170 degrees it goes up by 90 degrees four times, so one round ends where it began.
    let round = path("frames = 2000\nclosed = true");
    let closing = (round[1999].world_from_camera, round[0].world_from_camera);
    let mut whole = 0.0;
    for (a, b) in pairs(&round).chain([closing]) {
        // 0.18° a step if even; with the pitch, and the square's corners, less than thrice that.
        assert!(turn(&a, &b).to_degrees() < 0.6, "{}", turn(&a, &b).to_degrees());
        whole += turn(&a, &b).to_degrees();
    }
    assert!((360.0..400.0).contains(&whole), "{whole}");
    let at_second =
        round.iter().map(|pose| pose.world_from_camera.rotation().angle_to(&expected(-100.0, 20.0)));
    assert!(at_second.fold(f64::INFINITY, f64::min) < 0.6_f64.to_radians());
}
