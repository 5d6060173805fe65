//! Files: containers, encodings, promises of the manifest, and bytes that are nothing at all.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use tempfile::TempDir;

use super::*;
use crate::format::{WriteOptions, write};
use crate::validate::{Error, validate};

fn written(name: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write(&path, &good::sequence(), WriteOptions::default()).unwrap();
    (folder, path)
}

fn report(path: &Path) -> Report {
    validate(path, &Options::default()).unwrap()
}

#[track_caller]
fn only(rule: &str, path: &Path) -> Report {
    let report = report(path);
    assert_eq!(names(&report), BTreeSet::from([rule]), "{:#?}", report.findings);
    report
}

fn manifest(path: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let path = path.join("sequence.json");
    let mut value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(&mut value);
    fs::write(&path, serde_json::to_vec_pretty(&value).unwrap()).unwrap();
}

/// Replaces bytes of the same length.
fn replace(path: &Path, old: &[u8], new: &[u8]) {
    let mut bytes = fs::read(path).unwrap();
    let place = bytes.windows(old.len()).position(|window| window == old).unwrap();
    bytes[place..place + old.len()].copy_from_slice(new);
    fs::write(path, bytes).unwrap();
}

#[test]
fn both_encodings_of_a_good_sequence_break_no_rule() {
    for name in ["good.mcap", "good"] {
        let (_folder, path) = written(name);
        let report = report(&path);
        assert_eq!(report.rules, [], "{name}: {:#?} {:#?}", report.findings, report.advice);
        assert_eq!(report.sequence.as_deref(), Some("good"));
        assert_eq!(report.rows.len(), 16, "maps are not there");
    }
    let (_folder, path) = written("good");
    assert_eq!(report(&path.join("sequence.json")).rules, []);
}

#[test]
fn what_is_not_there_is_an_error_and_no_report() {
    let folder = tempfile::tempdir().unwrap();
    let missing = validate(&folder.path().join("missing.mcap"), &Options::default());
    assert!(matches!(missing, Err(Error::Io { .. })));
}

#[test]
fn what_is_no_sequence_is_not_readable() {
    let folder = tempfile::tempdir().unwrap();
    only("container-readable", folder.path());
    let text = folder.path().join("readme.txt");
    fs::write(&text, "hello").unwrap();
    only("container-readable", &text);
    fs::write(&text, "").unwrap();
    only("container-readable", &text);
}

#[test]
fn a_truncated_file_is_not_readable() {
    let (_folder, path) = written("good.mcap");
    let bytes = fs::read(&path).unwrap();
    for length in [9, 100, bytes.len() / 2, bytes.len() - 1] {
        fs::write(&path, &bytes[..length]).unwrap();
        let found = report(&path);
        assert!(found.breaks("container-readable"), "{length}: {:#?}", found.findings);
        assert!(!found.conformant);
    }
}

#[test]
fn a_wrong_checksum_is_found() {
    let (_folder, path) = written("good.mcap");
    let bytes = fs::read(&path).unwrap();
    // The summary's checksum stands before the closing magic bytes.
    let mut wrong = bytes.clone();
    let place = bytes.len() - 9;
    wrong[place] ^= 1;
    fs::write(&path, &wrong).unwrap();
    only("container-checksums", &path);
}

#[test]
fn a_profile_is_found() {
    // A header of the same length: profile and library change places.
    let (_folder, path) = written("good.mcap");
    let library = format!("open-structure {}", env!("CARGO_PKG_VERSION"));
    let length = u32::try_from(library.len()).unwrap().to_le_bytes();
    let old = [&0_u32.to_le_bytes()[..], &length, library.as_bytes()].concat();
    let new = [&length[..], library.as_bytes(), &0_u32.to_le_bytes()].concat();
    replace(&path, &old, &new);
    let found = report(&path);
    assert!(found.breaks("mcap-profile-empty"), "{:#?}", found.findings);
    // The data section's checksum is another matter; it is not always there.
    assert!(names(&found).is_subset(&BTreeSet::from(["mcap-profile-empty", "container-checksums"])));
}

#[test]
fn an_identity_that_is_not_the_manifests_is_found() {
    let (_folder, path) = written("good.mcap");
    replace(&path, b"\x04\0\0\0good", b"\x04\0\0\0evil");
    let found = report(&path);
    assert!(found.breaks("mcap-identity"), "{:#?}", found.findings);
    assert!(names(&found).is_subset(&BTreeSet::from(["mcap-identity", "container-checksums"])));
}

#[test]
fn the_promises_of_the_manifest_are_held() {
    let (_folder, path) = written("good");
    let place = |tables: &serde_json::Value, name: &str| {
        tables.as_array().unwrap().iter().position(|table| table["table"] == name).unwrap()
    };
    let original = fs::read(path.join("sequence.json")).unwrap();
    let restore = || fs::write(path.join("sequence.json"), &original).unwrap();

    manifest(&path, |value| {
        let index = place(&value["tables"], "trajectories");
        value["tables"][index]["rows"] = 3.into();
    });
    only("table-rows", &path);
    restore();
    manifest(&path, |value| {
        let index = place(&value["tables"], "trajectories");
        value["tables"][index]["sha256"] = "0".repeat(64).into();
    });
    only("table-digest", &path);
    restore();
    manifest(&path, |value| {
        let index = place(&value["tables"], "trajectories");
        value["tables"].as_array_mut().unwrap().remove(index);
    });
    only("tables-listed", &path);
    restore();
    manifest(&path, |value| value["cameras"][0]["fx"] = "wide".into());
    let found = report(&path);
    assert!(found.breaks("manifest-schema") && found.rows.len() == 16, "the tables are checked all the same");
    restore();
    manifest(&path, |value| value["colour"] = "green".into());
    let found = report(&path);
    assert!(found.conformant);
    assert_eq!(advised(&found), BTreeSet::from(["unknown-content"]));
    assert_eq!(found.advice[0].id.as_deref(), Some("/colour"));
    fs::write(path.join("sequence.json"), "{").unwrap();
    only("manifest-schema", &path);
    fs::remove_file(path.join("sequence.json")).unwrap();
    only("manifest-schema", &path);
}

#[test]
fn a_table_that_cannot_be_read_does_not_stop_the_others() {
    let (_folder, path) = written("good");
    let table = path.join("graph_points.parquet");
    let bytes = fs::read(&table).unwrap();
    fs::write(&table, &bytes[..bytes.len() / 2]).unwrap();
    let found = only("container-readable", &path);
    assert_eq!(found.findings[0].table, Some("graph_points"));
    assert_eq!(found.rows.len(), 15);
    fs::write(&table, &bytes).unwrap();

    let frames = path.join("frames.parquet");
    fs::remove_file(&frames).unwrap();
    let found = report(&path);
    assert_eq!(names(&found), BTreeSet::from(["frames-present", "tables-listed"]), "{:#?}", found.findings);
}

#[test]
fn a_file_of_another_table_lacks_columns() {
    let (_folder, path) = written("good");
    fs::copy(path.join("graph_points.parquet"), path.join("graph_lines.parquet")).unwrap();
    let found = only("columns-present", &path);
    assert_eq!(found.findings[0].table, Some("graph_lines"));
}

#[test]
fn names_that_nobody_knows_are_mentioned() {
    let (_folder, path) = written("good");
    fs::write(path.join("notes.txt"), "hello").unwrap();
    let found = report(&path);
    assert!(found.conformant && found.findings.is_empty());
    assert_eq!(found.advice[0].id.as_deref(), Some("file notes.txt"));
}

#[test]
fn progress_goes_to_the_end() {
    let (_folder, path) = written("good");
    let last = std::sync::Mutex::new((0, 0));
    let progress = |done: u64, total: u64| {
        let mut last = last.lock().unwrap();
        *last = (*last).max((done, total));
    };
    let found = validate(&path, &Options { progress: Some(&progress), ..Options::default() }).unwrap();
    let (done, total) = *last.lock().unwrap();
    assert_eq!((done, total), (found.rows_checked(), found.rows_checked()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn random_bytes_are_never_more_than_findings(bytes in prop::collection::vec(any::<u8>(), 0..2000), magic in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.mcap");
        let mut content = if magic { b"\x89MCAP0\r\n".to_vec() } else { Vec::new() };
        content.extend(&bytes);
        fs::write(&path, &content).unwrap();
        prop_assert!(!report(&path).conformant);

        let parquet = folder.path().join("x");
        fs::create_dir(&parquet).unwrap();
        fs::write(parquet.join("frames.parquet"), &bytes).unwrap();
        fs::write(parquet.join("sequence.json"), &bytes).unwrap();
        prop_assert!(!report(&parquet).conformant);
    }
}

#[test]
fn flipped_bits_are_never_more_than_findings() {
    let folder = tempfile::tempdir().unwrap();
    let mut small = good::sequence();
    small.frames.truncate(6);
    small.point_measurements.retain(|row| row.frame_id.0 < 12);
    small.line_observations.clear();
    small.point_observations.clear();
    small.line_measurements.clear();
    small.graph_factors.clear();
    small.graph_poses.clear();
    small.trajectories.clear();
    good::refresh(&mut small);
    let mcap = folder.path().join("x.mcap");
    let parquet = folder.path().join("x");
    for path in [&mcap, &parquet] {
        write(path, &small, WriteOptions::default()).unwrap();
        assert_eq!(names(&report(path)), BTreeSet::new());
    }
    let mut noise = 1_u64;
    for file in [mcap.clone(), parquet.join("frames.parquet"), parquet.join("point_measurements.parquet")] {
        let good = fs::read(&file).unwrap();
        let path = if file == mcap { &mcap } else { &parquet };
        for _ in 0..60 {
            noise = crate::validate::mix::mix(noise);
            let mut bad = good.clone();
            let place = usize::try_from(noise % bad.len() as u64).unwrap();
            bad[place] ^= 1 << (noise >> 40 & 7);
            fs::write(&file, &bad).unwrap();
            // Some bits mean nothing, such as those of a library's name; none may bring the validator down.
            let _ = report(path);
        }
        fs::write(&file, &good).unwrap();
    }
}
