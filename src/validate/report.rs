//! What the validator gives: findings, counts, and whether the sequence conforms.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::Serialize;

use super::finding::{Finding, Findings};
use super::rules::{Severity, rules_for};

/// Version of the report's own schema.
pub const REPORT_VERSION: &str = "1.0.0";

/// The result of validating one sequence, or the catalogue of a collection.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Report {
    /// Version of the schema of this report, as `major.minor.patch`.
    pub report_version: &'static str,
    /// Version of the validator.
    pub validator_version: &'static str,
    /// What was validated; absent for a sequence in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// `MCAP file`, `Parquet folder` or `collection`; absent where none could be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoding: Option<&'static str>,
    /// Version of the specification that the sequence declares.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spec_version: Option<String>,
    /// Name of the sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequence: Option<String>,
    /// Whether every MUST holds.
    pub conformant: bool,
    /// Rows that were checked, by table.
    pub rows: BTreeMap<&'static str, u64>,
    /// How often each rule is broken, in full; rules that hold are left out.
    pub rules: Vec<RuleCount>,
    /// Errors and warnings: the first ones of each rule and table.
    pub findings: Vec<Finding>,
    /// Advice, which has no part in conformance: the first of each rule and table.
    pub advice: Vec<Finding>,
}

/// How often a rule is broken in a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct RuleCount {
    /// Id of the rule.
    pub rule: &'static str,
    /// What breaking it means.
    pub severity: Severity,
    /// Table concerned, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<&'static str>,
    /// Times the rule is broken.
    pub count: u64,
    /// Findings of it that are listed.
    pub listed: usize,
}

/// What a report is about.
#[derive(Default)]
pub(crate) struct Subject {
    pub(crate) path: Option<String>,
    pub(crate) encoding: Option<&'static str>,
    pub(crate) spec_version: Option<String>,
    pub(crate) sequence: Option<String>,
}

impl Report {
    /// Puts findings together; those of rules that are younger than the file are left out.
    pub(crate) fn new(subject: Subject, rows: BTreeMap<&'static str, u64>, findings: Findings) -> Self {
        let mut active = rules_for(subject.spec_version.as_deref().unwrap_or(""));
        if active.is_empty() {
            // An unknown major version: what was found is that.
            active = rules_for("");
        }
        let (mut rules, mut listed, mut advice) = (Vec::new(), Vec::new(), Vec::new());
        for (rule, table, count, kept) in findings.into_parts() {
            let rule = rule.rule();
            if !active.contains(&rule) {
                continue;
            }
            rules.push(RuleCount {
                rule: rule.id,
                severity: rule.severity,
                table,
                count,
                listed: kept.len(),
            });
            if rule.severity == Severity::Advice {
                advice.extend(kept);
            } else {
                listed.extend(kept);
            }
        }
        let conformant = rules.iter().all(|rule| rule.severity != Severity::Error);
        let Subject { path, encoding, spec_version, sequence } = subject;
        Self {
            report_version: REPORT_VERSION,
            validator_version: env!("CARGO_PKG_VERSION"),
            path,
            encoding,
            spec_version,
            sequence,
            conformant,
            rows,
            rules,
            findings: listed,
            advice,
        }
    }

    /// The gravest severity found; `None` when there is nothing to say.
    #[must_use]
    pub fn worst(&self) -> Option<Severity> {
        self.rules.iter().map(|rule| rule.severity).max()
    }

    /// Times that rules of a severity are broken.
    #[must_use]
    pub fn count(&self, severity: Severity) -> u64 {
        self.rules.iter().filter(|rule| rule.severity == severity).map(|rule| rule.count).sum()
    }

    /// Whether a rule is broken.
    #[must_use]
    pub fn breaks(&self, rule: &str) -> bool {
        self.rules.iter().any(|found| found.rule == rule)
    }

    /// Rows that were checked, of all tables.
    #[must_use]
    pub fn rows_checked(&self) -> u64 {
        self.rows.values().sum()
    }
}

/// The JSON Schema (2020-12) of a report, as pretty JSON with a final newline.
#[must_use]
pub fn report_schema() -> String {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.for_serialize().into_generator().into_root_schema_for::<Report>();
    let id = format!("https://open-structure.github.io/spec/report/{REPORT_VERSION}/report.schema.json");
    schema.insert("$id".to_owned(), id.into());
    let mut text = serde_json::to_string_pretty(schema.as_value()).unwrap_or_default();
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::super::finding::Detail;
    use super::super::rules::RuleId;
    use super::*;

    fn report(rules: &[RuleId]) -> Report {
        let mut findings = Findings::new(10);
        for rule in rules {
            findings.add(*rule, Some("frames"), || Detail::new("this", "that").row(3).id("frame 7"));
        }
        let rows = BTreeMap::from([("frames", 4), ("point_landmarks", 6)]);
        let subject = Subject { spec_version: Some("1.0.0".to_owned()), ..Subject::default() };
        Report::new(subject, rows, findings)
    }

    #[test]
    fn only_errors_break_conformance() {
        assert_eq!(report(&[]).worst(), None);
        let kind = report(&[RuleId::LandmarkSeen]);
        assert!(kind.conformant && kind.worst() == Some(Severity::Advice) && kind.findings.is_empty());
        let warned = report(&[RuleId::LandmarkSeen, RuleId::NoiseDeclared]);
        assert!(warned.conformant && warned.worst() == Some(Severity::Warning) && warned.advice.len() == 1);
        let broken = report(&[RuleId::NoiseDeclared, RuleId::RowsOrdered]);
        assert!(!broken.conformant && broken.breaks("rows-ordered") && broken.count(Severity::Error) == 1);
        assert_eq!(broken.rows_checked(), 10);
    }

    #[test]
    fn a_report_satisfies_its_own_schema() {
        let schema = serde_json::from_str(&report_schema()).unwrap();
        let validator = jsonschema::validator_for(&schema).unwrap();
        for report in [report(&[]), report(&[RuleId::LandmarkSeen, RuleId::RowsOrdered])] {
            let value = serde_json::to_value(report).unwrap();
            assert!(validator.is_valid(&value), "{:?}", validator.iter_errors(&value).collect::<Vec<_>>());
        }
        assert!(!validator.is_valid(&serde_json::json!({"report_version": 1})));
    }
}
