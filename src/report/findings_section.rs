//! What the validator found.

use maud::{Markup, html};

use super::SequenceReport;
use super::numbers::count;
use super::summary_section::verdict;
use crate::validate::{Finding, RuleCount, rule};

pub(super) fn section(report: &SequenceReport) -> Markup {
    let found = &report.validation;
    let (class, words) = verdict(report);
    html! {
        p {
            span class=(format!("badge {class}")) { (words) }
            " " (count(found.rows_checked())) " rows checked against version "
            (found.spec_version.as_deref().unwrap_or("?")) " of the specification."
        }
        @if found.rules.is_empty() {
            p.nothing { "Every rule holds." }
        }
        @for rule in &found.rules {
            (broken(rule, found.findings.iter().chain(&found.advice)))
        }
    }
}

fn broken<'a>(broken: &RuleCount, findings: impl Iterator<Item = &'a Finding>) -> Markup {
    let of_rule: Vec<&Finding> =
        findings.filter(|finding| finding.rule == broken.rule && finding.table == broken.table).collect();
    let rule = rule(broken.rule);
    html! {
        details.finding open[broken.severity > crate::validate::Severity::Advice] {
            summary {
                span class=(format!("badge {}", broken.severity.name())) { (broken.severity.name()) }
                " " code { (broken.rule) }
                @if let Some(table) = broken.table { " in " code { (table) } }
                ", " (count(broken.count)) @if broken.count == 1 { " time" } @else { " times" }
            }
            @if let Some(rule) = rule { p { (with_code(rule.statement)) } }
            @if let Some(why) = rule.and_then(|rule| rule.why) { p.note { "Why? " (with_code(why)) } }
            div.wide tabindex="0" role="group" aria-label=(format!("Findings of {}", broken.rule)) {
                table {
                    thead { tr { th scope="col" { "where" } th.words scope="col" { "expected" } th.words scope="col" { "found" } th scope="col" { "alike" } } }
                    tbody {
                        @for finding in &of_rule {
                            tr {
                                th scope="row" { (place(finding)) }
                                td.words { (finding.expected) }
                                td.words { (finding.found) }
                                td { (count(finding.count)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Text whose parts between backticks are names.
fn with_code(text: &str) -> Markup {
    html! {
        @for (index, part) in text.split('`').enumerate() {
            @if index % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

fn place(finding: &Finding) -> String {
    let row = finding.row.map(|row| format!("row {row}"));
    let parts: Vec<String> = row.into_iter().chain(finding.id.clone()).collect();
    if parts.is_empty() { "the whole".to_owned() } else { parts.join(", ") }
}
