//! From a path to its report: opening, the manifest, what is there, then every table.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::collection::collection;
use super::finding::{Detail, Findings};
use super::manifest::{Known, manifest, manifest_value};
use super::report::{Report, Subject};
use super::rules::RuleId;
use super::run::{Tables, run};
use super::source::Source;
use super::tables::{Progress, Shared, damaged};
use super::{Error, Options, container};
use crate::format::{self, Collection, Encoding, McapSurvey, SequenceReader, StoredTable, survey_file};
use crate::storage::{self, Found};
use crate::structure::registry::SPEC_VERSION;
use crate::structure::{Sequence, Storage, TABLES, TableInfo, TableSummary, for_each_table};

/// Validates what stands at a path.
pub(crate) fn validate(path: &Path, options: &Options<'_>) -> Result<Report, Error> {
    let io = |cause| Error::Io { path: path.to_owned(), cause };
    let found = storage::find(path).map_err(io)?;
    let folder = path
        .file_name()
        .is_some_and(|name| name == "sequence.json")
        .then(|| path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new(".")));
    match Collection::at(path) {
        Ok(Some(found)) => return Ok(collection(&found, options)),
        Err(format::Error::Io { cause, .. }) => return Err(io(cause)),
        _ => {}
    }
    let mut findings = Findings::new(options.listed);
    let mut subject = Subject { path: Some(path.display().to_string()), ..Subject::default() };
    let target = folder.unwrap_or(path);
    if found == Found::Folder || folder.is_some() {
        subject.encoding = Some(Encoding::Parquet.name());
        storage::list(target, &[]).map_err(io)?;
    } else if matches!(found, Found::File(_)) {
        storage::File::open(path).map_err(io)?;
    } else {
        findings.add(RuleId::ContainerReadable, None, || {
            Detail::new("an .mcap file or a folder with sequence.json", "neither a file nor a folder")
        });
        return Ok(Report::new(subject, BTreeMap::new(), findings));
    }
    Ok(match SequenceReader::open_lenient(target) {
        Ok((reader, damage)) => opened(&reader, &damage, subject, options, findings),
        Err(format::Error::Io { cause, .. }) => return Err(io(cause)),
        Err(error) => unopened(target, &error, subject, findings),
    })
}

/// What can be said of an MCAP file that cannot be read by its index.
fn unopened(path: &Path, error: &format::Error, mut subject: Subject, mut findings: Findings) -> Report {
    let unreadable = |findings: &mut Findings| {
        findings.add(RuleId::ContainerReadable, None, || {
            Detail::new("an .mcap file or a folder with sequence.json", error.to_string())
        });
    };
    let survey = match error {
        format::Error::NotASequence { .. } => None,
        _ => survey_file(path).ok(),
    };
    let Some(survey) = survey else {
        unreadable(&mut findings);
        return Report::new(subject, BTreeMap::new(), findings);
    };
    subject.encoding = Some(Encoding::Mcap.name());
    let known = surveyed(&survey, &mut findings);
    // Without an index its absence is the finding, else what the reader said.
    if survey.index.count == 0 && survey.unreadable.count == 0 {
        unreadable(&mut findings);
    }
    subject.spec_version = known.spec_version;
    subject.sequence = known.name;
    Report::new(subject, BTreeMap::new(), findings)
}

/// Checks the manifest and the container by what a reading from end to end has shown.
fn surveyed(survey: &McapSurvey, findings: &mut Findings) -> Known {
    let text = survey.json.iter().find(|message| message.0 == "/manifest").map(|message| &message.2);
    let known = text.map(|text| manifest(text, findings)).unwrap_or_default();
    container::survey(survey, &known, findings);
    known
}

fn opened(
    reader: &SequenceReader,
    damage: &[(&'static TableInfo, format::Error)],
    mut subject: Subject,
    options: &Options<'_>,
    mut findings: Findings,
) -> Report {
    subject.encoding = Some(reader.encoding().name());
    let is_mcap = reader.encoding() == Encoding::Mcap;
    let mut present: Vec<&'static str> = reader.tables().iter().map(|stored| stored.table.name).collect();
    present.extend(damage.iter().map(|(table, _)| table.name));
    present.sort_unstable();
    present.dedup();

    let known = match reader.manifest_text() {
        Ok(text) => manifest(&text, &mut findings),
        Err(format::Error::NotASequence { found, .. }) if present.is_empty() && !is_mcap => {
            findings.add(RuleId::ContainerReadable, None, || {
                Detail::new("an .mcap file or a folder with sequence.json", found)
            });
            return Report::new(subject, BTreeMap::new(), findings);
        }
        Err(format::Error::NotASequence { found, .. }) => {
            // What the index does not know may be there all the same; then nothing can be read by it.
            let survey = reader.survey().filter(|survey| {
                survey.index.count > 0 && survey.json.iter().any(|message| message.0 == "/manifest")
            });
            if let Some(survey) = survey {
                let known = surveyed(&survey, &mut findings);
                subject.spec_version = known.spec_version;
                subject.sequence = known.name;
                return Report::new(subject, BTreeMap::new(), findings);
            }
            findings.add(RuleId::ManifestSchema, None, || Detail::new("a manifest", found));
            Known::default()
        }
        Err(error) => {
            findings.add(RuleId::ContainerReadable, None, || {
                Detail::new("a manifest that can be read", error.to_string())
            });
            Known::default()
        }
    };
    subject.spec_version.clone_from(&known.spec_version);
    subject.sequence.clone_from(&known.name);
    if known.is_of_another_age() {
        return Report::new(subject, BTreeMap::new(), findings);
    }

    for (table, error) in damage {
        // A channel without its schema is the survey's finding.
        if !is_mcap {
            damaged(error, table.name, &mut findings);
        }
    }
    let skipped = columns(reader, &mut findings);
    let unknown = if is_mcap { "topic" } else { "file" };
    for name in reader.passed_over() {
        findings.add(RuleId::UnknownContent, None, || {
            Detail::new(format!("{unknown}s of version {SPEC_VERSION}"), "another one")
                .id(format!("{unknown} {name}"))
        });
    }
    if !present.contains(&"frames") {
        findings.add(RuleId::FramesPresent, Some("frames"), || Detail::new("the table", "none"));
    }
    let summaries = if is_mcap {
        match reader.summary_texts() {
            Ok(texts) => Some(container::summaries(&texts)),
            Err(error) => {
                findings.add(RuleId::ContainerReadable, None, || {
                    Detail::new("table summaries that can be read", error.to_string())
                });
                None
            }
        }
    } else {
        known.summaries.clone().filter(|_| known.readable)
    };
    if let Some(summaries) = &summaries {
        container::listed(summaries, &present, &mut findings);
    }

    let total = expected_rows(reader, summaries.as_deref());
    let undigested = if known.is_younger() { with_unknown_columns(reader) } else { BTreeSet::new() };
    let shared = Shared {
        source: Source::Stored(reader),
        summaries: Some(summaries.as_deref().unwrap_or_default()),
        present: present.iter().copied().collect(),
        skipped,
        undigested,
        progress: Progress::new(total, options.progress),
    };
    let (survey, tables): (Option<McapSurvey>, Tables) =
        rayon::join(|| reader.survey(), || run(&shared, &known, findings.fresh()));
    if let Some(survey) = &survey {
        container::survey(survey, &known, &mut findings);
        for (table, error) in damage {
            if container::says_arrow(survey, &table.topic()) {
                findings.add(RuleId::McapSchemasEmbedded, Some(table.name), || {
                    Detail::new("an Arrow schema", error.to_string())
                });
            }
        }
        if let Some(stamps) = tables.stamps {
            let per_frame = TABLES
                .iter()
                .filter(|table| table.storage == Storage::PerFrame)
                .map(|table| table.name)
                .collect::<Vec<_>>();
            container::message_times(survey, &tables.outcomes, &per_frame, stamps, &mut findings);
        }
    }
    finish(subject, tables, findings)
}

fn finish(subject: Subject, tables: Tables, mut findings: Findings) -> Report {
    findings.merge(tables.findings);
    let rows = tables.outcomes.iter().filter(|(_, outcome)| outcome.rows > 0 || outcome.whole);
    let rows = rows.map(|(table, outcome)| (*table, outcome.rows)).collect();
    Report::new(subject, rows, findings)
}

/// Checks the columns of every table; gives those tables whose rows cannot be decoded.
fn columns(reader: &SequenceReader, findings: &mut Findings) -> BTreeSet<&'static str> {
    let mut skipped = BTreeSet::new();
    for stored in reader.tables() {
        if !columns_fit(&stored, findings) {
            skipped.insert(stored.table.name);
        }
    }
    skipped
}

/// Checks the columns of a table; gives whether its rows can be decoded.
pub(crate) fn columns_fit(stored: &StoredTable, findings: &mut Findings) -> bool {
    let table = stored.table.name;
    for column in &stored.unknown_columns {
        findings.add(RuleId::UnknownContent, Some(table), || {
            Detail::new(format!("columns of version {SPEC_VERSION}"), "another one")
                .id(format!("column {column}"))
        });
    }
    for column in &stored.missing_columns {
        findings.add(RuleId::ColumnsPresent, Some(table), || {
            Detail::new(format!("a column {column}"), "none; the rows are not checked").id(column)
        });
    }
    for (column, found, expected) in &stored.mistyped_columns {
        findings.add(RuleId::ColumnsTyped, Some(table), || {
            Detail::new(*expected, format!("{found}; the rows are not checked")).id(column)
        });
    }
    stored.missing_columns.is_empty() && stored.mistyped_columns.is_empty()
}

/// Tables with columns that this version does not know.
fn with_unknown_columns(reader: &SequenceReader) -> BTreeSet<&'static str> {
    let tables = reader.tables().into_iter();
    tables.filter(|stored| !stored.unknown_columns.is_empty()).map(|stored| stored.table.name).collect()
}

fn expected_rows(reader: &SequenceReader, summaries: Option<&[TableSummary]>) -> u64 {
    reader
        .tables()
        .iter()
        .map(|stored| {
            let promised = || {
                let summaries = summaries.into_iter().flatten();
                summaries
                    .filter(|summary| summary.table == stored.table.name)
                    .map(|summary| summary.rows)
                    .next()
            };
            stored.rows.or_else(promised).unwrap_or(0)
        })
        .fold(0, u64::saturating_add)
}

/// Validates a sequence in memory.
pub(crate) fn validate_sequence(sequence: &Sequence, options: &Options<'_>) -> Report {
    let mut findings = Findings::new(options.listed);
    let known = match serde_json::to_value(&sequence.manifest) {
        Ok(value) => manifest_value(&value, &mut findings),
        Err(_) => Known::default(),
    };
    let subject = Subject {
        spec_version: known.spec_version.clone(),
        sequence: known.name.clone(),
        ..Subject::default()
    };
    if known.is_of_another_age() {
        return Report::new(subject, BTreeMap::new(), findings);
    }
    let (mut total, mut present) = (0_u64, BTreeSet::from(["frames"]));
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            $(
                total += sequence.$name.len() as u64;
                if !sequence.$name.is_empty() {
                    present.insert(stringify!($name));
                }
            )+
        };
    }
    for_each_table!(each);
    let shared = Shared {
        source: Source::Memory(sequence),
        summaries: None,
        present,
        skipped: BTreeSet::new(),
        undigested: BTreeSet::new(),
        progress: Progress::new(total, options.progress),
    };
    let tables = run(&shared, &known, findings.fresh());
    finish(subject, tables, findings)
}
