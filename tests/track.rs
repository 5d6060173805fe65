//! Trackers as a user meets them: exact without noise, sound with it, unmoved by what is wrong.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::path::Path;
use std::process::{Command, Output};

use nalgebra::{Matrix3, Matrix6, Point3, Rotation3, UnitQuaternion, Vector3};
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::structure::*;
use open_structure::track::{Method, Sensor, TrackOptions, track};

const FRAMES: i64 = 60;
const SIGMA_DEPTH_M: f64 = 0.05;

/// `SplitMix64`, and from it numbers close to normal.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A camera on an arc round points and lines; `fy` is negative, as ICL-NUIM has it.
fn arc(noise: f64, seed: u64) -> Sequence {
    let camera = PinholeCamera { fx: 520.0, fy: -480.0, cx: 319.5, cy: 239.5, width: 640, height: 480 };
    let mut random = Random(seed);
    let mut place = |half: f64| Vector3::from_fn(|_, _| (random.uniform() - 0.5) * 2.0 * half);
    let points: Vec<Point3<f64>> = (0..90).map(|_| Point3::from(place(1.2))).collect();
    let lines: Vec<Segment> = (0..14)
        .map(|_| {
            let middle = Point3::from(place(0.8));
            let along = place(1.0).normalize() * 0.6;
            Segment { start: middle - along, end: middle + along }
        })
        .collect();
    let mut sequence = Sequence::default();
    sequence.manifest.name = "arc".to_owned();
    sequence.manifest.source.dataset = registry::SIMULATION.to_owned();
    sequence.manifest.cameras = vec![Camera::pinhole(CameraId(0), &camera, registry::PIXEL_CENTER)];
    let parameters = [("sigma_px".to_owned(), 1.0), ("sigma_depth_m".to_owned(), SIGMA_DEPTH_M)];
    sequence.manifest.noise = Some(Noise {
        model: registry::NOISE_GAUSSIAN.to_owned(),
        seed: Some(seed),
        parameters: parameters.into_iter().collect(),
    });
    for id in 0..FRAMES {
        let turn = 0.02 * id as f64;
        let centre = Vector3::new(5.0 * turn.sin(), 0.3 * (3.0 * turn).sin(), -5.0 * turn.cos());
        let forward = (Vector3::new(0.1, 0.0, 0.2) - centre).normalize();
        let right = Vector3::y().cross(&forward).normalize();
        let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let pose = Pose::new(rotation, centre);
        let camera_from_world = pose.inverse();
        let frame_id = FrameId(id);
        sequence.frames.push(Frame::new(frame_id, id * 33_333_333, CameraId(0), Some(PoseRow::from(&pose))));
        let mut seen = |point: Point3<f64>| {
            let in_camera = camera_from_world * point;
            let pixel = camera.project(in_camera).unwrap();
            let [u, v, depth] = [random.normal(), random.normal(), random.normal()];
            (pixel.x + noise * u, pixel.y + noise * v, Some(in_camera.z + noise * SIGMA_DEPTH_M * depth))
        };
        for (k, point) in (0..).zip(&points) {
            let (u, v, depth) = seen(*point);
            sequence.point_measurements.push(PointMeasurement {
                frame_id,
                point_id: PointId(k),
                u,
                v,
                depth,
            });
        }
        for (k, line) in (0..).zip(&lines) {
            let (start_u, start_v, start_depth) = seen(line.start);
            let (end_u, end_v, end_depth) = seen(line.end);
            let line_id = LineId(k);
            sequence.line_measurements.push(LineMeasurement {
                frame_id,
                line_id,
                start_u,
                start_v,
                start_depth,
                end_u,
                end_v,
                end_depth,
            });
        }
    }
    sequence
}

fn truth(sequence: &Sequence) -> Vec<Pose> {
    sequence.frames.iter().map(|frame| frame.world_from_camera().unwrap().pose().unwrap()).collect()
}

fn estimated(sequence: &Sequence, options: TrackOptions) -> Estimate {
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let first = truth(sequence)[0];
    let mut tracker = options.tracker(&sequence.manifest.cameras, noise, first).unwrap();
    track(&MeasuredFrame::of(sequence), "ours", tracker.as_mut(), &|_, _| {}).unwrap()
}

fn poses(estimate: &Estimate) -> Vec<Pose> {
    estimate.trajectory.iter().map(|row| row.world_from_camera().pose().unwrap()).collect()
}

/// Largest error of a pose, radians and metres together.
fn worst(estimate: &Estimate, sequence: &Sequence) -> f64 {
    let pairs = poses(estimate).into_iter().zip(truth(sequence));
    pairs.map(|(found, truth)| (found * truth.inverse()).log().norm()).fold(0.0, f64::max)
}

/// Root mean square distance of the camera centres, metres.
fn rms(estimate: &Estimate, sequence: &Sequence) -> f64 {
    let pairs = poses(estimate).into_iter().zip(truth(sequence));
    let squares = pairs.map(|(found, truth)| (found.translation() - truth.translation()).norm_squared());
    (squares.sum::<f64>() / FRAMES as f64).sqrt()
}

fn states<'a>(estimate: &'a Estimate, state: &str) -> Vec<&'a TrackedFrame> {
    estimate.tracking.iter().filter(|row| row.state == state).collect()
}

fn all_options() -> Vec<TrackOptions> {
    let mut all = Vec::new();
    for method in [Method::FrameToFrame, Method::MapToFrame] {
        for classic in [false, true] {
            for sensor in [Sensor::Rgbd, Sensor::Stereo { baseline_m: 0.1 }] {
                all.push(TrackOptions { method, classic, sensor, seed: 1 });
            }
        }
    }
    all
}

const ROBUST: TrackOptions =
    TrackOptions { method: Method::MapToFrame, classic: false, sensor: Sensor::Rgbd, seed: 0 };

#[test]
fn without_noise_every_tracker_gives_the_true_path_and_map() {
    let sequence = arc(0.0, 1);
    for options in all_options() {
        let estimate = estimated(&sequence, options);
        assert_eq!(states(&estimate, registry::GAUGE).len(), 1, "{options:?}");
        assert_eq!(states(&estimate, registry::TRACKED).len(), FRAMES as usize - 1, "{options:?}");
        // Rounding; EPnP's eigenvectors lose a few more digits, and errors from frame to frame add up.
        let tolerance = if options.classic { 1e-7 } else { 1e-9 };
        assert!(worst(&estimate, &sequence) < tolerance, "{options:?}: {:e}", worst(&estimate, &sequence));
        assert_eq!((estimate.points.len(), estimate.lines.len()), (90, 14), "{options:?}");
    }
}

#[test]
fn noise_moves_the_path_by_what_the_covariance_says() {
    let (mut map, mut frame, mut ratio) = (0.0, 0.0, 0.0);
    let runs = 6;
    for seed in 0..runs {
        let sequence = arc(1.0, 10 + seed);
        let robust = estimated(&sequence, ROBUST);
        let by_frame = estimated(&sequence, TrackOptions { method: Method::FrameToFrame, ..ROBUST });
        map += rms(&robust, &sequence);
        frame += rms(&by_frame, &sequence);
        for estimate in [&robust, &by_frame] {
            let mean = estimate.tracking.iter().filter_map(|row| row.residual_rms).sum::<f64>();
            // Whitened residuals have the size 1; less what fitting takes and the gate cuts.
            let mean = mean / (FRAMES - 1) as f64;
            assert!((0.85..1.05).contains(&mean), "{mean}");
        }
        let last = by_frame.trajectory.last().unwrap();
        let numbers = last.covariance.clone().unwrap();
        let mut covariance = Matrix6::zeros();
        let places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
        for ((row, column), number) in places.zip(numbers) {
            covariance[(row, column)] = number;
            covariance[(column, row)] = number;
        }
        let error = (*truth(&sequence).last().unwrap() * poses(&by_frame).last().unwrap().inverse()).log();
        ratio += error.dot(&(covariance.try_inverse().unwrap() * error)) / 6.0;
    }
    // One to two centimetres for the map, and less than from frame to frame.
    assert!(map / (runs as f64) < 0.02, "{map}");
    assert!(map < frame, "{map} {frame}");
    // Chi-square of 36 numbers over 36: 1 ± 0.24 where all is known. Each measured depth enters two steps with opposite signs, which
    // the sum of their covariances does not know: it is on the safe side.
    let ratio = ratio / runs as f64;
    assert!((0.05..1.5).contains(&ratio), "{ratio}");
}

#[test]
fn the_robust_tracker_beats_the_classic_one() {
    let sequence = arc(1.0, 3);
    for method in [Method::FrameToFrame, Method::MapToFrame] {
        let robust = rms(&estimated(&sequence, TrackOptions { method, ..ROBUST }), &sequence);
        let classic = rms(&estimated(&sequence, TrackOptions { method, classic: true, ..ROBUST }), &sequence);
        assert!(robust < classic, "{method:?}: {robust} {classic}");
    }
}

#[test]
fn four_of_ten_wrong_measurements_hardly_move_the_path() {
    let clean = arc(1.0, 4);
    let mut wrong = clean.clone();
    let mut random = Random(5);
    let count = wrong.point_measurements.len();
    for row in 0..count {
        // The place of another landmark of the same frame.
        if random.uniform() < 0.4 {
            let other = (row + 1 + (random.uniform() * 80.0) as usize) % 90 + row / 90 * 90;
            let from = clean.point_measurements[other].clone();
            let to = &mut wrong.point_measurements[row];
            (to.u, to.v, to.depth) = (from.u, from.v, from.depth);
        }
    }
    for method in [Method::FrameToFrame, Method::MapToFrame] {
        let estimate = estimated(&wrong, TrackOptions { method, ..ROBUST });
        assert_eq!(states(&estimate, registry::TRACKED).len(), FRAMES as usize - 1);
        let limit = if method == Method::MapToFrame { 0.03 } else { 0.15 };
        assert!(rms(&estimate, &wrong) < limit, "{method:?}: {}", rms(&estimate, &wrong));
    }
    let estimate = estimated(&wrong, ROBUST);
    let agree: i64 = estimate.tracking[30..].iter().map(|row| row.point_inliers).sum();
    // Six of ten measurements are right.
    assert!((0.5..0.7).contains(&(agree as f64 / (90.0 * 30.0))), "{agree}");
}

#[test]
fn frames_without_measurements_are_predicted_and_the_path_found_again() {
    let whole = arc(1.0, 6);
    for gap in [0..3, 1..4, 30..38, 57..60] {
        let mut sequence = whole.clone();
        sequence.point_measurements.retain(|row| !gap.contains(&row.frame_id.0));
        sequence.line_measurements.retain(|row| !gap.contains(&row.frame_id.0));
        for options in [ROBUST, TrackOptions { classic: true, ..ROBUST }] {
            let estimate = estimated(&sequence, options);
            assert_eq!(estimate.trajectory.len(), FRAMES as usize);
            // Nothing joins the first frame to the others when it is empty: the first that is not gets a guess as well.
            let guessed = if gap.start == 0 { 3 } else { (gap.end - gap.start) as usize };
            assert_eq!(states(&estimate, registry::PREDICTED).len(), guessed, "{gap:?} {options:?}");
            let found = poses(&estimate);
            let true_poses = truth(&sequence);
            if gap.start == 30 {
                // Metres: eight frames along the arc, then the old landmarks again.
                assert!((found[37].translation() - true_poses[37].translation()).norm() < 0.4);
                assert!((found[45].translation() - true_poses[45].translation()).norm() < 0.05);
                assert!(found[34] != found[33]);
            }
        }
    }
}

#[test]
fn few_lines_and_points_without_depth_are_enough() {
    let mut sequence = arc(1.0, 7);
    for row in &mut sequence.point_measurements {
        row.depth = None;
    }
    let estimate = estimated(&sequence, ROBUST);
    assert_eq!(states(&estimate, registry::TRACKED).len(), FRAMES as usize - 1);
    assert_eq!(estimate.points.len(), 90);
    assert!(rms(&estimate, &sequence) < 0.1, "{}", rms(&estimate, &sequence));
    // Lines alone.
    sequence.point_measurements.clear();
    let estimate = estimated(&sequence, ROBUST);
    assert_eq!(states(&estimate, registry::TRACKED).len(), FRAMES as usize - 1);
    assert!(rms(&estimate, &sequence) < 0.1, "{}", rms(&estimate, &sequence));
}

#[test]
fn a_single_camera_finds_the_path_up_to_scale() {
    for (noise, tolerance) in [(0.0, 1e-6), (1.0, 0.1)] {
        let sequence = arc(noise, 8);
        let estimate = estimated(&sequence, TrackOptions { sensor: Sensor::Monocular, ..ROBUST });
        assert_eq!(states(&estimate, registry::TRACKED).len(), FRAMES as usize - 1);
        let (found, truth) = (poses(&estimate), truth(&sequence));
        let from_first = |poses: &[Pose], k: usize| poses[k].translation() - poses[0].translation();
        let last = FRAMES as usize - 1;
        let scale = from_first(&truth, last).norm() / from_first(&found, last).norm();
        for k in 0..FRAMES as usize {
            let error = (from_first(&found, k) * scale - from_first(&truth, k)).norm();
            // Metres of six; noise in the first two views bends what follows.
            assert!(error < tolerance * 5.0, "{noise} {k}: {error:e}");
        }
        // No depth was looked at.
        let mut blind = sequence.clone();
        for row in &mut blind.point_measurements {
            row.depth = row.depth.map(|depth| depth * 2.0);
        }
        assert_eq!(estimated(&blind, TrackOptions { sensor: Sensor::Monocular, ..ROBUST }), estimate);
    }
}

#[test]
fn numbers_that_are_no_measurements_are_passed_over() {
    let clean = arc(1.0, 9);
    let mut hostile = clean.clone();
    let bad = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300];
    for (k, row) in hostile.point_measurements.iter_mut().enumerate().filter(|(k, _)| k % 7 == 0) {
        match k % 3 {
            0 => row.depth = Some(bad[k % 5]),
            1 => row.u = bad[k % 5],
            _ => row.v = bad[(k + 2) % 5],
        }
    }
    for (k, row) in hostile.line_measurements.iter_mut().enumerate().filter(|(k, _)| k % 5 == 0) {
        row.start_depth = Some(bad[k % 4]);
        row.end_u = if k % 2 == 0 { row.start_u } else { row.end_u };
        row.end_v = if k % 2 == 0 { row.start_v } else { f64::NAN };
    }
    let again = hostile.point_measurements[..900].to_vec();
    hostile.point_measurements.extend(again);
    for options in all_options() {
        let estimate = estimated(&hostile, options);
        assert_eq!(estimate.trajectory.len(), FRAMES as usize);
        let finite = |row: &TrajectoryPose| row.world_from_camera().numbers().iter().all(|n| n.is_finite());
        assert!(estimate.trajectory.iter().all(finite), "{options:?}");
        if !options.classic {
            assert!(rms(&estimate, &hostile) < 0.15, "{options:?}: {}", rms(&estimate, &hostile));
        }
    }
    let _ = estimated(&hostile, TrackOptions { sensor: Sensor::Monocular, ..ROBUST });
}

#[test]
fn nothing_measured_is_no_error() {
    let mut empty = arc(0.0, 1);
    empty.point_measurements.clear();
    empty.line_measurements.clear();
    for options in all_options() {
        let estimate = estimated(&empty, options);
        assert_eq!(states(&estimate, registry::PREDICTED).len(), 30);
        assert_eq!(states(&estimate, registry::LOST).len(), FRAMES as usize - 31);
    }
    let noise = MeasurementNoise::default();
    let mut tracker = ROBUST.tracker(&[], noise, Pose::identity()).unwrap();
    assert_eq!(track(&[], "x", tracker.as_mut(), &|_, _| {}).unwrap().trajectory, []);
    let stranger = MeasuredFrame::default();
    assert!(track(&[stranger], "x", tracker.as_mut(), &|_, _| {}).is_err());
    let stereo = TrackOptions { sensor: Sensor::Stereo { baseline_m: 0.0 }, ..ROBUST };
    assert!(stereo.tracker(&empty.manifest.cameras, noise, Pose::identity()).is_err());
}

fn os(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn truth_changes_no_estimate() {
    let folder = tempfile::tempdir().unwrap();
    let whole = arc(1.0, 11);
    let mut blind = whole.clone();
    for frame in &mut blind.frames {
        *frame = Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    let first =
        whole.frames[0].world_from_camera().unwrap().numbers().map(|number| number.to_string()).join(",");
    let paths = ["whole", "blind", "whole-out", "blind-out.mcap"].map(|name| folder.path().join(name));
    format::write(&paths[0], &whole, WriteOptions::default()).unwrap();
    format::write(&paths[1], &blind, WriteOptions::default()).unwrap();
    for method in ["map-to-frame", "frame-to-frame"] {
        let given = os(&["track", text(&paths[0]), "-o", text(&paths[2]), "--method", method, "--force"]);
        assert_eq!(given.status.code(), Some(0), "{}", String::from_utf8_lossy(&given.stderr));
        let told =
            ["track", text(&paths[1]), "-o", text(&paths[3]), "--method", method, "--force", "--first-pose"];
        let told = os(&[&told[..], &[&first]].concat());
        assert_eq!(told.status.code(), Some(0), "{}", String::from_utf8_lossy(&told.stderr));
        let [given, told] =
            [&paths[2], &paths[3]].map(|path| Estimate::of(&format::read(path).unwrap(), method));
        assert_eq!(given.unwrap(), told.unwrap());
    }
}

#[test]
fn the_command_says_what_it_did_and_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let mut sequence = arc(1.0, 12);
    let paths = ["in.mcap", "out", "again", "gap", "empty"].map(|name| folder.path().join(name));
    format::write(&paths[0], &sequence, WriteOptions::default()).unwrap();
    let done = os(&["track", text(&paths[0]), "-o", text(&paths[1])]);
    let words = String::from_utf8(done.stdout).unwrap();
    assert_eq!(done.status.code(), Some(0));
    assert!(words.contains("59 tracked, 0 predicted, 0 lost; 90 points, 14 lines"), "{words}");
    let valid = os(&["validate", text(&paths[1])]);
    let words = String::from_utf8(valid.stdout).unwrap();
    assert!(!words.contains(" error "), "{words}");
    // The same name once more.
    let taken = os(&["track", text(&paths[1]), "-o", text(&paths[2])]);
    assert_eq!(taken.status.code(), Some(1));
    assert!(String::from_utf8(taken.stderr).unwrap().contains("--name"));
    let replaced = os(&["track", text(&paths[1]), "-o", text(&paths[2]), "--replace", "--json"]);
    assert_eq!(replaced.status.code(), Some(0));
    let said: serde_json::Value = serde_json::from_slice(&replaced.stdout).unwrap();
    assert_eq!((&said["tracked"], &said["sensor"]), (&59.into(), &"rgbd".into()));
    let [first, second] = [&paths[1], &paths[2]].map(|path| format::read(path).unwrap());
    assert_eq!(first.trajectories, second.trajectories);
    assert_eq!(first.point_measurements, second.point_measurements);
    // Predicted frames are findings.
    sequence.point_measurements.retain(|row| row.frame_id.0 < 50);
    sequence.line_measurements.retain(|row| row.frame_id.0 < 50);
    format::write(&paths[3], &sequence, WriteOptions::default()).unwrap();
    let gap = os(&["track", text(&paths[3]), "-o", text(&paths[1]), "--force"]);
    assert_eq!(gap.status.code(), Some(3), "{}", String::from_utf8_lossy(&gap.stderr));
    // Misused, and nothing to work on.
    let misused = os(&["track", text(&paths[0]), "-o", text(&paths[4]), "--sensor", "stereo"]);
    assert_eq!(misused.status.code(), Some(2));
    let misused = os(&["track", text(&paths[0]), "-o", text(&paths[4]), "--first-pose", "1,2,3"]);
    assert_eq!(misused.status.code(), Some(2));
    sequence.point_measurements.clear();
    sequence.line_measurements.clear();
    format::write(&paths[4], &sequence, WriteOptions::default()).unwrap();
    let nothing = os(&["track", text(&paths[4]), "-o", text(&paths[1]), "--force"]);
    assert_eq!(nothing.status.code(), Some(1));
}
