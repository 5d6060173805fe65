//! `os explain`: what a rule asks for, and why.

use std::io::Write;

use anyhow::Context;

use super::{Outcome, text};
use crate::validate::{RULES, rule};

/// Explain a rule of the specification; without a name, list them all.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os explain
  os explain group-lines-parallel")]
pub(super) struct Args {
    /// Rule name, as findings show it.
    rule: Option<String>,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Some(name) = &args.rule else {
        let mut table = text::table(["RULE", "SEVERITY", "STATEMENT"], &[]);
        for rule in RULES {
            table.add_row([rule.id, rule.severity.name(), rule.statement]);
        }
        writeln!(stdout, "{}", text::lines(&table))?;
        return Ok(Outcome::Done);
    };
    let name = name.trim_matches(['{', '}', '`']);
    let rule = rule(name).with_context(|| match nearest(name) {
        Some(other) => format!("there is no rule `{name}`; did you mean `{other}`?"),
        None => format!("there is no rule `{name}`; `os explain` lists them"),
    })?;
    writeln!(
        stdout,
        "{} ({}, section {})\n\n{}",
        rule.id,
        rule.severity.name(),
        rule.section,
        rule.statement
    )?;
    if let Some(why) = rule.why {
        writeln!(stdout, "\nWhy? {why}")?;
    }
    Ok(Outcome::Done)
}

/// The rule that shares most words with a name.
fn nearest(name: &str) -> Option<&'static str> {
    let shared = |id: &str| id.split('-').filter(|word| name.split('-').any(|other| other == *word)).count();
    RULES.iter().map(|rule| rule.id).max_by_key(|id| shared(id)).filter(|id| shared(id) > 0)
}
