//! A good sequence, and what is said when one thing is wrong with it.

mod good;
mod memory;
mod noise_models;
mod statistics;
mod stored;

use std::collections::BTreeSet;

use super::{Options, Report, Severity, validate_sequence};
use crate::structure::Sequence;

/// Errors and warnings of a sequence in memory, as names of rules.
fn broken(sequence: &Sequence) -> BTreeSet<&'static str> {
    names(&validate_sequence(sequence, &Options::default()))
}

fn names(report: &Report) -> BTreeSet<&'static str> {
    report.rules.iter().filter(|rule| rule.severity != Severity::Advice).map(|rule| rule.rule).collect()
}

fn advised(report: &Report) -> BTreeSet<&'static str> {
    report.rules.iter().filter(|rule| rule.severity == Severity::Advice).map(|rule| rule.rule).collect()
}

/// Holds that a damage breaks one rule and no other.
#[track_caller]
fn breaks_only(rule: &str, damage: impl FnOnce(&mut Sequence)) -> Report {
    let mut sequence = good::sequence();
    damage(&mut sequence);
    let report = validate_sequence(&sequence, &Options::default());
    let found: Vec<_> = report.findings.iter().chain(&report.advice).collect();
    assert_eq!(names(&report), BTreeSet::from([rule]), "{found:#?}");
    report
}
