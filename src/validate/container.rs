//! The container: MCAP's index, checksums, identity, schemas and times; what is there that nobody knows.

use std::collections::BTreeMap;

use serde_json::Value;

use super::finding::{Detail, Findings};
use super::manifest::Known;
use super::rules::RuleId;
use super::tables::Outcome;
use crate::format::{Faults, McapSurvey};
use crate::structure::registry::SPEC_VERSION;
use crate::structure::{TABLES, TableSummary, table_info};

/// Topics of JSON messages, and what they hold.
const MANIFEST_TOPIC: &str = "/manifest";
const SUMMARY_TOPIC: &str = "/table_summaries";

fn faults(rule: RuleId, expected: &str, faults: &Faults, findings: &mut Findings) {
    for fault in &faults.kept {
        findings.add(rule, None, || Detail::new(expected, fault.clone()));
    }
    let rest = faults.count - faults.kept.len() as u64;
    if rest > 0 {
        findings.add_many(rule, None, rest, || Detail::new(expected, format!("{rest} more")));
    }
}

/// Checks what an MCAP file says of itself.
pub(crate) fn survey(survey: &McapSurvey, known: &Known, findings: &mut Findings) {
    faults(
        RuleId::ContainerReadable,
        "an MCAP file that can be decoded throughout",
        &survey.unreadable,
        findings,
    );
    faults(RuleId::ContainerChecksums, "a checksum that is right", &survey.checksums, findings);
    faults(RuleId::McapIndexed, "a chunked file with a complete index", &survey.index, findings);
    faults(RuleId::McapMessageTimes, "log times that do not fall", &survey.falling_times, findings);
    if let Some(profile) = survey.profile.as_ref().filter(|profile| !profile.is_empty()) {
        findings
            .add(RuleId::McapProfileEmpty, None, || Detail::new("an empty profile", format!("`{profile}`")));
    }
    identity(survey, known, findings);
    schemas(survey, findings);
}

fn identity(survey: &McapSurvey, known: &Known, findings: &mut Findings) {
    let mut broken = |expected: String, found: String| {
        findings.add(RuleId::McapIdentity, None, || Detail::new(expected, found));
    };
    let [identity] = survey.identities.as_slice() else {
        let found = survey.identities.len().to_string();
        broken("one Metadata record `open-structure`".to_owned(), found);
        return;
    };
    for (key, expected) in [("spec_version", &known.spec_version), ("name", &known.name)] {
        let Some(expected) = expected else { continue };
        match identity.get(key) {
            Some(found) if found == expected => {}
            Some(found) => broken(format!("{key} `{expected}`, as in the manifest"), format!("`{found}`")),
            None => broken(format!("{key} `{expected}`, as in the manifest"), "none".to_owned()),
        }
    }
}

/// Checks that channels carry their schemas, and that JSON messages satisfy theirs.
fn schemas(survey: &McapSurvey, findings: &mut Findings) {
    for channel in survey.channels.values() {
        let topic = channel.topic.as_str();
        let is_json = topic == MANIFEST_TOPIC || topic == SUMMARY_TOPIC;
        let known = topic.strip_prefix('/').and_then(table_info).map(|table| table.name);
        if !is_json && known.is_none() {
            continue;
        }
        let (encoding, schema_encoding) = if is_json { ("json", "jsonschema") } else { ("arrow", "arrow") };
        let mut broken = |expected: String, found: String| {
            findings.add(RuleId::McapSchemasEmbedded, known, || Detail::new(expected, found).id(topic));
        };
        if channel.message_encoding != encoding {
            broken(format!("message encoding `{encoding}`"), format!("`{}`", channel.message_encoding));
            continue;
        }
        let Some((found_encoding, data)) = &channel.schema else {
            broken(format!("a schema in encoding `{schema_encoding}`"), "none".to_owned());
            continue;
        };
        if found_encoding != schema_encoding {
            broken(format!("a schema in encoding `{schema_encoding}`"), format!("`{found_encoding}`"));
            continue;
        }
        if !is_json {
            continue;
        }
        let schema: Option<Value> = serde_json::from_slice(data).ok();
        let Some(validator) = schema.and_then(|schema| jsonschema::validator_for(&schema).ok()) else {
            broken("a JSON Schema".to_owned(), "bytes that are none".to_owned());
            continue;
        };
        for (_, log_time, message) in survey.json.iter().filter(|message| message.0 == topic) {
            match serde_json::from_slice::<Value>(message) {
                // The manifest has a rule of its own for this.
                Err(_) if topic == MANIFEST_TOPIC => {}
                Err(error) => broken("JSON messages".to_owned(), format!("at {log_time} ns: {error}")),
                Ok(value) => {
                    if let Some(error) = validator.iter_errors(&value).next() {
                        let found = format!("at {log_time} ns: {error}");
                        broken("messages that satisfy the embedded schema".to_owned(), found);
                    }
                }
            }
        }
    }
}

/// Whether a topic's channel says that its schema and its messages are Arrow.
pub(crate) fn says_arrow(survey: &McapSurvey, topic: &str) -> bool {
    survey.channels.values().any(|channel| {
        channel.topic == topic
            && channel.message_encoding == "arrow"
            && channel.schema.as_ref().is_some_and(|(encoding, _)| encoding == "arrow")
    })
}

/// Checks the stamps of messages that belong to the whole sequence.
pub(crate) fn message_times(
    survey: &McapSurvey,
    outcomes: &BTreeMap<&'static str, Outcome>,
    per_frame: &[&str],
    stamps: (i64, i64),
    findings: &mut Findings,
) {
    let [first, last] = [stamps.0, stamps.1].map(|stamp| u64::try_from(stamp).unwrap_or(0));
    for (topic, log_time, _) in &survey.json {
        let (expected, which) = if topic == MANIFEST_TOPIC { (first, "first") } else { (last, "last") };
        if *log_time != expected {
            findings.add(RuleId::McapMessageTimes, None, || {
                let expected = format!("a message at the stamp of the {which} frame, {expected} ns");
                Detail::new(expected, format!("{log_time} ns")).id(topic)
            });
        }
    }
    for (table, outcome) in outcomes.iter().filter(|(table, _)| !per_frame.contains(*table)) {
        for (log_time, messages) in outcome.log_times.iter().filter(|(log_time, _)| **log_time != first) {
            findings.add_many(RuleId::McapMessageTimes, Some(table), *messages, || {
                let expected = format!("messages at the stamp of the first frame, {first} ns");
                Detail::new(expected, format!("{messages} at {log_time} ns"))
            });
        }
    }
}

/// The table summaries of an MCAP file; what is no summary is a finding of the schema's rule.
pub(crate) fn summaries(texts: &[Vec<u8>]) -> Vec<TableSummary> {
    texts.iter().filter_map(|text| serde_json::from_slice(text).ok()).collect()
}

/// Holds the table summaries against the tables that are there.
pub(crate) fn listed(summaries: &[TableSummary], present: &[&'static str], findings: &mut Findings) {
    for table in TABLES.iter().map(|table| table.name) {
        let count = summaries.iter().filter(|summary| summary.table == table).count();
        let expected = usize::from(present.contains(&table));
        if count != expected {
            findings.add(RuleId::TablesListed, Some(table), || {
                let expected =
                    if expected == 1 { "one summary of the table" } else { "no summary: it is not there" };
                Detail::new(expected, format!("{count} of them"))
            });
        }
    }
    for summary in summaries.iter().filter(|summary| table_info(&summary.table).is_none()) {
        findings.add(RuleId::UnknownContent, None, || {
            Detail::new(format!("tables of version {SPEC_VERSION}"), "the summary of another one")
                .id(&summary.table)
        });
    }
}
