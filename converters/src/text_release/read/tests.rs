use super::*;
use crate::text_release::discover::discover;
use std::fs;
use std::io::Write;
use std::path::Path;
use zip::write::{SimpleFileOptions, ZipWriter};

const SEEN: &str = "MappointFrameAsso: 0 0 1 2\n";
const POSE: &str = "0 1 2 3 0 0 0 1\n";

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = root.path().join("box7").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    root
}

fn read_one(root: &Path) -> TextSequence {
    let found = discover(&[root.join("box7")], &Limits::default()).unwrap();
    assert_eq!(found.sequences.len(), 1);
    read(&found.sequences[0], &Limits::default()).unwrap()
}

#[test]
fn every_file_finds_its_part() {
    let root = folder(&[
        ("observation/association.txt", SEEN),
        ("observation/camera_poses.txt", POSE),
        ("observation/point_landmarks.txt", "0 1 2 3"),
        ("observation/line_landmarks_refined.txt", "0 1 2 3 4 5 6"),
        ("observation/structline_landmarks.txt", "1 1 2 3 4 5 6"),
        ("baseline/Venom-Sequence.txt", "Vertex: 0 0 0 0 0 0 0 1\nMappointFrameAsso: 0 0 9 9\n"),
        ("baseline/Frame-to-Frame.txt", POSE),
        ("baseline/estimated_localmap.txt", POSE),
        ("baseline/Point-BA.txt", POSE),
        ("baseline/PointLine_BA.txt", POSE),
        ("baseline/Point_Mappoint.txt", "Mappoint:0 1 2 3"),
        ("baseline/PointLine_mappoint.txt", "Mappoint:0 1 2 3"),
        ("baseline/PointLine_mapline.txt", "Mapline:0 1 2 3 4 5 6"),
        ("baseline/ground_pose.txt", POSE),
        ("baseline/ground_truth.txt", POSE),
        ("baseline/system_parameter.txt", "The settings: \nframe_num_:1\n"),
    ]);
    let sequence = read_one(root.path());
    assert_eq!(sequence.problems, super::super::Problems::default());
    assert_eq!((sequence.name.as_str(), &sequence.variant), ("box7", &None));
    assert_eq!(sequence.ground_truth.unwrap().file, "observation/camera_poses.txt");
    assert_eq!(sequence.point_landmarks.unwrap().points.len(), 1);
    let lines: Vec<_> = sequence.line_landmarks.iter().map(|file| file.segments[0].id).collect();
    assert_eq!(lines, [0, 1], "both files are kept, sorted");
    assert!((sequence.association.unwrap().rows.point_observations[0].u - 1.0).abs() < f64::EPSILON);
    assert_eq!(sequence.graph.unwrap().rows.vertices[0].rows.len(), 1);
    let estimates: Vec<_> = sequence.trajectories.iter().map(|file| file.estimate.as_str()).collect();
    assert_eq!(estimates, ["frame-to-frame", "map-to-frame", "point-ba", "pointline-ba"]);
    let maps: Vec<_> =
        sequence.maps.iter().map(|map| (map.points.len(), map.lines.len(), map.files.len())).collect();
    assert_eq!(maps, [(1, 0, 1), (1, 1, 2)]);
    assert_eq!(sequence.repeated_ground_truth.len(), 2);
    assert_eq!(sequence.system_parameter, [("frame_num_".to_owned(), "1".to_owned())]);
    assert_eq!(sequence.provenance.len(), 16);
    assert!(sequence.provenance.is_sorted_by(|a, b| a.name < b.name));
}

#[test]
fn merged_and_renamed_files_still_find_their_part() {
    let root = folder(&[("association.txt", SEEN), ("venom_sequence.txt", SEEN), ("camera_poses.txt", POSE)]);
    let merged = read_one(root.path());
    assert_eq!(merged.association.unwrap().file, "association.txt");
    assert_eq!(merged.graph.unwrap().file, "venom_sequence.txt");

    let root = folder(&[("baseline/initial.txt", SEEN), ("observation/seen.txt", SEEN)]);
    let renamed = read_one(root.path());
    assert_eq!(renamed.association.unwrap().file, "observation/seen.txt");
    assert_eq!(renamed.graph.unwrap().file, "baseline/initial.txt");
    assert!(renamed.problems.is_empty());
}

#[test]
fn nothing_is_dropped_without_a_word() {
    let root = folder(&[
        ("association.txt", SEEN),
        ("camera_poses.txt", "0 1 2 3 0 0 0 1\nMappoint: 1 2 3 4\n"),
        ("point_landmarks.txt", "\n"),
        ("notes.txt", "remember the milk"),
        ("again.txt", SEEN),
        ("yet_again.txt", SEEN),
        ("picture.png", "PNG"),
    ]);
    let sequence = read_one(root.path());
    let told: Vec<_> = sequence
        .problems
        .listed()
        .iter()
        .map(|problem| format!("{} {:?} {}", problem.file, problem.line, problem.kind.name()))
        .collect();
    assert_eq!(
        told,
        [
            "camera_poses.txt Some(2) misplaced-tag",
            "point_landmarks.txt None nothing-usable",
            "notes.txt None unrecognised-file",
            "picture.png None unrecognised-file",
            "yet_again.txt None repeated-file",
        ]
    );
    assert_eq!(sequence.graph.unwrap().file, "again.txt", "what the folder lacked");
    assert!(sequence.point_landmarks.is_none());
}

#[test]
fn an_archive_goes_before_its_unpacked_copy() {
    let root = folder(&[
        ("observation/association.txt", "MappointFrameAsso: 5 5 5 5\n"),
        ("observation/camera_poses.txt", POSE),
    ]);
    let path = root.path().join("box7/observation.zip");
    let mut writer = ZipWriter::new(fs::File::create(&path).unwrap());
    writer.start_file("observation/association.txt", SimpleFileOptions::default()).unwrap();
    writer.write_all(SEEN.as_bytes()).unwrap();
    writer.finish().unwrap();
    let sequence = read_one(root.path());
    assert_eq!(sequence.association.unwrap().file, "observation.zip/observation/association.txt");
    assert_eq!(
        sequence.ground_truth.unwrap().file,
        "observation/camera_poses.txt",
        "the copy fills what is missing"
    );
    assert_eq!(sequence.problems.count_of("repeated-file"), 1);
    let names: Vec<_> = sequence.provenance.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["observation.zip", "observation/camera_poses.txt"]);
    assert_eq!(sequence.provenance[0].bytes, fs::metadata(path).unwrap().len());
}

#[test]
fn a_sequence_over_the_limit_is_an_error() {
    let root = folder(&[("association.txt", SEEN)]);
    let found = discover(&[root.path().join("box7")], &Limits::default()).unwrap();
    let limits = Limits { file_bytes: SEEN.len() as u64 - 1, ..Limits::default() };
    let error = read(&found.sequences[0], &limits).unwrap_err();
    assert!(matches!(error, Error::FileTooLarge { .. }), "{error}");
}
