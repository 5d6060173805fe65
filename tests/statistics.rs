//! `os stats` held against counts made here, one pair at a time.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::process::{Command, Output};

use nalgebra::{Point3, UnitQuaternion, Vector3};
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::structure::{
    Camera, CameraId, Frame, FrameId, GroupId, LineId, LineObservation, PointId, PointMeasurement,
    PointObservation, PoseRow, Sequence, StructuralGroup, registry,
};
use serde_json::Value;

const CAMERA: PinholeCamera =
    PinholeCamera { fx: 500.0, fy: 480.0, cx: 319.5, cy: 239.5, width: 640, height: 480 };

fn os(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// A camera that goes round a grid of points; frame 4 sees nothing, and stamps are uneven.
fn sequence() -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "a, \"b\"".to_owned();
    sequence.manifest.cameras = vec![Camera::pinhole(CameraId(0), &CAMERA, registry::PIXEL_CENTER)];
    for id in 0..12_i32 {
        let turn = 0.05 * f64::from(id * id % 7);
        let rotation = UnitQuaternion::from_euler_angles(0.0, turn, 0.0);
        let pose = Pose::new(rotation, Vector3::new(0.1 * f64::from(id), 0.02, -3.0));
        let frame_id = FrameId(i64::from(id) * 3);
        let stamp = i64::from(id * id) * 10_000_000;
        sequence.frames.push(Frame::new(frame_id, stamp, CameraId(0), Some(PoseRow::from(&pose))));
        for point in 0..60_i32 {
            let place = Point3::new(0.15 * f64::from(point % 12) - 0.8, 0.2 * f64::from(point / 12), 0.3);
            let pixel = CAMERA.project(pose.inverse() * place).filter(|pixel| CAMERA.contains(*pixel, 0.0));
            let Some(pixel) = pixel.filter(|_| id != 4) else { continue };
            let point_id = PointId(i64::from(point));
            let (u, v) = (pixel.x, pixel.y);
            sequence.point_observations.push(PointObservation { frame_id, point_id, u, v, depth: Some(3.0) });
            if point % 5 != 0 {
                let (u, v) = (u + 0.5, v - 0.25);
                sequence.point_measurements.push(PointMeasurement {
                    frame_id,
                    point_id,
                    u,
                    v,
                    depth: Some(3.1),
                });
            }
        }
        for line in 0..3_i32 {
            sequence.line_observations.push(LineObservation {
                frame_id,
                line_id: LineId(i64::from(line)),
                start_u: 5.0 + f64::from(id),
                start_v: 12.0,
                end_u: 95.5,
                end_v: 12.0 + 30.0 * f64::from(line),
                ..LineObservation::default()
            });
        }
    }
    let line_ids = vec![LineId(0), LineId(2)];
    sequence.structural_groups =
        vec![StructuralGroup { group_id: GroupId(0), line_ids, ..StructuralGroup::default() }];
    sequence
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let half = numbers.len() / 2;
    if numbers.len() % 2 == 1 { numbers[half] } else { 0.5 * (numbers[half - 1] + numbers[half]) }
}

fn close(found: &Value, expected: f64) {
    let found = found.as_f64().unwrap();
    // The same sums in another order.
    assert!((found - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "{found}, expected {expected}");
}

#[test]
fn statistics_are_what_counting_by_hand_gives() {
    let sequence = sequence();
    let folder = tempfile::tempdir().unwrap();
    let schema: Value = serde_json::from_str(&stdout(&os(&["stats", "--schema"]))).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    for name in ["a.mcap", "a"] {
        let path = folder.path().join(name);
        format::write(&path, &sequence, WriteOptions::default()).unwrap();
        let found: Value =
            serde_json::from_str(&stdout(&os(&["stats", "--json", path.to_str().unwrap()]))).unwrap();
        assert!(validator.is_valid(&found), "{found}");

        let mut shown: BTreeMap<FrameId, BTreeSet<PointId>> =
            sequence.frames.iter().map(|frame| (frame.frame_id, BTreeSet::new())).collect();
        for row in &sequence.point_measurements {
            shown.get_mut(&row.frame_id).unwrap().insert(row.point_id);
        }
        let shown: Vec<BTreeSet<PointId>> = shown.into_values().collect();
        assert_eq!(found["frame_count"], 12);
        close(&found["duration_seconds"], 1.21);
        assert_eq!(found["points"]["table"], "point_measurements");
        assert_eq!(found["lines"]["table"], "line_observations");
        assert_eq!(found["points"]["rows"], sequence.point_measurements.len());
        close(
            &found["points"]["per_frame"]["median"],
            median(shown.iter().map(|ids| ids.len() as f64).collect()),
        );
        assert_eq!(found["points"]["per_frame"]["min"], 0.0);

        let mut tracks: BTreeMap<PointId, f64> = BTreeMap::new();
        shown.iter().flatten().for_each(|id| *tracks.entry(*id).or_default() += 1.0);
        assert_eq!(found["points"]["landmarks"], tracks.len());
        close(&found["points"]["track_length_frames"]["median"], median(tracks.into_values().collect()));
        let apart = &found["points"]["shared"][2];
        assert_eq!(apart["frames_apart"], 5);
        let shared = (0..7).map(|frame| shown[frame].intersection(&shown[frame + 5]).count() as f64);
        close(&apart["shared"]["mean"], shared.sum::<f64>() / 7.0);
        let covisible = (0..12).map(|frame| {
            let others = (0..12).filter(|other| *other != frame);
            others.filter(|other| shown[frame].intersection(&shown[*other]).count() >= 15).count() as f64
        });
        close(&found["covisible_frames"]["median"], median(covisible.collect()));

        let poses: Vec<Pose> =
            sequence.frames.iter().map(|frame| frame.world_from_camera().unwrap().pose().unwrap()).collect();
        let steps = poses.windows(2).map(|pair| (pair[1].translation() - pair[0].translation()).norm());
        close(&found["motion"]["path_length_m"], steps.sum());
        let angles = poses.windows(2).map(|pair| pair[0].rotation().angle_to(&pair[1].rotation()));
        close(&found["motion"]["rotation_rad"]["median"], median(angles.collect()));
        let mut rays: BTreeMap<PointId, Vec<Vector3<f64>>> = BTreeMap::new();
        for row in &sequence.point_measurements {
            let pose = &poses[usize::try_from(row.frame_id.0 / 3).unwrap()];
            let ray = CAMERA.ray(nalgebra::Point2::new(row.u, row.v));
            rays.entry(row.point_id).or_default().push(pose.transform_vector(&ray));
        }
        let widest = rays.values().map(|rays| {
            let pairs = rays.iter().flat_map(|one| rays.iter().map(|other| one.angle(other)));
            pairs.fold(0.0, f64::max)
        });
        let expected = median(widest.collect());
        let parallax = found["point_parallax_rad"]["median"].as_f64().unwrap();
        // A few rays are kept of each point, which may miss the widest pair by a little.
        assert!(parallax <= expected + 1e-9 && parallax > 0.98 * expected, "{parallax} of {expected}");

        assert_eq!(found["structural_constraints"]["max"], 1.0);
        assert_eq!(found["image_cells"], 64 * 48);
        close(&found["noise"]["point_px"]["mean"], 0.125);
        close(&found["noise"]["point_px"]["sigma"], 0.375);
        close(&found["noise"]["point_depth_m"]["mean"], 0.1);
        assert!(found["noise"].get("line_px").is_none());
    }
}

#[test]
fn frames_and_sequences_come_as_comma_separated_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    format::write(&path, &sequence(), WriteOptions::default()).unwrap();
    let path = path.to_str().unwrap();
    let frames = stdout(&os(&["stats", "--frames", "--csv", path]));
    let lines: Vec<&str> = frames.lines().collect();
    assert_eq!(lines.len(), 13);
    assert!(lines[0].starts_with("sequence,frame_id,point_count,"));
    assert!(lines[1].starts_with("\"a, \"\"b\"\"\",0,"));
    assert!(lines[1].ends_with(",,,,,"), "the first frame has none before it: {}", lines[1]);
    let columns = lines[0].split(',').count();
    assert!(lines[2..].iter().all(|line| line.split(',').count() == columns + 1), "the name has a comma");

    let all = stdout(&os(&["stats", "--csv", path, path]));
    let lines: Vec<&str> = all.lines().collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[1], lines[2]);
    assert!(
        lines[0].starts_with("name,") && lines[0].contains("points.shared.5.shared.median"),
        "{}",
        lines[0]
    );
}

#[test]
fn what_is_not_there_is_left_out() {
    let mut bare = sequence();
    for frame in &mut bare.frames {
        *frame = Frame::new(frame.frame_id, 0, frame.camera_id, None);
    }
    bare.point_measurements.clear();
    bare.line_observations.clear();
    let mut empty = Sequence::default();
    empty.manifest.name = "empty".to_owned();
    let folder = tempfile::tempdir().unwrap();
    for (name, sequence) in [("bare.mcap", &bare), ("bare", &bare), ("empty.mcap", &empty), ("empty", &empty)]
    {
        let path = folder.path().join(name);
        format::write(&path, sequence, WriteOptions::default()).unwrap();
        let path = path.to_str().unwrap();
        let found: Value = serde_json::from_str(&stdout(&os(&["stats", "--json", path]))).unwrap();
        assert!(found.get("motion").is_none() && found.get("point_parallax_rad").is_none());
        assert_eq!(found["points"]["table"], "point_observations");
        assert_eq!(found["lines"]["rows"], 0);
        for arguments in [vec!["stats", path], vec!["stats", path, path], vec!["stats", "--frames", path]] {
            let shown = stdout(&os(&arguments));
            assert!(!shown.contains("NaN") && !shown.contains("inf"), "{shown}");
        }
    }
}

#[test]
fn pictures_are_drawn_once_and_are_well_formed() {
    let folder = tempfile::tempdir().unwrap();
    let (path, output) = (folder.path().join("a & b"), folder.path().join("a.svg"));
    format::write(&path, &sequence(), WriteOptions::default()).unwrap();
    let (path, output) = (path.to_str().unwrap(), output.to_str().unwrap());
    for figure in ["scene", "statistics"] {
        let view = if figure == "scene" { &["--view", "top"][..] } else { &[] };
        stdout(&os(&[&["plot", path, "-o", output, "--figure", figure, "--force"], view].concat()));
        let text = std::fs::read_to_string(output).unwrap();
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"), "{text}");
        assert!(text.contains("of a &amp; b</title>"), "the name stands in the picture");
        // Every element is closed.
        assert_eq!(text.matches("<g ").count(), text.matches("</g>").count());
        assert_eq!(text.matches("<text ").count(), text.matches("</text>").count());
    }
    for (arguments, code, words) in [
        (vec!["plot", path, "-o", output], 1, "exists"),
        (vec!["plot", path, "-o", "a.gif"], 2, ".svg"),
        (vec!["plot", path, "-o", output, "--force", "--elevation", "91"], 1, "elevation"),
    ] {
        let failed = os(&arguments);
        assert_eq!(failed.status.code(), Some(code), "{arguments:?}");
        assert!(String::from_utf8_lossy(&failed.stderr).contains(words), "{arguments:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing is left behind");
}
