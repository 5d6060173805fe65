//! The bounds of the random path, and what no trajectory may ask for.

use super::*;
use crate::structure::{MotionGrade, grade_of, typical_rotation};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Holds every pair of frames to the bounds, and gives the parts of them that pairs use: speed, turn rate.
fn parts_used(
    spline: &RandomSpline,
    rate: f64,
    seed: u64,
    speed_m_s: f64,
    turn_rate_deg_s: f64,
) -> Vec<(f64, f64)> {
    let poses = Trajectory::Random(spline.clone()).poses(rate, seed, FilePath::new("")).unwrap();
    assert_eq!(poses.len() as u64, spline.frames.unwrap());
    let (low, high) = (Vector3::from(spline.low_m), Vector3::from(spline.high_m));
    for pose in &poses {
        let position = pose.world_from_camera.translation();
        // Rounding of a mean of four points within 100 m.
        assert!((position - low).min() > -1e-12 && (high - position).min() > -1e-12, "{position}");
    }
    poses
        .windows(2)
        .map(|pair| {
            let seconds = (pair[1].stamp_nanos - pair[0].stamp_nanos) as f64 * 1e-9;
            let (a, b) = (pair[0].world_from_camera, pair[1].world_from_camera);
            let speed = distance(&a, &b) / seconds / speed_m_s;
            let turning = turn(&a, &b).to_degrees() / seconds / turn_rate_deg_s;
            assert!(speed <= 1.0 && turning <= 1.0, "seed {seed}: {speed} {turning}");
            (speed, turning)
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_random_path_keeps_its_bounds_in_every_step(
        seed: u64,
        rate in 0.5..200.0_f64,
        max_speed_m_s in 0.01..20.0_f64,
        turn_rate in 0.5..400.0_f64,
        half in prop::array::uniform3(0.0..10.0_f64),
        forward: bool,
    ) {
        prop_assume!(half.iter().any(|half| *half > 0.01));
        let look = if forward { Look::Forward } else { Look::Target([1.0, 2.0, 0.5]) };
        let spline = RandomSpline {
            frames: Some(400),
            low_m: half.map(|half| -half),
            high_m: half,
            max_speed_m_s: Some(max_speed_m_s),
            max_turn_rate_deg_s: Some(turn_rate),
            look,
            ..RandomSpline::default()
        };
        parts_used(&spline, rate, seed, max_speed_m_s, turn_rate);
    }

    #[test]
    fn a_random_path_goes_as_fast_as_its_bounds_allow(seed: u64, turn_rate in 10.0..200.0_f64) {
        let spline = RandomSpline {
            frames: Some(1000),
            max_turn_rate_deg_s: Some(turn_rate),
            ..RandomSpline::default()
        };
        let used = parts_used(&spline, 30.0, seed, 1.0, turn_rate);
        let idle = used.iter().filter(|(speed, turning)| speed.max(*turning) < 0.95).count();
        // The first steps, and those at cusps, may be shorter.
        prop_assert!(idle < 50, "{idle} of 999 steps use neither bound");
    }

    #[test]
    fn motion_makes_a_random_path_that_has_the_grade(
        seed: u64,
        rate in 1.0..100.0_f64,
        half in prop::array::uniform3(0.1..10.0_f64),
    ) {
        for grade in [MotionGrade::Slow, MotionGrade::Medium, MotionGrade::Sharp] {
            let (low_m, high_m) = (half.map(|half| -half), half);
            let spline =
                RandomSpline { frames: Some(500), motion: Some(grade), low_m, high_m, ..RandomSpline::default() };
            let poses = Trajectory::Random(spline).poses(rate, seed, FilePath::new("")).unwrap();
            let turns: Vec<_> = pairs(&poses).map(|(a, b)| turn(&a, &b)).collect();
            // Stamps are rounded to the nanosecond, 1e-7 of the shortest time between frames.
            prop_assert!(turns.iter().all(|turn| *turn <= grade.rotation_rad() * (1.0 + 1e-7)));
            let typical = typical_rotation(turns).unwrap();
            prop_assert_eq!(grade_of(typical), grade, "{} degrees", typical.to_degrees());
        }
    }
}

#[test]
fn a_seed_makes_its_path_and_no_other() {
    let spline = trajectory("kind = 'random'\nframes = 50");
    let of = |seed| spline.poses(30.0, seed, FilePath::new("")).unwrap();
    assert_eq!(of(3), of(3));
    assert_ne!(of(3), of(4));
    // More frames go on from fewer.
    assert_eq!(
        trajectory("kind = 'random'\nframes = 20").poses(30.0, 3, FilePath::new("")).unwrap(),
        of(3)[..20]
    );
}

#[test]
fn a_parameter_that_makes_no_path_is_refused_by_its_place() {
    let two = "waypoints = [{position_m = [0, 0, 0]}, {position_m = [1, 0, 0]}]";
    let cases = [
        ("kind = 'wave'", "frames"),
        ("kind = 'wave'\nframes = 0", "frames"),
        ("kind = 'wave'\nframes = 9", "frames"),
        ("kind = 'wave'\nframes = 10000001", "frames"),
        ("kind = 'wave'\nframes = 100\nmotion = 'slow'", "motion"),
        ("kind = 'wave'\nmotion = 'slow'\nturns = 0.0", "motion"),
        ("kind = 'wave'\nframes = 100\nradius_m = nan", "radius_m"),
        ("kind = 'wave'\nframes = 100\nradius_m = 0.0", "radius_m"),
        ("kind = 'wave'\nframes = 100\nradius_m = -1.0", "radius_m"),
        ("kind = 'wave'\nframes = 100\namplitude_m = inf", "amplitude_m"),
        ("kind = 'wave'\nframes = 100\nwaves = 0", "waves"),
        ("kind = 'wave'\nframes = 100\nturns = inf", "turns"),
        ("kind = 'wave'\nframes = 100\npitch_deg = 1e9", "pitch_deg"),
        ("kind = 'sphere'\nframes = 100\nradius_m = 1e9", "radius_m"),
        ("kind = 'sphere'\nframes = 100\nturns = nan", "turns"),
        ("kind = 'sphere'\nframes = 100\ncentre_m = [0, nan, 0]", "centre_m"),
        ("kind = 'corridor'\nframes = 7", "frames"),
        ("kind = 'corridor'\nframes = 100\npieces = 0", "pieces"),
        ("kind = 'corridor'\nmotion = 'sharp'\npieces = 1", "motion"),
        ("kind = 'corridor'\nframes = 100\nhalf_leg_m = [1, 0]", "half_leg_m"),
        ("kind = 'corridor'\nframes = 100\ncorner_radius_m = -3.0", "corner_radius_m"),
        ("kind = 'figure-eight'\nframes = 100\nlaps = 0", "laps"),
        ("kind = 'figure-eight'\nframes = 100\nrise_m = nan", "rise_m"),
        ("kind = 'figure-eight'\nframes = 100\nlook = { target_m = [0, 0, nan] }", "look.target_m"),
        ("kind = 'figure-eight'\nframes = 100\nlook = { target_m = [4, 0, 0] }", "look.target_m"),
        ("kind = 'random'", "frames"),
        ("kind = 'random'\nframes = 100\nmax_speed_m_s = 0.0", "max_speed_m_s"),
        ("kind = 'random'\nframes = 100\nmax_turn_rate_deg_s = nan", "max_turn_rate_deg_s"),
        ("kind = 'random'\nframes = 100\nmax_turn_rate_deg_s = 5.0\nmotion = 'slow'", "motion"),
        ("kind = 'random'\nframes = 100\nhigh_m = [3, 3, -3]", "high_m"),
        ("kind = 'random'\nframes = 100\nlow_m = [3, 3, 0.5]", "high_m"),
        ("kind = 'waypoints'\nframes = 100", "waypoints"),
        (&format!("kind = 'waypoints'\nframes = 100\nclosed = true\n{two}"), "waypoints"),
        (&format!("kind = 'waypoints'\nframes = 100\nlook = 'waypoint'\n{two}"), "waypoints[0].yaw_deg"),
        (&format!("kind = 'waypoints'\nmotion = 'slow'\n{two}"), "motion"),
        (
            "kind = 'waypoints'\nframes = 9\nwaypoints = [{position_m = [0, 0, 0]}, {position_m = [0, 0, 0]}]",
            "waypoints[0].position_m",
        ),
        (
            "kind = 'waypoints'\nframes = 9\nwaypoints = [{position_m = [0, 0, 0]}, {position_m = [0, nan, 0]}]",
            "waypoints[1].position_m",
        ),
    ];
    for (recipe, field) in cases {
        let error = refusal(recipe);
        assert!(
            matches!(&error, Error::Value { place, .. } if *place == format!("trajectory.{field}")),
            "{recipe}: {error}"
        );
    }
}
