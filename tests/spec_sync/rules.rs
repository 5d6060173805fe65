//! The rules: in the specification, in the code and in the conformance corpus they are the same set.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::document::read_spec;

/// A rule where the specification states it.
#[derive(Clone, Debug)]
struct Rule {
    id: String,
    /// `error` for MUST, `warning` for SHOULD, `advice`.
    severity: &'static str,
    section: String,
}

/// Names in the manner of `{rule-name}` in a line.
fn ids(line: &str) -> Vec<&str> {
    line.split("`{").skip(1).filter_map(|rest| rest.split_once("}`")).map(|(id, _)| id).collect()
}

/// Rules in the order of the text. A line that demands or advises something names the one rule that it states.
fn rules(text: &str) -> Vec<Rule> {
    let mut rules = Vec::new();
    let mut section = "";
    for line in text.lines() {
        if line.starts_with("##") {
            section = line.trim_start_matches('#').trim().split(' ').next().unwrap_or_default();
        }
        if line.contains("RFC 2119") {
            continue;
        }
        let severity = match [line.contains("MUST"), line.contains("SHOULD"), line.contains("Advice:")] {
            [true, false, false] => "error",
            [false, true, false] => "warning",
            [false, false, true] => "advice",
            _ if ids(line).is_empty() => continue,
            _ => panic!("one of MUST, SHOULD and Advice belongs to a rule: {line}"),
        };
        match ids(line).as_slice() {
            [id] => rules.push(Rule {
                id: (*id).to_owned(),
                severity,
                section: section.trim_end_matches('.').to_owned(),
            }),
            found => panic!("a statement names one rule, not {found:?}: {line}"),
        }
    }
    rules
}

/// The index of rules at the end of the specification.
pub(crate) fn index(text: &str) -> String {
    let mut rules = rules(text);
    rules.sort_by(|left, right| left.id.cmp(&right.id));
    let mut table = "| rule | breaking it is | section |\n|---|---|---|\n".to_owned();
    for Rule { id, severity, section } in rules {
        let kind = match severity {
            "error" => "an error",
            "warning" => "a warning",
            _ => "only advised against",
        };
        let _ = writeln!(table, "| {id} | {kind} | {section} |");
    }
    table
}

#[test]
fn every_rule_is_stated_once() {
    let rules = rules(&read_spec("open-structure.md"));
    assert!(rules.len() > 50, "{} rules", rules.len());
    let mut seen = BTreeSet::new();
    for rule in &rules {
        assert!(seen.insert(&rule.id), "{} is stated twice", rule.id);
    }
}
