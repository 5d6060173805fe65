//! The program `os` as a user meets it: results, messages, exit codes.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use open_structure::format::{self, WriteOptions};
use open_structure::structure::{
    Camera, CameraId, Frame, FrameId, PointId, PointLandmark, PointMeasurement, PoseRow, Sequence,
    TrajectoryPose, registry,
};

fn os(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A camera that looks along z at a row of points and moves to the right.
fn sample() -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "sample".to_owned();
    let projection = open_structure::geometry::PinholeCamera {
        fx: 500.0,
        fy: 500.0,
        cx: 320.0,
        cy: 240.0,
        width: 640,
        height: 480,
    };
    sequence.manifest.cameras = vec![Camera::pinhole(CameraId(0), &projection, registry::PIXEL_CENTER)];
    for id in 0..20_i32 {
        let pose =
            PoseRow { translation: [0.01 * f64::from(id), 0.0, 0.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        let frame_id = FrameId(i64::from(id));
        sequence.frames.push(Frame::new(frame_id, i64::from(id) * 33_000_000, CameraId(0), Some(pose)));
        sequence.trajectories.push(TrajectoryPose::new("map-to-frame".to_owned(), frame_id, pose));
        for point in 0..10_i32 {
            let x = 0.1 * f64::from(point) - 0.01 * f64::from(id);
            sequence.point_measurements.push(PointMeasurement {
                frame_id,
                point_id: PointId(i64::from(point)),
                u: 500.0 * x / 2.0 + 320.0,
                v: 240.0,
                depth: (point % 2 == 0).then_some(2.0),
            });
        }
    }
    for point in 0..10_i32 {
        let position = nalgebra::Point3::new(0.1 * f64::from(point), 0.0, 2.0);
        sequence.point_landmarks.push(PointLandmark::new(PointId(i64::from(point)), position));
    }
    sequence
}

/// The sample in both encodings.
fn samples(folder: &Path) -> [PathBuf; 2] {
    let paths = [folder.join("sample.mcap"), folder.join("sample")];
    for path in &paths {
        format::write(path, &sample(), WriteOptions::default()).unwrap();
    }
    paths
}

#[test]
fn info_shows_tables_and_is_readable_by_machines() {
    let folder = tempfile::tempdir().unwrap();
    for path in samples(folder.path()) {
        let output = os(&["info", text(&path)]);
        assert!(output.status.success(), "{}", stderr(&output));
        let shown = stdout(&output);
        for expected in
            ["sample", "pinhole 640x480", "20, 0.6 s at 30.3 Hz", "map-to-frame", "point_measurements"]
        {
            assert!(shown.contains(expected), "{expected} is not in\n{shown}");
        }
        let json: serde_json::Value =
            serde_json::from_str(&stdout(&os(&["info", "--json", text(&path)]))).unwrap();
        assert_eq!(json["frame_count"], 20);
        assert_eq!(json["tables"]["point_measurements"], 200);
        assert_eq!(json["manifest"]["cameras"][0]["fx"], 500.0);
    }
}

#[test]
fn rows_satisfy_their_schema_in_both_encodings() {
    let folder = tempfile::tempdir().unwrap();
    for path in samples(folder.path()) {
        for table in ["frames", "point_measurements", "trajectories", "point_landmarks"] {
            let schema = serde_json::from_str(&stdout(&os(&["schema", table]))).unwrap();
            let validator = jsonschema::validator_for(&schema).unwrap();
            let rows = stdout(&os(&["cat", text(&path), table]));
            assert!(!rows.is_empty());
            for row in rows.lines() {
                let row = serde_json::from_str(row).unwrap();
                assert!(validator.is_valid(&row), "{table}: {row}");
            }
        }
    }
}

#[test]
fn cat_gives_one_frame_as_csv_with_absent_values_empty() {
    let folder = tempfile::tempdir().unwrap();
    for path in samples(folder.path()) {
        let output = os(&[
            "cat",
            text(&path),
            "point_measurements",
            "--frame",
            "3",
            "--format",
            "csv",
            "--limit",
            "2",
        ]);
        let depthless = "3,1,337.5,240.0,";
        assert_eq!(
            stdout(&output),
            format!("frame_id,point_id,u,v,depth\n3,0,312.5,240.0,2.0\n{depthless}\n")
        );
        assert_eq!(os(&["cat", text(&path), "point_measurements", "--frame", "99"]).status.code(), Some(1));
    }
}

#[test]
fn copies_keep_every_digest_and_never_overwrite_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, parquet] = samples(folder.path());
    for (from, to) in [(&mcap, folder.path().join("copy")), (&parquet, folder.path().join("copy.mcap"))] {
        assert!(os(&["copy", text(from), "-o", text(&to)]).status.success());
        assert_eq!(format::open(&to).unwrap().manifest(), format::open(from).unwrap().manifest());
        let refused = os(&["copy", text(from), "-o", text(&to)]);
        assert_eq!(refused.status.code(), Some(1));
        assert!(stderr(&refused).contains("--force"), "{}", stderr(&refused));
        assert!(os(&["copy", text(from), "-o", text(&to), "--force"]).status.success());
    }
    let itself = os(&["copy", text(&parquet), "-o", text(&parquet), "--force"]);
    assert_eq!(itself.status.code(), Some(1));
    assert!(format::read(&parquet).is_ok(), "the input was destroyed");
    assert_eq!(
        os(&["copy", text(&parquet), "-o", text(&folder.path().join("x")), "--foxglove"]).status.code(),
        Some(1)
    );
    let left: Vec<_> =
        std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| !name.to_string_lossy().contains("partial")), "{left:?}");
}

#[test]
fn wrong_input_is_named_with_what_was_expected() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("notes.txt");
    std::fs::write(&file, "not a sequence").unwrap();
    let missing = folder.path().join("missing.mcap");
    for (arguments, code, expected) in [
        (vec!["info", text(&missing)], 1, "No such file"),
        (vec!["info", text(&file)], 1, "not an Open-Structure sequence"),
        (vec!["info", text(folder.path())], 1, "sequence.json"),
        (vec!["cat", text(&file), "point_measurement"], 1, "point_measurements"),
        (vec!["frobnicate"], 2, "unrecognized subcommand"),
        (vec!["cat"], 2, "required"),
    ] {
        let output = os(&arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = samples(folder.path());
    let mut child = Command::new(env!("CARGO_BIN_EXE_os"))
        .args(["cat", text(&mcap), "point_measurements"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(stderr(&output), "");
}

#[test]
fn shells_and_man_get_their_pages() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(stdout(&os(&["completions", shell])).contains("validate"), "{shell}");
    }
    let folder = tempfile::tempdir().unwrap();
    assert!(os(&["man", "-o", text(folder.path())]).status.success());
    for page in ["os.1", "os-validate.1", "os-cat.1"] {
        assert!(folder.path().join(page).is_file(), "{page}");
    }
}

#[test]
fn convert_hands_over_or_says_what_is_missing() {
    let beside = Path::new(env!("CARGO_BIN_EXE_os")).with_file_name("os-convert");
    let output = os(&["convert", "--help"]);
    if beside.is_file() {
        assert!(output.status.success());
        assert!(stdout(&output).contains("open-structure"), "{}", stdout(&output));
    } else {
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("os-convert"), "{}", stderr(&output));
    }
}

#[test]
fn validate_and_explain_speak_of_the_same_rules() {
    let folder = tempfile::tempdir().unwrap();
    for path in samples(folder.path()) {
        let good = os(&["validate", text(&path)]);
        assert_eq!(good.status.code(), Some(0), "{}{}", stdout(&good), stderr(&good));
    }
    let mut bad = sample();
    bad.frames[4].world_from_camera_qw = None;
    let path = folder.path().join("bad.mcap");
    format::write(&path, &bad, WriteOptions::default()).unwrap();
    let output = os(&["validate", text(&path)]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stdout(&output).contains("pose-whole"), "{}", stdout(&output));
    let schema = serde_json::from_str(&stdout(&os(&["schema", "validation_report"]))).unwrap();
    let report = serde_json::from_str(&stdout(&os(&["validate", "--json", text(&path)]))).unwrap();
    assert!(jsonschema::validator_for(&schema).unwrap().is_valid(&report), "{report}");
    assert!(stdout(&os(&["explain", "pose-whole"])).contains("seven"));
    assert_eq!(os(&["explain", "no-such-rule"]).status.code(), Some(1));
    // Noise is not declared, which is a warning.
    let path = folder.path().join("sample");
    assert_eq!(os(&["validate", "--deny", "warnings", text(&path)]).status.code(), Some(3));
    assert_eq!(os(&["validate", text(&folder.path().join("none"))]).status.code(), Some(1));
}
