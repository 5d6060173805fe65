//! The catalogue of a collection, held against the sequences that are there.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::Options;
use super::finding::{Detail, Findings};
use super::report::{Report, Subject};
use super::rules::{RuleId, version_numbers};
use super::stored::columns_fit;
use super::tables::{damaged, order, scan};
use crate::format::{self, Collection, Member, StoredCatalogue, folder_name};
use crate::structure::registry::SPEC_VERSION;
use crate::structure::{CATALOGUE, CatalogueEntry};

/// First version of the specification with collections.
const FIRST_VERSION: (u64, u64, u64) = (1, 4, 0);
/// How far a length may be off, metres; for lengths over a metre in proportion.
const LENGTH_TOLERANCE: f64 = 1e-6;

/// Validates a collection: its folders and its catalogue. Each of its sequences is validated by itself.
pub(crate) fn collection(found: &Collection, options: &Options<'_>) -> Report {
    let mut findings = Findings::new(options.listed);
    let mut subject = Subject {
        path: Some(found.path.display().to_string()),
        encoding: Some("collection"),
        spec_version: Some(SPEC_VERSION.to_owned()),
        sequence: None,
    };
    for path in &found.outside {
        findings.add(RuleId::CollectionFoldersNamed, None, || {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            Detail::new("a folder called `sequence=NAME`", format!("the sequence `{name}`"))
        });
    }
    for name in &found.others {
        findings.add(RuleId::UnknownContent, None, || {
            Detail::new(format!("files of version {SPEC_VERSION}"), "another one").id(format!("file {name}"))
        });
    }
    let rows = rows(found, &mut subject, &mut findings);
    let entries = found.entries(options.progress);
    for (member, entry) in found.members.iter().zip(&entries) {
        unread(member, entry, &mut findings);
    }
    if let Some(rows) = &rows {
        compare(rows, &found.members, &entries, &mut findings);
    }
    let counted = rows.map(|rows| (CATALOGUE.name, rows.len() as u64));
    Report::new(subject, counted.into_iter().collect(), findings)
}

/// What keeps a sequence from being compared with its row.
fn unread(member: &Member, entry: &Result<CatalogueEntry, format::Error>, findings: &mut Findings) {
    match entry {
        Ok(_) => {}
        Err(format::Error::Misnamed { name, expected, .. }) => {
            findings.add(RuleId::CollectionFoldersNamed, None, || {
                let folder = member.path.file_name().unwrap_or_default().to_string_lossy();
                Detail::new(
                    format!("a folder called `{expected}`, after the manifest"),
                    format!("`{folder}`"),
                )
                .id(format!("sequence `{name}`"))
            });
        }
        Err(error) => findings.add(RuleId::ContainerReadable, None, || {
            Detail::new("a sequence that can be read", error.to_string())
                .id(format!("sequence `{}`", member.name))
        }),
    }
}

/// The rows of the catalogue; `None` when they cannot be read.
fn rows(found: &Collection, subject: &mut Subject, findings: &mut Findings) -> Option<Vec<CatalogueEntry>> {
    if !found.has_catalogue {
        findings.add(RuleId::CataloguePresent, None, || {
            Detail::new("catalogue.parquet", "none; `os index` writes it")
        });
        return None;
    }
    let read = || {
        let stored = StoredCatalogue::open(&found.path)?;
        let declared = stored.spec_version();
        Ok((stored, declared))
    };
    let (stored, declared) = match read() {
        Ok(read) => read,
        Err(error) => {
            damaged(&error, CATALOGUE.name, findings);
            return None;
        }
    };
    // One that claims to be older than catalogues are is judged by the version that has them.
    subject.spec_version = declared
        .filter(|version| {
            version_numbers(version)
                .is_some_and(|numbers| numbers >= FIRST_VERSION && numbers.0 == FIRST_VERSION.0)
        })
        .or(subject.spec_version.take());
    if !columns_fit(stored.stored(), findings) {
        return None;
    }
    match stored.rows() {
        Ok(rows) => {
            scan(&rows, 0, findings);
            order(None, &rows, 0, findings);
            Some(rows)
        }
        Err(error) => {
            damaged(&error, CATALOGUE.name, findings);
            None
        }
    }
}

/// Holds rows and sequences against each other.
fn compare(
    rows: &[CatalogueEntry],
    members: &[Member],
    entries: &[Result<CatalogueEntry, format::Error>],
    findings: &mut Findings,
) {
    let table = Some(CATALOGUE.name);
    let mut by_name: BTreeMap<&str, (u64, &CatalogueEntry)> = BTreeMap::new();
    for (number, row) in (0..).zip(rows) {
        let here = by_name.entry(&row.sequence).or_insert((number, row));
        // Neighbours of one name were found already.
        if here.0 + 1 < number {
            findings.add(RuleId::KeysUnique, table, || {
                Detail::new("a key of its own", "the key of an earlier row")
                    .row(number)
                    .id(format!("sequence `{}`", row.sequence))
            });
        }
    }
    for (member, entry) in members.iter().zip(entries) {
        match (by_name.get(member.name.as_str()), entry) {
            (None, _) => findings.add(RuleId::CatalogueComplete, table, || {
                Detail::new(format!("a row of `{}`", member.name), "none; `os index --force` writes it")
            }),
            (Some((number, row)), Ok(entry)) => differences(*number, row, entry, findings),
            (Some(_), Err(_)) => {}
        }
    }
    let there: BTreeSet<&str> = members.iter().map(|member| member.name.as_str()).collect();
    for (name, (number, _)) in &by_name {
        if !there.contains(name) {
            findings.add(RuleId::CatalogueSequencesThere, table, || {
                Detail::new(format!("the folder {}", folder_name(name)), "none").row(*number)
            });
        }
    }
}

/// Finds the columns in which a row is not what its sequence says.
fn differences(number: u64, row: &CatalogueEntry, entry: &CatalogueEntry, findings: &mut Findings) {
    // Rows of plain values always have a JSON form.
    let [row_json, entry_json] = [row, entry].map(|entry| serde_json::to_value(entry).unwrap_or_default());
    let shown = |value: Option<&Value>| value.map_or_else(|| "none".to_owned(), Value::to_string);
    for field in CATALOGUE.fields {
        let [found, expected] = [&row_json, &entry_json].map(|json| json.get(field.name));
        let agrees = match (field.name, row.path_length, entry.path_length) {
            ("path_length", Some(found), Some(expected)) => {
                (found - expected).abs() <= LENGTH_TOLERANCE * expected.max(1.0)
            }
            _ => found == expected,
        };
        if !agrees {
            findings.add(RuleId::CatalogueAgrees, Some(CATALOGUE.name), || {
                Detail::new(format!("{} {}", field.name, shown(expected)), shown(found))
                    .row(number)
                    .id(format!("sequence `{}`", row.sequence))
            });
        }
    }
}
