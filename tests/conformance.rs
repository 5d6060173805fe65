//! The conformance corpus: readers take every valid case, and the validator says of each what its text expects.

#[path = "conformance/builder/mod.rs"]
mod builder;

use std::path::Path;
use std::sync::{Arc, Mutex, Weak};

use builder::{Case, Stored};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{Sequence, TableSummary};
use rayon::prelude::*;
use tempfile::TempDir;

/// The corpus as files; they are there as long as a test holds them.
struct Corpus {
    folder: TempDir,
    cases: Vec<Case>,
}

/// The corpus, built once for the tests that run side by side.
fn corpus() -> Arc<Corpus> {
    static SHARED: Mutex<Weak<Corpus>> = Mutex::new(Weak::new());
    let mut shared = SHARED.lock().unwrap();
    shared.upgrade().unwrap_or_else(|| {
        let folder = tempfile::tempdir().unwrap();
        let cases = builder::export(&folder.path().join("corpus")).unwrap();
        let corpus = Arc::new(Corpus { folder, cases });
        *shared = Arc::downgrade(&corpus);
        corpus
    })
}

/// Checks every case of a kind in its encodings; all that fail are told at once.
fn check_all(kind: &str, check: impl Fn(&Case, Stored, &Path) -> Result<(), String> + Sync) {
    let corpus = corpus();
    let mut failures: Vec<String> = corpus
        .cases
        .par_iter()
        .filter(|case| case.name.starts_with(kind))
        .flat_map_iter(|case| case.encodings.iter().map(move |stored| (case, *stored)))
        .filter_map(|(case, stored)| {
            let path = corpus.folder.path().join("corpus").join(&case.name).join(stored.file_name());
            let checked = check(case, stored, &path);
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
fn copy_is_equal(sequence: &Sequence, stored: Stored) -> Result<(), String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let copy = folder.path().join(match stored {
        Stored::Mcap => Stored::Parquet.file_name(),
        Stored::Parquet => Stored::Mcap.file_name(),
    });
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
        let failed = |error: format::Error| error.to_string();
        let reader = format::open(path).map_err(failed)?;
        let sequence = reader.read_all().map_err(failed)?;
        reader.verify_container().map_err(failed)?;
        let mut streamed = 0;
        for (number, frame) in reader.frames().map_err(failed)?.enumerate() {
            let frame = frame.map_err(failed)?;
            streamed += frame.point_measurements.len() + frame.line_observations.len();
            if number % 3 == 0 && reader.frame(frame.frame.frame_id).map_err(failed)?.as_ref() != Some(&frame)
            {
                return Err(format!("{} by id is not as it is in the stream", frame.frame.frame_id));
            }
        }
        if streamed != sequence.point_measurements.len() + sequence.line_observations.len() {
            return Err(format!("{streamed} rows in the stream"));
        }
        copy_is_equal(&sequence, stored)
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
fn the_corpus_as_files_says_what_to_expect() {
    let corpus = corpus();
    let output = corpus.folder.path().join("corpus");
    let json =
        |path: &Path| -> serde_json::Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
    let list = json(&output.join("corpus.json"));
    let listed = list["cases"].as_array().unwrap();
    assert_eq!(listed.len(), corpus.cases.len());
    for case in listed {
        let folder = output.join(case["case"].as_str().unwrap());
        assert_eq!(json(&folder.join("expected.json")), *case);
        for encoding in case["encodings"].as_object().unwrap().values() {
            assert!(folder.join(encoding["path"].as_str().unwrap()).exists(), "{}", case["case"]);
        }
    }
    assert!(builder::export(&output).is_err(), "what is there must not be overwritten");
}
