//! What was found: one broken rule, where, what was expected and what is there.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::rules::{RuleId, Severity};

/// One broken rule at one place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Finding {
    /// Id of the rule.
    pub rule: &'static str,
    /// What breaking the rule means.
    pub severity: Severity,
    /// Table concerned, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<&'static str>,
    /// Row concerned, counted from 0; the first one where the finding stands for several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row: Option<u64>,
    /// Thing concerned, such as `point 7`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// What should be there.
    pub expected: String,
    /// What is there.
    pub found: String,
    /// How many alike the finding stands for; 1 when it stands for itself.
    pub count: u64,
}

/// The particulars of a finding.
pub(crate) struct Detail {
    row: Option<u64>,
    id: Option<String>,
    expected: String,
    found: String,
}

impl Detail {
    pub(crate) fn new(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { row: None, id: None, expected: expected.into(), found: found.into() }
    }

    pub(crate) fn row(mut self, row: u64) -> Self {
        self.row = Some(row);
        self
    }

    pub(crate) fn id(mut self, id: impl std::fmt::Display) -> Self {
        self.id = Some(id.to_string());
        self
    }
}

/// Findings of one rule in one table.
#[derive(Clone, Debug, Default)]
struct Bucket {
    kept: Vec<Finding>,
    count: u64,
}

/// Collects findings: the first ones of each rule and table, all of them counted.
#[derive(Clone, Debug)]
pub(crate) struct Findings {
    cap: usize,
    buckets: BTreeMap<(RuleId, Option<&'static str>), Bucket>,
}

/// Longest text of a finding that is kept; what a hostile file calls itself may be longer.
const LONGEST_TEXT: usize = 400;

fn shortened(mut text: String) -> String {
    if text.len() > LONGEST_TEXT {
        let end = (0..=LONGEST_TEXT).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
        text.truncate(end);
        text.push('…');
    }
    text
}

impl Findings {
    pub(crate) fn new(cap: usize) -> Self {
        Self { cap, buckets: BTreeMap::new() }
    }

    /// A collector of the same kind, for work done elsewhere; see [`merge`](Self::merge).
    pub(crate) fn fresh(&self) -> Self {
        Self::new(self.cap)
    }

    /// Adds a finding; its texts are made only when it is kept.
    pub(crate) fn add(&mut self, rule: RuleId, table: Option<&'static str>, detail: impl FnOnce() -> Detail) {
        self.add_many(rule, table, 1, detail);
    }

    /// Adds a finding that stands for several alike.
    pub(crate) fn add_many(
        &mut self,
        rule: RuleId,
        table: Option<&'static str>,
        count: u64,
        detail: impl FnOnce() -> Detail,
    ) {
        let bucket = self.buckets.entry((rule, table)).or_default();
        bucket.count += count;
        if bucket.kept.len() < self.cap {
            let Detail { row, id, expected, found } = detail();
            bucket.kept.push(Finding {
                rule: rule.rule().id,
                severity: rule.rule().severity,
                table,
                row,
                id: id.map(shortened),
                expected: shortened(expected),
                found: shortened(found),
                count,
            });
        }
    }

    /// Takes in what was collected elsewhere, after what is here.
    pub(crate) fn merge(&mut self, other: Self) {
        for (key, bucket) in other.buckets {
            let here = self.buckets.entry(key).or_default();
            here.count += bucket.count;
            let room = self.cap.saturating_sub(here.kept.len());
            here.kept.extend(bucket.kept.into_iter().take(room));
        }
    }

    /// Drops what was found against a rule that could not be judged after all.
    pub(crate) fn forget(&mut self, rule: RuleId, table: impl Fn(Option<&'static str>) -> bool) {
        self.buckets.retain(|(found, place), _| *found != rule || !table(*place));
    }

    /// Findings and counts, by rule in the order of the specification, then by table.
    pub(crate) fn into_parts(
        self,
    ) -> impl Iterator<Item = (RuleId, Option<&'static str>, u64, Vec<Finding>)> {
        self.buckets.into_iter().map(|((rule, table), bucket)| (rule, table, bucket.count, bucket.kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn add(findings: &mut Findings, table: &'static str, row: u64) {
        findings.add(RuleId::RowsOrdered, Some(table), || Detail::new("up", "down").row(row));
    }

    #[test]
    fn findings_are_capped_for_each_table_and_counted_in_full() {
        let mut findings = Findings::new(2);
        (0..5).for_each(|row| add(&mut findings, "frames", row));
        add(&mut findings, "trajectories", 9);
        let parts: Vec<_> = findings.into_parts().collect();
        assert_eq!(parts.len(), 2);
        assert_eq!((parts[0].1, parts[0].2, parts[0].3.len()), (Some("frames"), 5, 2));
        assert_eq!(parts[0].3[1].row, Some(1));
        assert_eq!((parts[1].1, parts[1].2), (Some("trajectories"), 1));
    }

    #[test]
    fn merging_keeps_the_first_ones() {
        let (mut left, mut right) = (Findings::new(2), Findings::new(2));
        add(&mut left, "frames", 1);
        (7..9).for_each(|row| add(&mut right, "frames", row));
        left.merge(right);
        let (_, _, count, kept) = left.into_parts().next().unwrap();
        assert_eq!(count, 3);
        assert_eq!(kept.iter().map(|finding| finding.row).collect::<Vec<_>>(), [Some(1), Some(7)]);
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        let text = shortened("é".repeat(LONGEST_TEXT));
        assert!(text.len() <= LONGEST_TEXT + '…'.len_utf8() && text.ends_with("é…"));
        assert_eq!(shortened("short".to_owned()), "short");
    }
}
