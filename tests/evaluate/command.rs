//! `os evaluate` as a user meets it.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector6};
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::structure::{
    Camera, CameraId, Frame, FrameId, LineId, LineLandmark, MapLine, MapPoint, PointId, PointLandmark,
    PoseRow, ResultValues, Sequence, TrajectoryPose, registry,
};
use serde_json::Value;

use super::{os, stderr, stdout};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn true_pose(id: i64) -> Pose {
    let t = id as f64;
    let [x, y] = [(0.3 * t).cos(), (0.3 * t).sin()];
    Pose::exp(&Vector6::new(0.0, 0.1 * t, 0.02 * t, 0.0, 0.0, 0.0))
        * Pose::from_components([x, y, 0.1 * t], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

fn estimated(name: &str, id: i64, pose: &Pose) -> TrajectoryPose {
    TrajectoryPose::new(name.to_owned(), FrameId(id), PoseRow::from(pose))
}

fn map_point(name: &str, id: i64, at: Point3<f64>) -> MapPoint {
    MapPoint { estimate: name.to_owned(), point_id: PointId(id), x: at.x, y: at.y, z: at.z, covariance: None }
}

fn map_line(name: &str, id: i64, line: &Segment) -> MapLine {
    let (start, end) = (line.start, line.end);
    MapLine {
        estimate: name.to_owned(),
        line_id: LineId(id),
        start_x: start.x,
        start_y: start.y,
        start_z: start.z,
        end_x: end.x,
        end_y: end.y,
        end_z: end.z,
        covariance: None,
    }
}

/// A sequence with truth and estimates: `moved`, exact but elsewhere; `partial`, 1 cm off in every second frame and with
/// frames missing; `single`, one pose; `map-only`, a map without a path.
fn sample(name: &str) -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = name.to_owned();
    let projection = PinholeCamera { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };
    sequence.manifest.cameras = vec![Camera::pinhole(CameraId(0), &projection, registry::PIXEL_CENTER)];
    let elsewhere = Pose::exp(&Vector6::new(0.4, -2.0, 1.0, 5.0, 6.0, -7.0));
    for id in 0..20 {
        let pose = true_pose(id);
        let row = PoseRow::from(&pose);
        sequence.frames.push(Frame::new(FrameId(id), id * 50_000_000, CameraId(0), Some(row)));
        sequence.trajectories.push(estimated("moved", id, &(elsewhere * pose)));
        if id < 14 {
            let off = if id % 2 == 0 { 0.01 } else { -0.01 };
            let off = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, off, 0.0, 0.0));
            sequence.trajectories.push(estimated("partial", id, &(off * pose)));
        }
    }
    sequence.trajectories.push(estimated("single", 3, &true_pose(3)));
    for id in 0..5 {
        let at = Point3::new(id as f64, 1.0, -(id as f64) * 0.5);
        sequence.point_landmarks.push(PointLandmark::new(PointId(id), at));
        if id > 0 {
            sequence.map_points.push(map_point("moved", id, elsewhere * at));
        }
        sequence.map_points.push(map_point("map-only", id, at + nalgebra::Vector3::new(0.0, 0.03, 0.04)));
        let line = Segment { start: at, end: at + nalgebra::Vector3::new(0.0, 2.0, 1.0) };
        sequence.line_landmarks.push(LineLandmark::from_segment(LineId(id), &line).unwrap());
        sequence.map_lines.push(map_line("moved", id, &line.transformed(&elsewhere)));
    }
    sequence.sort();
    sequence
}

fn written(folder: &Path, name: &str, sequence: &Sequence) -> PathBuf {
    let path = folder.join(name);
    format::write(&path, sequence, WriteOptions::default()).unwrap();
    path
}

fn rows(arguments: &[&str]) -> Vec<Value> {
    let output = os(arguments);
    assert!([Some(0), Some(3)].contains(&output.status.code()), "{}", stderr(&output));
    stdout(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn each_estimate_gets_a_line_and_what_cannot_be_compared_is_a_finding() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "sample.mcap", &sample("sample"));
    let output = os(&["evaluate", text(&path)]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let shown = stdout(&output);
    for name in ["moved", "partial", "single", "map-only", "SE(3)", "1 frame"] {
        assert!(shown.contains(name), "{name}: {shown}");
    }
    assert!(stderr(&output).contains("single: alignment needs positions"), "{}", stderr(&output));
    assert!(!stderr(&output).contains("map-only"), "{}", stderr(&output));

    let found = rows(&["evaluate", text(&path), "--json"]);
    let row = |name: &str| found.iter().find(|row| row["estimate"] == name).unwrap();
    let number = |name: &str, column: &str| row(name)[column].as_f64().unwrap();
    // Rounding of coordinates up to ten metres.
    assert!(number("moved", "ape_translation_max_m") < 1e-13);
    assert!(number("moved", "ape_rotation_max_rad") < 1e-13);
    assert!(
        number("moved", "point_distance_max_m") < 1e-13 && number("moved", "line_distance_max_m") < 1e-13
    );
    assert!((number("moved", "line_overlap_mean") - 1.0).abs() < 1e-13);
    assert_eq!((number("moved", "points_matched"), number("moved", "points_missing")), (4.0, 1.0));
    assert_eq!((number("partial", "poses_matched"), number("partial", "poses_missing")), (14.0, 6.0));
    assert!((number("map-only", "point_distance_rmse_m") - 0.05).abs() < 1e-15);
    assert!(row("single")["ape_translation_rmse_m"].is_null());
    assert!(row("single")["why_not"].as_str().unwrap().contains("line"));

    let partial = &rows(&["evaluate", text(&path), "--json", "--estimate", "partial", "--align", "none"])[0];
    assert!((partial["ape_translation_rmse_m"].as_f64().unwrap() - 0.01).abs() < 1e-15);
    assert!((partial["rpe_translation_rmse_m"].as_f64().unwrap() - 0.02).abs() < 1e-15);
}

#[test]
fn an_estimate_may_be_the_reference_and_truth_is_not_needed_then() {
    let folder = tempfile::tempdir().unwrap();
    let mut blind = sample("blind");
    for frame in &mut blind.frames {
        *frame = Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    let path = written(folder.path(), "blind", &blind);
    let output = os(&["evaluate", text(&path)]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("--reference NAME"), "{}", stderr(&output));
    let found = rows(&["evaluate", text(&path), "--reference", "moved", "--estimate", "partial", "--json"]);
    // A centimetre to and fro along one axis, less what alignment takes away.
    let rmse = found[0]["ape_translation_rmse_m"].as_f64().unwrap();
    assert!((0.008..0.0101).contains(&rmse), "{rmse}");
    assert_eq!(found[0]["reference"], "moved");
}

#[test]
fn several_sequences_make_one_table_in_every_form() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["one", "two"].map(|name| written(folder.path(), name, &sample(name)));
    let both = [text(&paths[0]), text(&paths[1])];
    let shown = |arguments: &[&str]| {
        let all =
            [&["evaluate", both[0], both[1], "--estimate", "moved", "--estimate", "partial"], arguments]
                .concat();
        let output = os(&all);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stdout(&output)
    };
    let csv = shown(&["--csv"]);
    assert_eq!(csv.lines().count(), 5);
    assert!(csv.starts_with("sequence,estimate,reference,"), "{csv}");
    let markdown = shown(&["--markdown"]);
    assert_eq!(
        markdown.lines().filter(|line| line.starts_with("| one |") || line.starts_with("| two |")).count(),
        4
    );
    assert_eq!(shown(&["--json"]).lines().count(), 4);
    let statistics = shown(&["--relation", "trans", "--relation", "angle-deg"]);
    // A header, two metrics of two relations of two estimates of two sequences, and what was aligned.
    assert_eq!(statistics.lines().count(), 1 + 16 + 2, "{statistics}");
}

#[test]
fn errors_of_frames_come_back_from_their_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "sample", &sample("sample"));
    let errors = folder.path().join("errors.parquet");
    let arguments =
        ["evaluate", text(&path), "--estimate", "partial", "--align", "none", "--per-frame", text(&errors)];
    assert_eq!(os(&arguments).status.code(), Some(0));
    let table = format::read_results(&errors).unwrap();
    assert_eq!(table.rows(), 14);
    let column = |name: &str| &table.columns.iter().find(|column| column.name == name).unwrap().values;
    let ResultValues::Number(found) = column("ape_translation_m") else { panic!("numbers") };
    assert!(found.iter().flatten().all(|error| (error - 0.01).abs() < 1e-15));
    let ResultValues::Integer(stamps) = column("stamp_nanos") else { panic!("whole numbers") };
    assert_eq!(stamps[13], Some(650_000_000));
    let again = os(&arguments);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("errors.parquet"), "{}", stderr(&again));
    assert_eq!(os(&[&arguments[..], &["--force"]].concat()).status.code(), Some(0));
}

#[test]
fn a_plot_is_a_picture_of_one_sequence() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "sample", &sample("sample"));
    let plot = folder.path().join("plot.svg");
    let output = os(&["evaluate", text(&path), "--save-plot", text(&plot)]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let picture = fs::read_to_string(&plot).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("partial") && !picture.contains("NaN"));
    let output = os(&["evaluate", text(&path), text(&path), "--save-plot", text(&plot), "--force"]);
    assert_eq!(output.status.code(), Some(1));
    let output = os(&["evaluate", text(&path), "--save-plot", text(&folder.path().join("plot.png"))]);
    assert!(stderr(&output).contains(".svg"), "{}", stderr(&output));
}

#[test]
fn archives_for_evo_hold_what_was_printed() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "sample", &sample("sample"));
    let [absolute, relative] = ["ape.zip", "rpe.zip"].map(|name| folder.path().join(name));
    let arguments = [
        "evaluate",
        text(&path),
        "--save-results",
        text(&absolute),
        "--save-relative-results",
        text(&relative),
    ];
    let output = os(&arguments);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("--estimate NAME"), "{}", stderr(&output));
    let output = os(&[&arguments[..], &["--estimate", "partial", "-r", "trans", "--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let row: Value = serde_json::from_str(&stdout(&output)).unwrap();
    for (archive, column, count) in
        [(absolute, "ape_translation_rmse_m", 14), (relative, "rpe_translation_rmse_m", 13)]
    {
        let mut archive = zip::ZipArchive::new(fs::File::open(archive).unwrap()).unwrap();
        let stats: Value = serde_json::from_reader(archive.by_name("stats.json").unwrap()).unwrap();
        assert_eq!(stats["rmse"], row[column]);
        let info: Value = serde_json::from_reader(archive.by_name("info.json").unwrap()).unwrap();
        assert_eq!(info["est_name"], "partial");
        for name in ["error_array", "timestamps", "seconds_from_start", "distances", "distances_from_start"] {
            let member = archive.by_name(&format!("{name}.npy")).unwrap();
            let numbers: Vec<f64> = npyz::NpyFile::new(member).unwrap().into_vec().unwrap();
            assert_eq!(numbers.len(), count, "{name}");
        }
    }
}

#[test]
fn files_of_all_formats_meet_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let lines = |line: &dyn Fn(i64, [f64; 7]) -> String, ids: &[i64]| -> String {
        ids.iter().map(|id| line(*id, PoseRow::from(&true_pose(*id)).numbers())).collect()
    };
    let tum = |id: i64, [x, y, z, i, j, k, w]: [f64; 7]| format!("{}.25 {x} {y} {z} {i} {j} {k} {w}\n", id);
    let euroc =
        |id: i64, [x, y, z, i, j, k, w]: [f64; 7]| format!("{id}254000000,{x},{y},{z},{w},{i},{j},{k}\n");
    let kitti = |id: i64, _: [f64; 7]| {
        let (rotation, translation) = (true_pose(id).rotation_matrix(), true_pose(id).translation());
        let row = |row: usize| {
            format!(
                "{} {} {} {}",
                rotation[(row, 0)],
                rotation[(row, 1)],
                rotation[(row, 2)],
                translation[row]
            )
        };
        format!("{} {} {}\n", row(0), row(1), row(2))
    };
    let all: Vec<i64> = (1..12).collect();
    let write = |name: &str, content: String| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    let reference = write("reference.txt", lines(&tum, &all));
    let other = write("estimate.csv", lines(&euroc, &[2, 3, 5, 7, 11]));
    let plain = write("kitti.txt", lines(&kitti, &all));
    let found = rows(&["evaluate", "--files", text(&reference), text(&other), text(&other), "--json"]);
    assert_eq!(found.len(), 2);
    // Seventeen digits of text, and a rotation.
    assert!(found[0]["ape_translation_max_m"].as_f64().unwrap() < 1e-15);
    assert_eq!((found[0]["poses_matched"].as_i64(), found[0]["poses_missing"].as_i64()), (Some(5), Some(6)));
    let found = rows(&["evaluate", "--files", text(&plain), text(&plain), "--json", "-a"]);
    assert!(found[0]["ape_rotation_max_rad"].as_f64().unwrap() < 1e-14);

    let far = ["evaluate", "--files", text(&reference), text(&other), "--t_max_diff", "0.001"];
    let output = os(&far);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("found none among 11"), "{}", stderr(&output));
    let found = rows(&[&far[..], &["--t_offset", "-0.004", "--json"]].concat());
    assert_eq!(found[0]["poses_matched"], 5);
    // On a line no rotation can be found, but what moved by how much can.
    let straight: String = (0..5).map(|x| format!("{x} {x} 0 0 0 0 0 1\n")).collect();
    let straight = write("straight.txt", straight);
    let output = os(&["evaluate", "--files", text(&straight), text(&straight), "-a", "--json"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("alignment needs positions"), "{}", stderr(&output));
    let row: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert!(row["ape_translation_rmse_m"].is_null());
    assert_eq!(row["rpe_translation_rmse_m"], 0.0);
    for (arguments, expected) in [
        (vec![text(&reference), text(&plain)], "stamps in both files"),
        (vec![text(&reference), "/nowhere"], "No such file"),
        (vec![text(&plain), text(&write("short.txt", lines(&kitti, &[1, 2])))], "expected 11 poses"),
        (vec![text(&reference), text(&write("nan.txt", "1 nan 0 0 0 0 0 1\n".to_owned()))], "finite"),
        (
            vec![text(&reference), text(&write("same.txt", "1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n".to_owned()))],
            "after",
        ),
        (vec![text(&reference), text(&other), "-d", "0"], "frames"),
        (vec![text(&reference), text(&other), "--rpe-delta=-1", "-u", "m"], "0 m or more"),
    ] {
        let output = os(&[&["evaluate", "--files"], &arguments[..]].concat());
        let code = output.status.code();
        assert!(code == Some(1) || code == Some(3), "{arguments:?}: {code:?} {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
        assert!(!stderr(&output).contains("panicked"));
    }
}

#[test]
fn what_is_misused_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "sample", &sample("sample"));
    for (arguments, code, expected) in [
        (vec!["evaluate"], 2, "required"),
        (vec!["evaluate", text(&path), "--align", "sideways"], 2, "invalid value"),
        (vec!["evaluate", text(&path), "--estimate", "nobody"], 1, "map-only, moved, partial, single"),
        (vec!["evaluate", text(&path), "--estimate", "single"], 1, "none of 1"),
        (vec!["evaluate", text(&path), "--json", "--csv"], 2, "cannot be used"),
    ] {
        let output = os(&arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
    }
    let mut twice = sample("twice");
    let first = twice.trajectories[0].clone();
    twice.trajectories.insert(0, first);
    let path = folder.path().join("twice");
    if format::write(&path, &twice, WriteOptions::default()).is_ok() {
        let output = os(&["evaluate", text(&path)]);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("twice"), "{}", stderr(&output));
    }
}
