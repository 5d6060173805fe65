//! The conformance corpus: readers take every valid case, and the validator says of each what its text expects.

#[path = "conformance/builder/mod.rs"]
mod builder;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex, Weak};

use builder::{Case, Expected, Stored};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{Sequence, TableSummary};
use open_structure::validate;
use rayon::prelude::*;
use tempfile::TempDir;

/// The corpus as files; they are there as long as a test holds them.
struct Corpus {
    folder: TempDir,
    cases: Vec<Case>,
}

/// The corpus, built once for the tests that run side by side.
#[expect(clippy::unwrap_used, reason = "tests")]
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
///
/// * `unread` — tables with columns that are not known: their digests cover what a copy does not have.
fn copy_is_equal(sequence: &Sequence, unread: &[&str], stored: Stored) -> Result<(), String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let copy = folder.path().join(match stored {
        Stored::Mcap => Stored::Parquet.file_name(),
        Stored::Parquet | Stored::Collection => Stored::Mcap.file_name(),
    });
    let failed = |error: format::Error| format!("copy: {error}");
    let written = format::write(&copy, sequence, WriteOptions::default()).map_err(failed)?;
    let known = |mut tables: Vec<TableSummary>| {
        tables.retain(|summary| !unread.contains(&summary.table.as_str()));
        tables
    };
    if known(written.tables) != known(filled(&sequence.manifest.tables)) {
        return Err("counts or digests of the copy differ".to_owned());
    }
    let mut back = format::read(&copy).map_err(failed)?;
    back.manifest.tables.clone_from(&sequence.manifest.tables);
    if back == *sequence { Ok(()) } else { Err("the copy differs".to_owned()) }
}

/// A collection's catalogue, read, is what its sequences make anew, and writing it gives it again.
fn catalogue_is_right(path: &Path) -> Result<Result<(), String>, format::Error> {
    let collection = format::Collection::open(path)?;
    let made = collection.entries(None).into_iter().collect::<Result<Vec<_>, _>>()?;
    let read = format::read_catalogue(path)?;
    if made != read {
        return Ok(Err(format!("{made:?} is made anew, {read:?} is read")));
    }
    for member in &collection.members {
        let sequence = format::read(&member.path)?;
        if sequence.manifest.name != member.name {
            return Ok(Err(format!("{} holds {}", member.path.display(), sequence.manifest.name)));
        }
    }
    Ok(Ok(()))
}

#[test]
fn readers_take_valid_cases_and_their_copies_are_equal() {
    check_all("valid/", |case, stored, path| {
        let failed = |error: format::Error| error.to_string();
        if stored == Stored::Collection {
            return catalogue_is_right(path).map_err(failed)?;
        }
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
        if stored == Stored::Parquet && case.encodings.contains(&Stored::Mcap) {
            let twin = format::read(path.with_file_name(Stored::Mcap.file_name())).map_err(failed)?;
            return if twin == sequence { Ok(()) } else { Err("not what the MCAP file holds".to_owned()) };
        }
        let stored_tables = reader.tables();
        let unread = stored_tables.iter().filter(|stored| !stored.unknown_columns.is_empty());
        copy_is_equal(&sequence, &unread.map(|stored| stored.table.name).collect::<Vec<_>>(), stored)
    });
}

#[test]
fn readers_survive_invalid_cases() {
    check_all("invalid/", |_, stored, path| {
        if stored == Stored::Collection {
            let _ = format::read_catalogue(path);
            let entries = format::Collection::open(path).map(|collection| collection.entries(None));
            return entries.map(drop).map_err(|error| error.to_string());
        }
        // Rows or an error, whichever; a panic or a hang would be wrong.
        if let Ok(reader) = format::open(path) {
            let _ = reader.read_all();
            if let Ok(frames) = reader.frames() {
                let _ = frames.take(2).last();
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

/// What the validator reports of a file: rule, severity and table, each once.
type Reported = BTreeSet<(String, String, Option<String>)>;

fn reported(path: &Path, stored: Stored) -> Result<Reported, String> {
    let mut found = Reported::new();
    if stored == Stored::Collection {
        // Of its sequences too, each by itself.
        let collection = format::Collection::open(path).map_err(|error| error.to_string())?;
        for member in collection.members {
            found.extend(reported(&member.path, Stored::Parquet)?);
        }
    }
    let report =
        validate::validate(path, &validate::Options::default()).map_err(|error| error.to_string())?;
    let counted = report.rules.iter().map(|count| {
        (count.rule.to_owned(), count.severity.name().to_owned(), count.table.map(str::to_owned))
    });
    found.extend(counted);
    Ok(found)
}

/// Holds what is reported against what the case expects.
fn compare(case: &Case, stored: Stored, found: &Reported) -> Result<(), String> {
    let expected: Vec<_> = case.findings.iter().filter(|expected| expected.follows_in(stored)).collect();
    let fits = |expected: &Expected, (rule, severity, table): &(String, String, Option<String>)| {
        expected.rule == *rule
            && expected.severity == *severity
            && (expected.table.is_none() || expected.table == *table)
    };
    let missing = expected
        .iter()
        .filter(|expected| !expected.optional && !found.iter().any(|found| fits(expected, found)))
        .map(|expected| format!("{} {} is not reported", expected.rule, text(expected.table.as_deref())));
    // Another table of an expected rule is no other defect.
    let surplus = found
        .iter()
        .filter(|found| {
            !expected.iter().any(|expected| expected.rule == found.0 && expected.severity == found.1)
        })
        .map(|(rule, _, table)| format!("{rule} {} is reported", text(table.as_deref())));
    let wrong: Vec<String> = missing.chain(surplus).collect();
    if wrong.is_empty() {
        return Ok(());
    }
    let all: BTreeSet<&str> = found.iter().map(|found| found.0.as_str()).collect();
    Err(format!("{}; reported in all: {all:?}", wrong.join("; ")))
}

fn text(table: Option<&str>) -> String {
    table.map_or_else(String::new, |table| format!("({table})"))
}

#[test]
fn valid_cases_have_no_findings_but_the_expected_advice() {
    check_all("valid/", |case, stored, path| compare(case, stored, &reported(path, stored)?));
}

#[test]
fn invalid_cases_show_their_defect_and_no_other() {
    check_all("invalid/", |case, stored, path| compare(case, stored, &reported(path, stored)?));
}

#[test]
fn the_folders_are_the_rules() {
    let corpus = corpus();
    let folders: BTreeSet<&str> = corpus.cases.iter().filter_map(Case::rule).collect();
    let rules: BTreeSet<&str> = validate::RULES.iter().map(|rule| rule.id).collect();
    assert_eq!(folders, rules);
    for case in &corpus.cases {
        for expected in &case.findings {
            let rule = validate::rule(&expected.rule);
            let severity = rule.map(|rule| rule.severity.name());
            assert_eq!(severity, Some(expected.severity.as_str()), "{}: {}", case.name, expected.rule);
            let grave = case.name.starts_with("valid/") && expected.severity != "advice";
            assert!(!grave, "{}: a valid case has nothing but advice", case.name);
        }
        if let Some(rule) = case.rule() {
            for stored in &case.encodings {
                let named = case.findings.iter().any(|expected| {
                    expected.rule == rule && !expected.optional && expected.follows_in(*stored)
                });
                assert!(named, "{} ({}) does not expect its own rule", case.name, stored.name());
            }
        }
    }
}
