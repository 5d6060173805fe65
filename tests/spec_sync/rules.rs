//! The rules: in the specification, in the code and in the conformance corpus they are the same set.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;

use open_structure::validate::RULES;

use crate::document::read_spec;

/// A rule where the specification states it.
#[derive(Clone, Debug)]
struct Rule {
    id: String,
    /// `error` for MUST, `warning` for SHOULD, `advice`.
    severity: &'static str,
    section: String,
    /// What must or should hold, without the word `Advice:` and the name.
    statement: String,
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
                section: section.to_owned(),
                statement: statement(line, id),
            }),
            found => panic!("a statement names one rule, not {found:?}: {line}"),
        }
    }
    rules
}

/// The sentence of a line such as `- Advice: this is so. {id}`.
fn statement(line: &str, id: &str) -> String {
    let Some(sentence) = line.strip_prefix("- ").and_then(|line| line.strip_suffix(&format!(" `{{{id}}}`")))
    else {
        panic!("a rule is an item of a list and ends with its name: {line}");
    };
    match sentence.strip_prefix("Advice: ") {
        None => sentence.to_owned(),
        Some(advice) => advice[..1].to_uppercase() + &advice[1..],
    }
}

/// The index of rules at the end of the specification.
pub(crate) fn index(text: &str) -> String {
    let mut rules = rules(text);
    rules.sort_by(|left, right| left.id.cmp(&right.id));
    let mut table = "| rule | breaking it is | section |\n|---|---|---|\n".to_owned();
    for Rule { id, severity, section, .. } in rules {
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

#[test]
fn the_code_has_the_rules_of_the_text_word_for_word() {
    let stated = rules(&read_spec("open-structure.md"));
    let ids = |ids: &mut dyn Iterator<Item = String>| ids.collect::<BTreeSet<_>>();
    assert_eq!(
        ids(&mut RULES.iter().map(|rule| rule.id.to_owned())),
        ids(&mut stated.iter().map(|rule| rule.id.clone()))
    );
    for rule in &stated {
        let code = RULES.iter().find(|code| code.id == rule.id).unwrap();
        assert_eq!(code.severity.name(), rule.severity, "{}", rule.id);
        assert_eq!(code.section, rule.section, "{}", rule.id);
        assert_eq!(code.statement, rule.statement, "{}", rule.id);
    }
}

#[test]
fn the_conformance_corpus_has_a_folder_for_every_rule() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/conformance/invalid");
    let found: BTreeSet<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let stated = rules(&read_spec("open-structure.md"));
    assert_eq!(found, stated.into_iter().map(|rule| rule.id).collect());
}
