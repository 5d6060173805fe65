use super::*;
use std::io::Write;
use zip::write::{SimpleFileOptions, ZipWriter};

const SEEN: &[u8] = b"MappointFrameAsso: 0 0 1 2\n";

fn zip(path: &Path, files: &[(&str, &[u8])]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut writer = ZipWriter::new(fs::File::create(path).unwrap());
    for (name, bytes) in files {
        writer.start_file(*name, SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap();
}

fn text(path: PathBuf, bytes: &[u8]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn find(path: &Path) -> Result<Discovery, Error> {
    discover(&[path.to_owned()], &Limits::default())
}

fn names(discovery: &Discovery) -> Vec<&str> {
    discovery.sequences.iter().map(|sequence| sequence.name.as_str()).collect()
}

#[test]
fn a_dataset_folder_gives_its_sequences_and_variants_sorted() {
    let root = tempfile::tempdir().unwrap();
    let at = |path: &str| root.path().join(path);
    zip(&at("far/observation_v2.zip"), &[("observation_v2/association.txt", SEEN)]);
    zip(&at("far/baseline_v2.zip"), &[("baseline_v2/venom_sequence.txt", SEEN)]);
    zip(&at("far/observation.zip"), &[("observation/association.txt", SEEN)]);
    zip(&at("far/baseline.zip"), &[("baseline/venom_sequence.txt", SEEN)]);
    zip(&at("living/baseline.zip"), &[("venom_sequence.txt", SEEN)]);
    text(at("box/observation/observation/camera_poses.txt"), b"0 0 0 0 0 0 0 1");
    text(at("README.txt"), b"hello");
    let found = find(root.path()).unwrap();
    assert_eq!(names(&found), ["box", "far", "far_v2", "living"]);
    let second = &found.sequences[2];
    assert_eq!(second.variant.as_deref(), Some("v2"));
    assert_eq!(second.observation().unwrap().label, "observation_v2.zip");
    assert_eq!(second.baseline().unwrap().folder, "baseline_v2");
    assert!(found.sequences[3].observation().is_none());
    assert_eq!(found.sequences[0].parts[0].label, "observation/observation");
    assert_eq!(found.passed_over.count_of("unrecognised-file"), 1, "README.txt");
}

#[test]
fn a_lone_archive_is_named_by_its_folder() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("box7/observation.zip");
    zip(&path, &[("association.txt", SEEN)]);
    let found = find(&path).unwrap();
    assert_eq!(names(&found), ["box7"]);
    assert_eq!(found.sequences[0].parts.len(), 1);
}

#[test]
fn an_archive_may_hold_a_whole_sequence_or_several() {
    let root = tempfile::tempdir().unwrap();
    let whole = root.path().join("box7.zip");
    zip(&whole, &[("observation/association.txt", SEEN), ("baseline/venom_sequence.txt", SEEN)]);
    let found = find(&whole).unwrap();
    assert_eq!(names(&found), ["box7"]);
    assert_eq!(found.sequences[0].observation().unwrap().folder, "observation");
    assert_eq!(found.sequences[0].baseline().unwrap().folder, "baseline");

    let several = root.path().join("all.zip");
    zip(
        &several,
        &[("r/b/observation/association.txt", SEEN), ("r/a/association.txt", SEEN), ("r/inner.zip", b"PK")],
    );
    let found = find(&several).unwrap();
    assert_eq!(names(&found), ["a", "b"]);
    assert_eq!(found.passed_over.count_of("nested-archive"), 1);
}

#[test]
fn a_merged_folder_and_unknown_names_are_recognised() {
    let root = tempfile::tempdir().unwrap();
    text(root.path().join("mine/association.txt"), SEEN);
    text(root.path().join("mine/venom_sequence.txt"), SEEN);
    text(root.path().join("other/whatever.txt"), SEEN);
    let found = find(root.path()).unwrap();
    assert_eq!(names(&found), ["mine", "other"]);
    assert_eq!(found.sequences[0].parts[0].role, Role::Untold);
}

#[test]
fn other_datasets_are_no_sequences() {
    let root = tempfile::tempdir().unwrap();
    text(root.path().join("groundtruth.txt"), b"# timestamp tx ty tz qx qy qz qw\n1.5 0 0 0 0 0 0 1\n");
    text(root.path().join("rgb.txt"), b"1.5 rgb/1.5.png\n");
    text(root.path().join("association.txt"), b"1.5 rgb/1.5.png 1.5 depth/1.5.png\n");
    let error = find(root.path()).unwrap_err();
    assert!(matches!(error, Error::NothingFound { .. }), "{error}");
    assert!(error.to_string().contains("expected association.txt"), "{error}");
}

#[test]
fn wrong_paths_are_told_apart() {
    let root = tempfile::tempdir().unwrap();
    let missing = find(&root.path().join("nowhere")).unwrap_err();
    assert!(matches!(missing, Error::Missing { .. }), "{missing}");
    let file = root.path().join("association.txt");
    text(file.clone(), SEEN);
    let error = find(&file).unwrap_err();
    assert!(matches!(error, Error::NotAnArchive { .. }), "{error}");
    text(root.path().join("x/observation.zip"), b"PK\x03\x04 and no more");
    let broken = find(&root.path().join("x/observation.zip")).unwrap_err();
    assert!(matches!(broken, Error::Archive { .. }), "{broken}");
}

#[test]
fn a_broken_archive_does_not_hide_the_other_sequences() {
    let root = tempfile::tempdir().unwrap();
    text(root.path().join("bad/observation.zip"), b"PK\x03\x04 and no more");
    zip(&root.path().join("good/observation.zip"), &[("association.txt", SEEN)]);
    let found = find(root.path()).unwrap();
    assert_eq!(names(&found), ["bad", "good"]);
    let error = crate::text_release::read(&found.sequences[0], &Limits::default()).unwrap_err();
    assert!(matches!(error, Error::Archive { .. }), "{error}");
    assert!(crate::text_release::read(&found.sequences[1], &Limits::default()).is_ok());
}

#[test]
fn two_sequences_of_one_name_are_refused_and_one_given_twice_is_one() {
    let root = tempfile::tempdir().unwrap();
    zip(&root.path().join("a/box/observation.zip"), &[("association.txt", SEEN)]);
    zip(&root.path().join("b/box/observation.zip"), &[("association.txt", SEEN)]);
    let error = find(root.path()).unwrap_err();
    assert!(matches!(&error, Error::SameName { name, .. } if name == "box"), "{error}");
    let one = root.path().join("a");
    let found =
        discover(&[one.clone(), one.join("box"), one.join("box/observation.zip")], &Limits::default());
    assert_eq!(found.unwrap().sequences[0].parts.len(), 1);
}

#[test]
#[cfg(unix)]
fn links_in_circles_end() {
    let root = tempfile::tempdir().unwrap();
    zip(&root.path().join("box/observation.zip"), &[("association.txt", SEEN)]);
    std::os::unix::fs::symlink(root.path(), root.path().join("box/up")).unwrap();
    assert_eq!(names(&find(root.path()).unwrap()), ["box"]);
}
