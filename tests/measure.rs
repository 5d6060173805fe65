//! `os measure` as a user meets it, and what it leaves in a sequence.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nalgebra::{Point3, UnitQuaternion, Vector3};
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::structure::*;

/// Models whose measurements are noisy.
const NOISY: [&str; 4] = ["gaussian", "first-release", "paper", "kinect-disparity"];
const CAMERA: PinholeCamera =
    PinholeCamera { fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 };

fn os(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).output().unwrap()
}

#[track_caller]
fn done(arguments: &[&str]) -> String {
    let output = os(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
    String::from_utf8(output.stdout).unwrap() + &stderr
}

#[track_caller]
fn refused(arguments: &[&str], code: i32) -> String {
    let output = os(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A camera on an arc round points and two groups of parallel lines, observed without noise.
fn observed() -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "arc".to_owned();
    sequence.manifest.source.dataset = registry::SIMULATION.to_owned();
    sequence.manifest.source.licence = Some("CC0-1.0".to_owned());
    sequence.manifest.source.citation = Some("none needed".to_owned());
    sequence.manifest.generator.tool = "by hand".to_owned();
    sequence.manifest.generator.seed = Some(5);
    sequence.manifest.cameras = vec![Camera::pinhole(CameraId(0), &CAMERA, registry::PIXEL_CENTER)];
    let spread = |index: i64, factor: f64| (index as f64 * factor).fract() - 0.5;
    for id in 0..50_i64 {
        let place = Point3::new(spread(id, 0.618), spread(id, 0.755), 5.0 + spread(id, 0.414));
        sequence.point_landmarks.push(PointLandmark::new(PointId(id), place));
    }
    for id in 0..12_i64 {
        let along = if id % 2 == 0 { Vector3::new(1.0, 0.1, 0.2) } else { Vector3::new(0.1, -1.0, 0.3) };
        let start = Point3::new(spread(id, 0.33), 0.4 - 0.06 * id as f64, 4.6 + 0.05 * id as f64);
        let segment = Segment { start, end: start + along };
        sequence.line_landmarks.push(LineLandmark::from_segment(LineId(id), &segment).unwrap());
    }
    for first in 0..2_i64 {
        let direction = sequence.line_landmarks[usize::try_from(first).unwrap()].plucker().direction;
        sequence.structural_groups.push(StructuralGroup {
            group_id: GroupId(first),
            kind: registry::PARALLEL.to_owned(),
            direction_x: Some(direction.x),
            direction_y: Some(direction.y),
            direction_z: Some(direction.z),
            line_ids: (first..12).step_by(2).map(LineId).collect(),
        });
    }
    for index in 0..60_i64 {
        let angle = 0.6 * (index as f64 / 60.0 - 0.5);
        let centre = Vector3::new(5.0 * angle.sin(), 0.1, 5.0 - 5.0 * angle.cos());
        let world_from_camera = Pose::new(UnitQuaternion::from_scaled_axis(Vector3::y() * -angle), centre);
        let (frame_id, pose) = (FrameId(index), PoseRow::from(&world_from_camera));
        sequence.frames.push(Frame::new(frame_id, index * 33_000_000, CameraId(0), Some(pose)));
        sequence.trajectories.push(TrajectoryPose::new("map-to-frame".to_owned(), frame_id, pose));
        let camera_from_world = world_from_camera.inverse();
        for landmark in &sequence.point_landmarks {
            let seen = camera_from_world * landmark.position();
            let pixel = CAMERA.project(seen).unwrap();
            let (point_id, depth) = (landmark.point_id, Some(seen.z));
            let row = PointObservation { frame_id, point_id, u: pixel.x, v: pixel.y, depth };
            sequence.point_observations.push(row);
        }
        for landmark in &sequence.line_landmarks {
            let ends = [landmark.segment().start, landmark.segment().end].map(|end| camera_from_world * end);
            let [start, end] = ends.map(|end| CAMERA.project(end).unwrap());
            sequence.line_observations.push(LineObservation {
                frame_id,
                line_id: landmark.line_id,
                start_u: start.x,
                start_v: start.y,
                start_depth: Some(ends[0].z),
                end_u: end.x,
                end_v: end.y,
                end_depth: Some(ends[1].z),
            });
        }
    }
    for id in 0..3 {
        let segment = sequence.line_landmarks[id].segment();
        for estimate in ["point-line-ba", "unrefined"] {
            sequence.map_lines.push(MapLine {
                estimate: estimate.to_owned(),
                line_id: LineId(id as i64),
                start_x: segment.start.x,
                start_y: segment.start.y,
                start_z: segment.start.z,
                end_x: segment.end.x,
                end_y: segment.end.y,
                end_z: segment.end.z,
                covariance: None,
            });
        }
    }
    sequence.point_correspondences = point_correspondences(&[], &sequence.point_observations);
    sequence.line_correspondences = line_correspondences(&[], &sequence.line_observations);
    sequence.frame_statistics = frame_statistics(&sequence);
    sequence.sort();
    sequence
}

/// The sequence in both encodings.
fn inputs(folder: &Path) -> [PathBuf; 2] {
    let paths = [folder.join("arc.mcap"), folder.join("arc")];
    for path in &paths {
        format::write(path, &observed(), WriteOptions::default()).unwrap();
    }
    paths
}

fn digests(path: &Path) -> BTreeMap<String, (u64, String)> {
    let manifest = format::open(path).unwrap().manifest().clone();
    manifest.tables.into_iter().map(|table| (table.table, (table.rows, table.sha256))).collect()
}

#[test]
fn every_model_makes_a_sequence_without_a_fault_from_either_encoding() {
    let folder = tempfile::tempdir().unwrap();
    let inputs = inputs(folder.path());
    for model in NOISY {
        let mut found = Vec::new();
        for (index, input) in inputs.iter().enumerate() {
            for name in [format!("{model}-{index}.mcap"), format!("{model}-{index}")] {
                let output = folder.path().join(name);
                let shown =
                    done(&["measure", text(input), "-o", text(&output), "--noise", model, "--seed", "3"]);
                assert!(shown.contains("3 000 of points and 720 of lines measured"), "{shown}");
                let report = os(&["validate", text(&output), "--deny", "warnings"]);
                assert_eq!(report.status.code(), Some(0), "{}", String::from_utf8_lossy(&report.stdout));
                found.push(digests(&output));
            }
        }
        assert_eq!(found[0]["point_measurements"].0, 3000);
        assert!(found.iter().all(|digests| *digests == found[0]), "{model}");
    }
}

#[test]
fn what_is_written_is_what_would_be_made_of_the_whole_sequence() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = inputs(folder.path());
    let output = folder.path().join("out");
    let options = ["--outliers", "0.1", "--missed", "0.2", "--quantise", "1", "--set", "sigma_px=0.5"];
    let seed = ["--noise", "kinect-disparity", "--seed", "18446744073709551615"];
    done(&[&["measure", text(&mcap), "-o", text(&output)], &options[..], &seed[..]].concat());
    let mut expected = observed();
    let found = format::read(&output).unwrap();
    assert!(found.point_measurements.len() < expected.point_observations.len());
    expected.point_measurements.clone_from(&found.point_measurements);
    expected.line_measurements.clone_from(&found.line_measurements);
    let (points, lines) = (&expected.point_measurements, &expected.line_measurements);
    assert_eq!(found.point_correspondences, point_correspondences(points, &expected.point_observations));
    assert_eq!(found.line_correspondences, line_correspondences(lines, &expected.line_observations));
    assert_eq!(found.frame_statistics, frame_statistics(&expected));
    assert_eq!(found.point_observations, expected.point_observations);
    assert_eq!(found.line_observations, expected.line_observations);
    assert_eq!(found.frames, expected.frames);
    assert_eq!(found.structural_groups, expected.structural_groups);
    let noise = found.manifest.noise.unwrap();
    assert_eq!((noise.model.as_str(), noise.seed), ("kinect-disparity", Some(u64::MAX)));
    for (name, value) in
        [("outlier_fraction", 0.1), ("missed_fraction", 0.2), ("quantisation_px", 1.0), ("sigma_px", 0.5)]
    {
        assert_eq!(noise.parameters[name], value);
    }
    let generator = found.manifest.generator;
    assert_eq!((generator.tool.as_str(), generator.seed), ("os measure", Some(u64::MAX)));
    assert_eq!(generator.parameters["from"], "by hand ");
    assert_eq!(generator.parameters["from_seed"], "5");
}

#[test]
fn many_seeds_give_the_files_that_each_seed_gives_alone() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = inputs(folder.path());
    let options = ["--noise", "paper", "--missed", "0.1"];
    for name in ["many.mcap", "many"] {
        let output = folder.path().join(name);
        done(&[&["measure", text(&mcap), "-o", text(&output), "--seeds", "3..5"], &options[..]].concat());
        assert!(!output.exists());
        for seed in ["3", "4", "5"] {
            let (stem, end) =
                name.split_once('.').map_or((name, String::new()), |(stem, end)| (stem, format!(".{end}")));
            let of_many = folder.path().join(format!("{stem}-{seed}{end}"));
            let alone = folder.path().join(format!("alone-{seed}{end}"));
            done(&[&["measure", text(&mcap), "-o", text(&alone), "--seed", seed], &options[..]].concat());
            assert_eq!(bytes(&of_many), bytes(&alone), "{name} {seed}");
        }
    }
}

#[test]
fn seeds_with_names_of_their_own_lie_in_one_collection() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = inputs(folder.path());
    let output = folder.path().join("all/any");
    let named = ["--noise", "gaussian", "--name", "a b"];
    done(&[&["measure", text(&mcap), "-o", text(&output), "--seeds", "0..1"], &named[..]].concat());
    done(&["index", text(&folder.path().join("all")), "--adopt"]);
    for seed in [0, 1] {
        let path = folder.path().join("all").join(format::folder_name(&format!("a b-{seed}")));
        assert_eq!(format::open(&path).unwrap().manifest().name, format!("a b-{seed}"));
    }
    for wrong in ["", " a", "a/b", "a\nb"] {
        let output = folder.path().join("wrong");
        let arguments = ["measure", text(&mcap), "-o", text(&output), "--noise", "gaussian", "--name", wrong];
        assert_eq!(os(&arguments).status.code(), Some(1), "{wrong:?}");
        assert!(!output.exists());
    }
}

/// The bytes of a file, or of every file of a folder.
fn bytes(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = match fs::read_dir(path) {
        Ok(entries) => entries.map(|entry| entry.unwrap().path()).collect(),
        Err(_) => return BTreeMap::from([(String::new(), fs::read(path).unwrap())]),
    };
    let files: Vec<PathBuf> = files;
    let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
    files.iter().map(|path| (name(path), fs::read(path).unwrap())).collect()
}

#[test]
fn measuring_again_replaces_what_was_measured_before() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = inputs(folder.path());
    let [once, twice, straight] =
        ["once.mcap", "twice.mcap", "straight.mcap"].map(|name| folder.path().join(name));
    done(&["measure", text(&mcap), "-o", text(&once), "--noise", "gaussian", "--missed", "0.5"]);
    done(&["measure", text(&once), "-o", text(&twice), "--noise", "paper", "--seed", "2"]);
    done(&["measure", text(&mcap), "-o", text(&straight), "--noise", "paper", "--seed", "2"]);
    assert_eq!(bytes(&twice), bytes(&straight));
}

#[test]
fn estimates_are_left_out_unless_told_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = inputs(folder.path());
    let [out, kept] = ["out", "kept"].map(|name| folder.path().join(name));
    let shown = done(&["measure", text(&mcap), "-o", text(&out), "--noise", "gaussian"]);
    assert!(
        shown.contains("note: made from other measurements and left out: trajectories, map_lines"),
        "{shown}"
    );
    let found = format::read(&out).unwrap();
    assert!(found.trajectories.is_empty());
    assert!(found.map_lines.len() == 3 && found.map_lines.iter().all(|row| row.estimate == "unrefined"));
    let shown = done(&["measure", text(&mcap), "-o", text(&kept), "--noise", "gaussian", "--keep-estimates"]);
    assert!(!shown.contains("note:"), "{shown}");
    let found = format::read(&kept).unwrap();
    assert_eq!((found.trajectories.len(), found.map_lines.len()), (60, 6));
}

#[test]
fn a_sequence_of_which_everything_is_missed_counts_its_observations() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, _] = inputs(folder.path());
    let output = folder.path().join("out");
    done(&["measure", text(&mcap), "-o", text(&output), "--noise", "gaussian", "--missed", "1"]);
    let found = format::read(&output).unwrap();
    assert!(found.point_measurements.is_empty() && found.line_measurements.is_empty());
    assert_eq!(found.frame_statistics, observed().frame_statistics);
    assert_eq!(os(&["validate", text(&output)]).status.code(), Some(0));
}

#[test]
fn nothing_is_overwritten_and_nothing_begun_that_cannot_end() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, parquet] = inputs(folder.path());
    let gaussian = ["--noise", "gaussian"];
    let measure = |input: &Path, output: &Path, more: &[&str]| {
        let arguments = [&["measure", text(input), "-o", text(output)], &gaussian[..], more].concat();
        refused(&arguments, 1)
    };
    assert!(measure(&mcap, &parquet, &[]).contains("exists already"));
    assert!(measure(&mcap, &mcap, &["--force"]).contains("is the input itself"));
    assert!(measure(&parquet.join("sequence.json"), &parquet, &["--force"]).contains("is the input itself"));
    assert!(measure(&mcap, folder.path(), &["--force"]).contains("holds it"));
    // The last of several stands in the way: none is made.
    fs::write(folder.path().join("many-2.mcap"), "mine").unwrap();
    let many = folder.path().join("many.mcap");
    assert!(measure(&mcap, &many, &["--seeds", "0..2"]).contains("many-2.mcap: exists already"));
    assert!(!folder.path().join("many-0.mcap").exists());
    let wrong = folder.path().join("wrong");
    assert!(
        measure(&mcap, &wrong, &["--set", "sigma_d=1"])
            .contains("noise.sigma_d: expected a parameter of the model gaussian")
    );
    assert!(
        measure(&mcap, &wrong, &["--outliers", "2"])
            .contains("noise.outlier_fraction: expected a number from 0 to 1")
    );
    let mut blind = observed();
    (blind.point_observations, blind.line_observations) = (Vec::new(), Vec::new());
    let blind_path = folder.path().join("blind");
    format::write(&blind_path, &blind, WriteOptions::default()).unwrap();
    assert!(measure(&blind_path, &wrong, &[]).contains("has no observations to measure"));
    for misuse in [["--seeds", "5..2"], ["--seeds", "0..1000"], ["--seeds", "0"], ["--set", "sigma_px"]] {
        refused(&[&["measure", text(&mcap), "-o", text(&wrong)], &gaussian[..], &misuse[..]].concat(), 2);
    }
    refused(&["measure", text(&mcap), "-o", text(&wrong), "--noise", "unheard"], 2);
    let mut names: Vec<_> =
        fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["arc", "arc.mcap", "blind", "many-2.mcap"]);
}

#[test]
fn measurements_without_observations_are_left_out_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let mut sequence = observed();
    sequence.line_measurements = sequence
        .line_observations
        .drain(..)
        .map(|row| LineMeasurement {
            frame_id: row.frame_id,
            line_id: row.line_id,
            start_u: row.start_u,
            start_v: row.start_v,
            start_depth: None,
            end_u: row.end_u,
            end_v: row.end_v,
            end_depth: None,
        })
        .collect();
    let [input, output] = ["in", "out"].map(|name| folder.path().join(name));
    format::write(&input, &sequence, WriteOptions::default()).unwrap();
    let warning = refused(&["measure", text(&input), "-o", text(&output), "--noise", "gaussian"], 3);
    assert!(warning.contains("warning: there are measurements of lines and no observations"), "{warning}");
    let found = format::read(&output).unwrap();
    assert_eq!((found.point_measurements.len(), found.line_measurements.len()), (3000, 0));
}
