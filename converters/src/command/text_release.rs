//! `os-convert open-structure`: the first text release, converted.

use super::Outcome;
use super::progress::Progress;
use super::summary::{Failure, Report, Summary, render};
use crate::release::{Options, convert};
use crate::text_release::{Limits, SequenceSource, TextSequence, discover, read};
use anyhow::Context as _;
use open_structure::format::{self, Encoding, WriteOptions};
use open_structure::geometry::PinholeCamera;
use open_structure::storage::{self, Local};
use rayon::prelude::*;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

const EXAMPLES: &str = "\
Examples:
  os-convert open-structure box1/ -o box1.mcap              one sequence, one MCAP file
  os-convert open-structure box1/observation.zip -o box1    one sequence, a Parquet folder
  os-convert open-structure dataset/ -o out/                every sequence below dataset/, a Parquet folder each
  os-convert open-structure dataset/ -o out/ --format mcap  the same as out/<sequence>.mcap
  os-convert open-structure new/ -o new --camera 525,525,319.5,239.5,640,480

Where one sequence is found, OUT is that sequence; where several are, OUT is a folder with one entry for each.

Exit codes: 0 done; 1 failed; 2 misused; 3 done, and something was excluded or no known camera fits.";

/// Convert the first text release of Open-Structure
///
/// Reads observation and baseline archives (or folders) as they were published, decides by residuals what is truth and
/// what is measurement and which camera took it, recovers what the rest of the data determines, and tells what could
/// not be used.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Archives, folders of one sequence, or folders of many
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// The sequence (`x.mcap` a file, `x` or `x/` a Parquet folder), or a folder for several sequences
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Camera, instead of the known one that fits best
    #[arg(long, value_name = "FX,FY,CX,CY,WIDTH,HEIGHT", value_parser = parse_camera, allow_hyphen_values = true)]
    camera: Option<PinholeCamera>,
    /// Encoding; by default OUT's name decides, and several sequences become Parquet folders
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Replace what is there
    #[arg(long)]
    force: bool,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// Go on with the other sequences when one fails
    #[arg(long)]
    keep_going: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// One file
    Mcap,
    /// A folder with one file per table
    Parquet,
}

impl From<Format> for Encoding {
    fn from(format: Format) -> Self {
        match format {
            Format::Mcap => Self::Mcap,
            Format::Parquet => Self::Parquet,
        }
    }
}

fn parse_camera(text: &str) -> Result<PinholeCamera, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [fx, fy, cx, cy, width, height] = fields.as_slice() else {
        return Err(format!("expected six numbers with commas between, found {}", fields.len()));
    };
    let number = |text: &str| text.parse::<f64>().map_err(|error| format!("{text}: {error}"));
    let count = |text: &str| text.parse::<u32>().map_err(|error| format!("{text}: {error}"));
    let (fx, fy, cx, cy) = (number(fx)?, number(fy)?, number(cx)?, number(cy)?);
    if fx <= 0.0 {
        return Err(format!("expected a positive fx, found {fx}"));
    }
    PinholeCamera::new(fx, fy, cx, cy, count(width)?, count(height)?).map_err(|error| error.to_string())
}

/// Runs the command.
///
/// Results go to `stdout`, words about them to `stderr`.
///
/// # Errors
/// Where nothing can be found to convert, or a report cannot be printed. A sequence that fails is told and counted.
pub fn run(args: &Args, stdout: &mut dyn Write, stderr: &mut dyn Write) -> anyhow::Result<Outcome> {
    let limits = Limits::default();
    // What URLs name is copied here first.
    let local = |path: &PathBuf| Local::of(path, &[]).with_context(|| path.display().to_string());
    let inputs: Vec<Local> = args.paths.iter().map(local).collect::<anyhow::Result<_>>()?;
    let paths: Vec<PathBuf> = inputs.iter().map(|input| input.path().to_owned()).collect();
    let found = discover(&paths, &limits)?;
    let sources = &found.sequences;
    let places = match places(args, sources) {
        Ok(places) => places,
        Err(misuse) => {
            writeln!(stderr, "error: {misuse}")?;
            return Ok(Outcome::Misused);
        }
    };

    let progress = Progress::new(sources.len());
    let stop = AtomicBool::new(false);
    let results: Vec<Option<anyhow::Result<Summary>>> = sources
        .par_iter()
        .zip(&places)
        .map(|(source, (output, encoding))| {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let result = one(args, source, output, *encoding, &limits, &progress);
            if result.is_err() && !args.keep_going {
                stop.store(true, Ordering::Relaxed);
            }
            progress.done();
            Some(result)
        })
        .collect();
    progress.finish();

    let mut report = Report {
        tool: "os-convert",
        version: env!("CARGO_PKG_VERSION"),
        sequences: Vec::new(),
        failed: Vec::new(),
        passed_over: found.passed_over.listed().iter().map(ToString::to_string).collect(),
    };
    let mut skipped = 0;
    for (source, result) in sources.iter().zip(results) {
        match result {
            Some(Ok(summary)) => report.sequences.push(summary),
            Some(Err(error)) => {
                report.failed.push(Failure { sequence: source.name.clone(), error: format!("{error:#}") });
            }
            None => skipped += 1,
        }
    }
    if args.json {
        serde_json::to_writer_pretty(&mut *stdout, &report)?;
        writeln!(stdout)?;
    } else {
        stdout.write_all(render(&report).as_bytes())?;
    }
    for Failure { sequence, error } in &report.failed {
        writeln!(stderr, "error: {sequence}: {error}")?;
    }
    if skipped > 0 {
        writeln!(stderr, "{skipped} sequences were not converted; --keep-going goes on after a failure")?;
    }
    Ok(if !report.failed.is_empty() {
        Outcome::Failed
    } else if report.sequences.iter().any(Summary::has_findings) || !report.passed_over.is_empty() {
        Outcome::Findings
    } else {
        Outcome::Done
    })
}

/// Where each sequence goes, or what is wrong with the arguments.
fn places(args: &Args, sources: &[SequenceSource]) -> Result<Vec<(PathBuf, Encoding)>, String> {
    let output = &args.output;
    let named_mcap = Encoding::of_output(output) == Encoding::Mcap;
    if let [_] = sources {
        if named_mcap && args.format == Some(Format::Parquet) {
            return Err(format!(
                "{}: the name says MCAP and --format says Parquet; give another name",
                output.display()
            ));
        }
        let encoding = args.format.map_or_else(|| Encoding::of_output(output), Encoding::from);
        return Ok(vec![(output.clone(), encoding)]);
    }
    if named_mcap {
        return Err(format!(
            "{}: one MCAP file holds one sequence, and {} were found; give a folder: -o {} --format mcap",
            output.display(),
            sources.len(),
            output.with_extension("").display()
        ));
    }
    if storage::is_file(output) || storage::exists(&output.join("sequence.json")) {
        let what = if storage::is_file(output) { "is a file" } else { "is a sequence" };
        return Err(format!(
            "{}: {what}, and {} sequences were found; give another folder",
            output.display(),
            sources.len()
        ));
    }
    let encoding = args.format.map_or(Encoding::Parquet, Encoding::from);
    let place = |source: &SequenceSource| {
        let name = match encoding {
            Encoding::Mcap => format!("{}.mcap", source.name),
            Encoding::Parquet => source.name.clone(),
        };
        (output.join(name), encoding)
    };
    Ok(sources.iter().map(place).collect())
}

/// Reads, converts and writes one sequence.
fn one(
    args: &Args,
    source: &SequenceSource,
    output: &Path,
    encoding: Encoding,
    limits: &Limits,
    progress: &Progress,
) -> anyhow::Result<Summary> {
    // Known before the work is done, and looked at again when the output gets its name.
    if !args.force && storage::is_taken(output).with_context(|| output.display().to_string())? {
        return Err(format::Error::Exists { path: output.to_owned() }.into());
    }
    progress.stage(&source.name, "reading");
    let text = read(source, limits).with_context(|| format!("reading {}", source.place))?;
    progress.rows(rows(&text));
    progress.stage(&source.name, "converting");
    let converted = convert(&text, &Options { camera: args.camera })?;
    drop(text);
    progress.stage(&source.name, "writing");
    let options = WriteOptions { force: args.force, encoding: Some(encoding), ..WriteOptions::default() };
    format::write(output, &converted.sequence, options)?;
    Ok(Summary::of(&converted, output, encoding))
}

/// Rows of observations.
fn rows(text: &TextSequence) -> u64 {
    let files = text.association.iter().chain(&text.graph);
    files.map(|file| (file.rows.point_observations.len() + file.rows.line_observations.len()) as u64).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_six_numbers() {
        let camera = parse_camera("481.2, -480, 319.5,239.5,640,480").unwrap();
        assert_eq!((camera.fy, camera.width), (-480.0, 640));
        for wrong in [
            "",
            "1,2,3",
            "1,2,3,4,5,6,7",
            "1,2,3,4,0,6",
            "-1,2,3,4,5,6",
            "x,2,3,4,5,6",
            "1,0,3,4,5,6",
            "1,2,3,nan,5,6",
        ] {
            assert!(parse_camera(wrong).is_err(), "{wrong}");
        }
    }
}
