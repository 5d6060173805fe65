//! Poses of the release's formulas, worked out by hand.

use super::*;
use crate::structure::{MotionGrade, grade_of};

/// Holds a pose against a centre, metres, and the directions of its x axis and its view; rounding of a few products.
fn is_at(found: &TimedPose, centre: [f64; 3], right: [f64; 3], view: [f64; 3]) {
    let pose = found.world_from_camera;
    let near = |found: nalgebra::Vector3<f64>, expected: [f64; 3], what| {
        assert!((found - nalgebra::Vector3::from(expected)).norm() < 1e-12, "{what}: {found} {expected:?}");
    };
    near(pose.translation(), centre, "centre");
    near(pose.rotation() * nalgebra::Vector3::x(), right, "right");
    near(pose.rotation() * nalgebra::Vector3::z(), view, "view");
}

#[test]
fn the_wave_looks_down_at_its_centre() {
    // 100 frames: a period of 10, so a quarter of the circle is two waves and a half.
    let poses = walk("kind = 'wave'\nframes = 100");
    let (cosine, sine) = (0.75_f64.sqrt(), 0.5);
    is_at(&poses[0], [9.0, 0.0, 1.5], [0.0, 1.0, 0.0], [-cosine, 0.0, -sine]);
    is_at(&poses[25], [0.0, 9.0, -1.5], [-1.0, 0.0, 0.0], [0.0, -cosine, -sine]);
    is_at(&poses[50], [-9.0, 0.0, 1.5], [0.0, -1.0, 0.0], [cosine, 0.0, -sine]);
    // 447 frames: a period of ⌊44.7⌋, after which the wave is up again.
    let box1 = walk("kind = 'wave'\nframes = 447");
    assert_eq!(box1.len(), 447);
    for n in [44, 88, 440] {
        assert!((box1[n].world_from_camera.translation().z - 1.5).abs() < 1e-12, "{n}");
    }
}

#[test]
fn the_sphere_begins_at_its_lower_pole_and_hangs_upside_down() {
    // Four frames: cos φ = −3/4, −1/4, 1/4, 3/4.
    let poses = walk("kind = 'sphere'\nframes = 4\nturns = 0");
    let side = 2.0 * (7.0 / 16.0_f64).sqrt();
    is_at(&poses[0], [side, 0.0, -1.5], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
    let side = 2.0 * (15.0 / 16.0_f64).sqrt();
    is_at(&poses[2], [side, 0.0, 0.5], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
    // One frame: φ = π/2, θ = √π π/2.
    let pose = walk("kind = 'sphere'\nframes = 1")[0];
    let theta = std::f64::consts::PI.sqrt() * std::f64::consts::FRAC_PI_2;
    let (sine, cosine) = theta.sin_cos();
    is_at(&pose, [2.0 * cosine, 2.0 * sine, 0.0], [cosine, sine, 0.0], [sine, -cosine, 0.0]);
}

#[test]
fn the_corridor_looks_ahead_and_drops_what_is_left_over() {
    let poses = walk("kind = 'corridor'\nframes = 412");
    assert_eq!(poses.len(), 408);
    assert_eq!(walk("kind = 'corridor'\nframes = 845").len(), 840);
    is_at(&poses[0], [9.0, -6.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    is_at(&poses[17], [9.0, -2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    // A third of the first corner.
    let (cosine, sine) = (0.75_f64.sqrt(), 0.5);
    is_at(
        &poses[51 + 17],
        [6.0 + 3.0 * cosine, 6.0 + 3.0 * sine, 0.0],
        [cosine, sine, 0.0],
        [-sine, cosine, 0.0],
    );
    is_at(&poses[2 * 51], [6.0, 9.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]);
    is_at(&poses[4 * 51], [-9.0, 6.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
    is_at(&poses[6 * 51], [-6.0, -9.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]);
    is_at(&poses[7 * 51], [6.0, -9.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]);
}

#[test]
fn a_second_round_of_the_corridor_is_the_first_again() {
    let once = walk("kind = 'corridor'\nframes = 80\nhalf_leg_m = [5, 2]\ncentre_m = [1, 2, 3]");
    let twice =
        walk("kind = 'corridor'\nframes = 160\npieces = 16\nhalf_leg_m = [5, 2]\ncentre_m = [1, 2, 3]");
    for (n, again) in twice.iter().enumerate() {
        assert_eq!(again.world_from_camera, once[n % 80].world_from_camera);
    }
    // No gap from piece to piece: a tenth of the longest leg, 10 m, is the longest step.
    assert!(pairs(&twice).all(|(a, b)| distance(&a, &b) < 1.0 + 1e-12));
}

#[test]
fn the_six_sequences_have_their_grades() {
    use MotionGrade::{Medium, Sharp, Slow};
    for (recipe, degrees, grade) in [
        ("kind = 'wave'\nframes = 447", 0.8054, Slow),
        ("kind = 'wave'\nframes = 856", 0.4206, Slow),
        ("kind = 'corridor'\nframes = 412", 1.7647, Medium),
        ("kind = 'corridor'\nframes = 845", 0.8571, Slow),
        ("kind = 'sphere'\nframes = 856", 8.016, Sharp),
        ("kind = 'sphere'\nframes = 100", 23.454, Sharp),
    ] {
        let poses: Vec<_> = walk(recipe).iter().map(|pose| pose.world_from_camera).collect();
        let rotation = path::rotation_of(&poses).unwrap();
        // To the digits given here.
        assert!((rotation.to_degrees() - degrees).abs() < 1e-3, "{recipe}: {}", rotation.to_degrees());
        assert_eq!(grade_of(rotation), grade, "{recipe}");
    }
}

#[test]
fn motion_chooses_the_frames_for_the_grade() {
    let square = "waypoints = [{position_m = [4, 0, 0]}, {position_m = [0, 4, 0.2]}, {position_m = [-4, 0, 0]}, \
                  {position_m = [0, -4, 0]}]\nclosed = true";
    for (kind, rest) in [
        ("wave", ""),
        ("sphere", "radius_m = 1"),
        ("sphere", "turns = 5.0"),
        ("corridor", ""),
        ("figure-eight", ""),
        ("figure-eight", "shape = 'bernoulli'\nlook = { target_m = [0, 10, 0] }"),
        ("waypoints", square),
    ] {
        for grade in [MotionGrade::Slow, MotionGrade::Medium, MotionGrade::Sharp] {
            if kind == "sphere" && !rest.contains("turns") && grade == MotionGrade::Slow {
                // 220 thousand frames: right, but long to walk without optimisation.
                continue;
            }
            let poses = walk(&format!("kind = '{kind}'\nmotion = '{}'\n{rest}", grade.name()));
            let poses: Vec<_> = poses.iter().map(|pose| pose.world_from_camera).collect();
            let part = path::rotation_of(&poses).unwrap() / grade.rotation_rad();
            // One frame more or less of the fewest, 36, is 3 %; beside the corners of a median as much again.
            assert!((part - 1.0).abs() < 0.1, "{kind} {rest} {grade:?}: {part} with {} frames", poses.len());
        }
    }
    let frames = |recipe: &str| walk(recipe).len();
    assert_eq!(frames("kind = 'wave'\nmotion = 'slow'"), 720);
    assert_eq!(frames("kind = 'corridor'\nmotion = 'medium'"), 360);
}

#[test]
fn stamps_begin_at_zero_and_are_those_of_the_rate() {
    let wave = trajectory("kind = 'wave'\nframes = 31");
    let stamps = |rate: f64| -> Vec<i64> {
        wave.poses(rate, 0, FilePath::new("")).unwrap().iter().map(|pose| pose.stamp_nanos).collect()
    };
    assert_eq!(
        [0, 1, 2, 3, 30].map(|n| stamps(30.0)[n]),
        [0, 33_333_333, 66_666_667, 100_000_000, 1_000_000_000]
    );
    assert_eq!(stamps(0.01)[30], 3_000_000_000_000);
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e7, 1e-3] {
        assert!(matches!(wave.poses(rate, 0, FilePath::new("")), Err(Error::Value { .. })), "{rate}");
    }
}
