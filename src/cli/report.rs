//! `os report`: sequences and results as one HTML file.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::progress::Stages;
use super::{Outcome, evaluate_output, inputs, plot, text};
use crate::format::Partial;
use crate::report::{Report, ReportOptions};
use crate::storage;

/// Show sequences and results as one HTML file: scene, frames, statistics, errors, convergence, findings.
///
/// The file needs nothing else and fetches nothing; it can be sent, kept and printed. Sequences are validated, and their estimates
/// compared with the truth as `os evaluate` does where no option is given. Beside sequences there may be what `os evaluate`,
/// `os adjust` and `os benchmark` print with --json, and folders of `os benchmark`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os report box1.mcap -o report.html
  os report box1 corridor1 -o both.html
  os report adjusted.mcap results/ -o report.html
  os evaluate box1 corridor1 --json > errors.json; os report errors.json -o errors.html

Exit codes: 0 done, 1 failed, 2 misused, 3 done, but a sequence is not conformant or an estimate could not be compared.")]
pub(super) struct Args {
    /// Sequences (MCAP files or Parquet folders), JSON of other commands, folders of `os benchmark`.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Output: an HTML file.
    #[arg(short, long, value_name = "FILE.html", value_parser = html_file)]
    output: PathBuf,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

/// The file of a report.
fn html_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_html = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("html"));
    if is_html { Ok(path) } else { Err("expected a name that ends in .html".to_owned()) }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let output = &args.output;
    evaluate_output::refuse_input(output, &args.inputs)?;
    // Reserved before the work begins.
    let partial = Partial::file(output, args.force)?;
    let stages = Stages::default();
    let update = |stage, done, total| {
        let unit = if stage == "validating" { "rows" } else { "frames" };
        stages.update_in(stage, unit, done, total);
    };
    let inputs = inputs::sequences(&args.inputs)?;
    let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    let report = Report::of(&inputs, &ReportOptions { edges: Some(&plot::edges), progress: Some(&update) })?;
    drop(stages);
    fs::write(partial.path(), report.html()?).with_context(|| output.display().to_string())?;
    partial.finish()?;
    let size = storage::size(output, &[]);
    writeln!(stdout, "{}: {}", output.display(), text::bytes(size))?;
    Ok(if report.has_findings() { Outcome::Findings } else { Outcome::Done })
}
