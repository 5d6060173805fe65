//! `os validate`: every rule of the specification, held against sequences.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::ValueEnum;

use super::progress::Progress;
use super::{Outcome, text};
use crate::format::Collection;
use crate::validate::{Finding, Options, Report, Severity, validate};

/// Check sequences against the specification.
///
/// Every rule is checked: structure, references, numbers, and whether measurements, landmarks and
/// declared noise agree. Errors break a MUST, warnings a SHOULD; advice has no part in conformance.
/// `os explain RULE` says what a rule asks for and why.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os validate box1.mcap
  os validate out/* --deny warnings
  os validate all                        a collection: its catalogue, then each sequence
  os validate box1 --json | jq '.findings[].rule'

Exit codes: 0 conformant, 1 a path cannot be read, 2 misused, 3 errors found (or warnings, if denied).")]
pub(super) struct Args {
    /// Sequences: MCAP files or Parquet folders; collections: their catalogue and each of their sequences.
    #[arg(required = true)]
    sequences: Vec<PathBuf>,
    /// Print one JSON report a line; its schema is `os schema validation_report`.
    #[arg(long)]
    json: bool,
    /// Treat warnings as errors.
    #[arg(long, value_enum, value_name = "WHAT")]
    deny: Option<Deny>,
    /// Findings listed for each rule and table; all are counted.
    #[arg(long, value_name = "N", default_value_t = 5)]
    max_findings: usize,
    /// Say nothing of sequences without findings.
    #[arg(short, long)]
    quiet: bool,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Deny {
    /// Warnings end in exit code 3, as errors do.
    Warnings,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let denied = if args.deny.is_some() { Severity::Warning } else { Severity::Error };
    let mut outcome = Outcome::Done;
    let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    for path in &expanded(&args.sequences) {
        let progress = Progress::new(path.display().to_string(), "rows");
        let update = |done, total| progress.update(done, total);
        let options = Options { listed: args.max_findings, progress: Some(&update), ..Options::default() };
        let report = validate(path, &options)?;
        drop(progress);
        if report.worst() >= Some(denied) {
            outcome = Outcome::Findings;
        }
        if args.json {
            serde_json::to_writer(&mut *stdout, &report)?;
            writeln!(stdout)?;
        } else if !args.quiet || report.worst().is_some() {
            print(&report, colour, stdout)?;
        }
        stdout.flush()?;
    }
    Ok(outcome)
}

/// Each path, and after a collection its sequences.
fn expanded(paths: &[PathBuf]) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for path in paths {
        all.push(path.clone());
        // A path that cannot be looked into is told of when its turn comes.
        if let Ok(Some(collection)) = Collection::at(path) {
            all.extend(collection.members.into_iter().map(|member| member.path));
        }
    }
    all
}

fn print(report: &Report, colour: bool, out: &mut dyn Write) -> anyhow::Result<()> {
    let counts = [
        (Severity::Error, "error", "errors"),
        (Severity::Warning, "warning", "warnings"),
        (Severity::Advice, "piece of advice", "pieces of advice"),
    ]
    .map(|(severity, one, many)| {
        let count = report.count(severity);
        format!("{} {}", text::count(count), if count == 1 { one } else { many })
    });
    let verdict = if report.conformant { "conformant" } else { "not conformant" };
    writeln!(
        out,
        "{}: {verdict}; {} rows checked, {}",
        report.path.as_deref().unwrap_or("sequence"),
        text::count(report.rows_checked()),
        counts.join(", ")
    )?;
    for rule in &report.rules {
        let of_rule = |finding: &&Finding| finding.rule == rule.rule && finding.table == rule.table;
        let mut told = 0;
        for finding in report.findings.iter().chain(&report.advice).filter(of_rule) {
            told += finding.count;
            writeln!(out, "  {}", line(finding, colour))?;
        }
        if rule.count > told {
            let table = rule.table.map(|table| format!(" in {table}")).unwrap_or_default();
            writeln!(out, "  … {} more of {}{table}", text::count(rule.count - told), rule.rule)?;
        }
    }
    Ok(())
}

fn line(finding: &Finding, colour: bool) -> String {
    let (on, off) = match (colour, finding.severity) {
        (false, _) => ("", ""),
        (true, Severity::Error) => ("\u{1b}[31m", "\u{1b}[0m"),
        (true, Severity::Warning) => ("\u{1b}[33m", "\u{1b}[0m"),
        (true, Severity::Advice) => ("\u{1b}[36m", "\u{1b}[0m"),
    };
    let mut place: Vec<String> = finding.table.into_iter().map(str::to_owned).collect();
    place.extend(finding.row.map(|row| format!("row {row}")));
    place.extend(finding.id.clone());
    let place = if place.is_empty() { String::new() } else { format!(" {}:", place.join(", ")) };
    let many = if finding.count > 1 {
        format!(" (and {} alike)", text::count(finding.count - 1))
    } else {
        String::new()
    };
    format!(
        "{on}{}{off} {}{place} expected {}; found {}{many}",
        finding.severity.name(),
        finding.rule,
        finding.expected,
        finding.found
    )
}
