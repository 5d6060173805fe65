//! A camera that goes twice round a wall of points and lines.

use nalgebra::{Point3, Vector6};
use proptest::strategy::{Strategy, ValueTree};

use super::*;
use crate::geometry::{PinholeCamera, Pose, Segment};
use crate::structure::{
    Camera, CameraId, Estimate, FactorGraph, FrameId, GroupId, LineId, LineMeasurement, MapLine, MapPoint,
    MeasuredFrame, MeasurementNoise, PointId, PointMeasurement, PoseRow, StructuralGroup, TrajectoryPose,
    registry,
};

const FRAMES: usize = 80;
const ROUND: usize = 40;

fn camera() -> PinholeCamera {
    PinholeCamera { fx: 500.0, fy: -480.0, cx: 320.0, cy: 240.0, width: 640, height: 480 }
}

/// The camera looks outwards from the middle and turns; the second round sees what the first saw.
fn pose(frame: usize) -> Pose {
    let angle = std::f64::consts::TAU * (frame % ROUND) as f64 / ROUND as f64;
    let tangent = Vector6::new(0.0, angle, 0.0, 0.0, 0.0, 0.0);
    Pose::new(Pose::exp(&tangent).rotation(), [0.3 * angle.sin(), 0.02 * frame as f64, 0.1].into())
}

fn points() -> Vec<Point3<f64>> {
    let place = |index: usize| {
        let angle = 2.399_963 * index as f64;
        let height = -1.5 + 3.0 * (index % 17) as f64 / 16.0;
        let far = 4.0 + (index % 5) as f64 * 0.4;
        Point3::new(far * angle.sin(), height, far * angle.cos())
    };
    (0..300).map(place).collect()
}

fn lines() -> Vec<Segment> {
    let place = |index: usize| {
        let angle = 0.7 * index as f64;
        let start = Point3::new(5.0 * angle.sin(), -1.0, 5.0 * angle.cos());
        Segment { start, end: Point3::new(start.x, 1.0, start.z) }
    };
    (0..9).map(place).collect()
}

struct World {
    frames: Vec<MeasuredFrame>,
    estimate: Estimate,
    cameras: Vec<Camera>,
    groups: Vec<StructuralGroup>,
}

fn world() -> World {
    let seen = |pose: &Pose, point: &Point3<f64>| {
        let inside = pose.inverse() * *point;
        camera().project(inside).filter(|pixel| camera().contains(*pixel, 0.0)).map(|pixel| (pixel, inside.z))
    };
    let (all_points, all_lines) = (points(), lines());
    let frames = (0..FRAMES)
        .map(|frame| {
            let frame_id = FrameId(frame as i64);
            let pose = pose(frame);
            let points = all_points.iter().enumerate().filter_map(|(id, point)| {
                let (pixel, depth) = seen(&pose, point)?;
                let point_id = PointId(id as i64);
                Some(PointMeasurement { frame_id, point_id, u: pixel.x, v: pixel.y, depth: Some(depth) })
            });
            let lines = all_lines.iter().enumerate().filter_map(|(id, line)| {
                let ((start, near), (end, far)) = seen(&pose, &line.start).zip(seen(&pose, &line.end))?;
                Some(LineMeasurement {
                    frame_id,
                    line_id: LineId(id as i64),
                    start_u: start.x,
                    start_v: start.y,
                    start_depth: Some(near),
                    end_u: end.x,
                    end_v: end.y,
                    end_depth: Some(far),
                })
            });
            MeasuredFrame {
                frame_id,
                stamp_nanos: frame as i64,
                camera_id: CameraId(0),
                points: points.collect(),
                lines: lines.collect(),
            }
        })
        .collect();
    let name = "truth".to_owned();
    let estimate = Estimate {
        name: name.clone(),
        trajectory: (0..FRAMES)
            .map(|frame| {
                TrajectoryPose::new(name.clone(), FrameId(frame as i64), PoseRow::from(&pose(frame)))
            })
            .collect(),
        points: points()
            .iter()
            .enumerate()
            .map(|(id, at)| MapPoint {
                estimate: name.clone(),
                point_id: PointId(id as i64),
                x: at.x,
                y: at.y,
                z: at.z,
                covariance: None,
            })
            .collect(),
        lines: lines()
            .iter()
            .enumerate()
            .map(|(id, line)| MapLine {
                estimate: name.clone(),
                line_id: LineId(id as i64),
                start_x: line.start.x,
                start_y: line.start.y,
                start_z: line.start.z,
                end_x: line.end.x,
                end_y: line.end.y,
                end_z: line.end.z,
                covariance: None,
            })
            .collect(),
        ..Estimate::default()
    };
    let group = StructuralGroup {
        group_id: GroupId(4),
        kind: registry::PARALLEL.to_owned(),
        line_ids: (0..9).map(LineId).collect(),
        ..StructuralGroup::default()
    };
    let cameras = vec![Camera::pinhole(CameraId(0), &camera(), registry::PIXEL_CENTER)];
    World { frames, estimate, cameras, groups: vec![group] }
}

fn reprojection(world: &World, options: &GraphOptions) -> (FactorGraph, GraphSummary) {
    let noise = MeasurementNoise::default();
    reprojection_graph(&world.frames, &world.estimate, &world.cameras, noise, &world.groups, options).unwrap()
}

#[test]
fn every_measurement_of_a_landmark_of_the_map_is_a_factor() {
    let world = world();
    let (graph, summary) = reprojection(&world, &GraphOptions { least_views: 1, ..GraphOptions::default() });
    let measured: usize = world.frames.iter().map(|frame| frame.points.len()).sum();
    assert_eq!((summary.poses, summary.point_factors), (FRAMES, measured));
    assert_eq!(
        graph.factors.len(),
        summary.point_factors + summary.line_factors + summary.parallelism_factors
    );
    assert_eq!(summary.parallelism_factors, graph.lines.len());
    assert_eq!(graph.poses.iter().filter(|pose| pose.fixed).count(), 1);
    assert!(graph.poses[0].fixed);
    for factor in &graph.factors {
        let shape = registry::factor_shape(&factor.kind).unwrap();
        assert!(shape.sizes.iter().any(|size| size.measurement == factor.measurement.len()), "{factor:?}");
        assert_eq!(shape.columns.contains(&"frame_id"), factor.frame_id.is_some());
    }
    let ids: Vec<i64> = graph.factors.iter().map(|factor| factor.factor_id).collect();
    assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn landmarks_that_few_frames_see_are_left_out_and_counted() {
    let world = world();
    let all = reprojection(&world, &GraphOptions { least_views: 1, ..GraphOptions::default() }).1;
    let some = reprojection(&world, &GraphOptions { least_views: 14, ..GraphOptions::default() }).1;
    assert!(some.points < all.points);
    let left = (all.points - some.points) + (all.lines - some.lines);
    assert_eq!(some.landmarks_with_few_views, left);
    let mut without = world;
    without.estimate.points.truncate(100);
    without.estimate.trajectory.remove(3);
    let summary = reprojection(&without, &GraphOptions::default()).1;
    assert_eq!((summary.poses, summary.frames_without_pose), (FRAMES - 1, 1));
    assert!(summary.landmarks_not_in_map > 0 && summary.points <= 100);
}

#[test]
fn key_frames_are_first_last_and_where_the_view_changed() {
    let world = world();
    let rule = KeyFrameRule { most_shared: 0.5, longest_gap: 1000 };
    let options = GraphOptions { key_frames: Some(rule), ..GraphOptions::default() };
    let (graph, summary) = reprojection(&world, &options);
    let kept: Vec<usize> = graph.poses.iter().map(|pose| pose.frame_id.0 as usize).collect();
    assert!(kept.len() > 4 && kept.len() < FRAMES / 2, "{kept:?}");
    assert_eq!((kept[0], *kept.last().unwrap()), (0, FRAMES - 1));
    assert_eq!(summary.frames_left_out, FRAMES - kept.len());
    for pair in kept.windows(2) {
        let [before, last] = [&world.frames[pair[0]], &world.frames[pair[1] - 1]];
        let had = before.points.len() + before.lines.len();
        // The frame before the next key frame still shared enough.
        assert!(pair[1] - pair[0] == 1 || key_frames::shared(before, last) as f64 > 0.5 * had as f64);
    }
}

#[test]
fn frames_that_are_measured_again_close_loops_with_exact_relative_poses() {
    let world = world();
    let options = GraphOptions::default();
    let noise = MeasurementNoise::default();
    let (graph, summary) =
        pose_graph(&world.frames, &world.estimate, &world.cameras, noise, &options, 0).unwrap();
    assert_eq!((summary.neighbours, summary.guessed), (FRAMES - 1, 0));
    assert!(summary.loops >= 2, "{summary:?}");
    let mut closed = 0;
    for factor in &graph.factors {
        let (frame, other) = (factor.frame_id.unwrap().0, factor.other_frame_id.unwrap().0);
        let expected = pose(frame as usize).inverse() * pose(other as usize);
        let numbers: [f64; 7] = factor.measurement.clone().try_into().unwrap();
        let found = PoseRow::from_numbers(numbers).pose().unwrap();
        // Rounding of pixels of 1e3 px over 500 px of focal length, at 5 m.
        let error = (found * expected.inverse()).log().norm();
        assert!(error < 1e-8, "{frame} from {other}: {error}");
        closed += usize::from(frame - other >= 30);
        assert_eq!(factor.information.as_ref().unwrap().len(), 21);
    }
    assert_eq!(closed, summary.loops);
    let without = GraphOptions { loops: None, ..options };
    let summary = pose_graph(&world.frames, &world.estimate, &world.cameras, noise, &without, 0).unwrap().1;
    assert_eq!(summary.loops, 0);
}

#[test]
fn relative_poses_are_as_accurate_as_they_say() {
    let world = world();
    let noise = MeasurementNoise::default();
    let (frame, other) = (&world.frames[3], &world.frames[1]);
    let truth = pose(3).inverse() * pose(1);
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let normal = (0.0..1.0_f64, 0.0..1.0_f64)
        .prop_map(|(a, b)| (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos());
    let mut draw = || normal.new_tree(&mut runner).unwrap().current();
    let mut sum = 0.0;
    const RUNS: usize = 200;
    for _ in 0..RUNS {
        let mut noisy = [frame.clone(), other.clone()];
        for row in noisy.iter_mut().flat_map(|frame| &mut frame.points) {
            row.u += draw();
            row.v += draw();
            row.depth = row.depth.map(|depth| depth + 0.05 * draw());
        }
        for frame in &mut noisy {
            frame.lines.clear();
        }
        let found = relative_pose((&noisy[0], &camera()), (&noisy[1], &camera()), &noise, None, 1).unwrap();
        let error = (found.frame_from_other * truth.inverse()).log();
        sum += (error.transpose() * found.information * error)[0];
    }
    // The mean of a chi-square of 6 degrees of freedom; Cauchy's weights make the stated information up to a quarter less.
    let mean = sum / RUNS as f64;
    assert!((3.5..8.0).contains(&mean), "{mean}");
}

#[test]
fn what_leaves_a_relative_pose_open_gives_none() {
    let world = world();
    let noise = MeasurementNoise::default();
    let opposite = (&world.frames[ROUND / 2], &camera());
    assert_eq!(relative_pose((&world.frames[0], &camera()), opposite, &noise, None, 0), None);
    let mut blind = world.frames[1].clone();
    blind.points.iter_mut().for_each(|row| row.depth = None);
    blind.lines.clear();
    assert_eq!(relative_pose((&world.frames[0], &camera()), (&blind, &camera()), &noise, None, 0), None);
    let monocular = noise.monocular();
    let seen = (&world.frames[1], &camera());
    assert_eq!(relative_pose((&world.frames[0], &camera()), seen, &monocular, None, 0), None);
}

#[test]
fn options_and_estimates_that_make_no_graph_are_refused() {
    let world = world();
    let refused = |world: &World, options: &GraphOptions| {
        let noise = MeasurementNoise::default();
        reprojection_graph(&world.frames, &world.estimate, &world.cameras, noise, &[], options).unwrap_err()
    };
    let options = GraphOptions { least_views: 0, ..GraphOptions::default() };
    assert!(matches!(refused(&world, &options), Error::Option { option: "least_views", .. }));
    let rule = KeyFrameRule { most_shared: f64::NAN, longest_gap: 3 };
    let options = GraphOptions { key_frames: Some(rule), ..GraphOptions::default() };
    assert!(matches!(refused(&world, &options), Error::Option { option: "most_shared", .. }));
    let mut other = World { estimate: Estimate::default(), ..world };
    assert!(matches!(refused(&other, &GraphOptions::default()), Error::NoPoses { .. }));
    other.estimate = self::world().estimate;
    other.cameras.clear();
    assert!(matches!(refused(&other, &GraphOptions::default()), Error::Camera { .. }));
    other.estimate.trajectory[2].world_from_camera_qw = f64::NAN;
    other.cameras = self::world().cameras;
    assert!(matches!(refused(&other, &GraphOptions::default()), Error::Pose { frame_id: FrameId(2), .. }));
}
