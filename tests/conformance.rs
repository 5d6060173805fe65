//! The conformance corpus: readers take every valid case, and the validator says of each what its text expects.

#[path = "conformance/builder/mod.rs"]
mod builder;

use std::path::Path;

use builder::{Case, Stored, build, cases};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{Sequence, TableSummary};
use rayon::prelude::*;

/// Builds every case of a kind in its encodings and checks each; all that fail are told at once.
fn check_all(kind: &str, check: impl Fn(&Case, Stored, &Path) -> Result<(), String> + Sync) {
    let folder = tempfile::tempdir().unwrap();
    let cases: Vec<Case> = cases().unwrap().into_iter().filter(|case| case.name.starts_with(kind)).collect();
    assert!(!cases.is_empty(), "there are no {kind} cases");
    let mut failures: Vec<String> = cases
        .par_iter()
        .enumerate()
        .flat_map_iter(|(number, case)| case.encodings.iter().map(move |stored| (number, case, *stored)))
        .filter_map(|(number, case, stored)| {
            let path = folder.path().join(stored.file_name(&format!("{number}-{}", stored.name())));
            let checked = build(case, stored, &path).and_then(|()| check(case, stored, &path));
            checked.err().map(|error| format!("{} ({}): {error}", case.name, stored.name()))
        })
        .collect();
    failures.sort();
    assert!(failures.is_empty(), "{} cases fail:\n{}", failures.len(), failures.join("\n"));
}

/// Summaries of the tables that have rows; a copy leaves the others out.
fn filled(tables: &[TableSummary]) -> Vec<TableSummary> {
    tables.iter().filter(|summary| summary.rows > 0 || summary.table == "frames").cloned().collect()
}

/// A sequence written in the other encoding and read again is the same, bit by bit.
fn copy_is_equal(sequence: &Sequence, stored: Stored, path: &Path) -> Result<(), String> {
    let copy = match stored {
        Stored::Mcap => path.with_extension("copy"),
        Stored::Parquet => path.with_extension("mcap"),
    };
    let failed = |error: format::Error| format!("copy: {error}");
    let written = format::write(&copy, sequence, WriteOptions::default()).map_err(failed)?;
    if written.tables != filled(&sequence.manifest.tables) {
        return Err("counts or digests of the copy differ".to_owned());
    }
    let mut back = format::read(&copy).map_err(failed)?;
    back.manifest.tables.clone_from(&sequence.manifest.tables);
    if back == *sequence { Ok(()) } else { Err("the copy differs".to_owned()) }
}

#[test]
fn readers_take_valid_cases_and_their_copies_are_equal() {
    check_all("valid/", |_, stored, path| {
        let reader = format::open(path).map_err(|error| error.to_string())?;
        let sequence = reader.read_all().map_err(|error| error.to_string())?;
        reader.verify_container().map_err(|error| error.to_string())?;
        let mut streamed = 0;
        for frame in reader.frames().map_err(|error| error.to_string())? {
            let frame = frame.map_err(|error| error.to_string())?;
            streamed += frame.point_measurements.len() + frame.line_observations.len();
            let found = reader.frame(frame.frame.frame_id).map_err(|error| error.to_string())?;
            if found.as_ref() != Some(&frame) {
                return Err(format!("{} by id is not as it is in the stream", frame.frame.frame_id));
            }
        }
        if streamed != sequence.point_measurements.len() + sequence.line_observations.len() {
            return Err(format!("{streamed} rows in the stream"));
        }
        copy_is_equal(&sequence, stored, path)
    });
}

#[test]
fn readers_survive_invalid_cases() {
    check_all("invalid/", |_, _, path| {
        // Rows or an error, whichever; a panic or a hang would be wrong.
        if let Ok(reader) = format::open(path) {
            let _ = reader.read_all();
            let _ = reader.verify_container();
            if let Ok(frames) = reader.frames() {
                frames.for_each(drop);
            }
        }
        Ok(())
    });
}

#[test]
fn the_corpus_is_written_as_files_with_expected_findings() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("corpus");
    let count = builder::export(&output).unwrap();
    let list: serde_json::Value =
        serde_json::from_slice(&std::fs::read(output.join("corpus.json")).unwrap()).unwrap();
    let listed = list["cases"].as_array().unwrap();
    assert_eq!(listed.len(), count);
    for case in listed {
        let folder = output.join(case["case"].as_str().unwrap());
        let expected: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.join("expected.json")).unwrap()).unwrap();
        assert_eq!(expected, *case);
        for encoding in case["encodings"].as_object().unwrap().values() {
            assert!(folder.join(encoding["path"].as_str().unwrap()).exists(), "{}", case["case"]);
        }
    }
    assert!(builder::export(&output).is_err(), "what is there must not be overwritten");
}
