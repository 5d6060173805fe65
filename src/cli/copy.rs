//! `os copy`: a sequence into the other encoding.

use std::io::{self, Write};
use std::path::PathBuf;

use super::progress::Progress;
use super::{Outcome, left_behind, text};
use crate::format::{self, Encoding, WriteOptions};
use crate::storage;

/// Copy a sequence, from one encoding into the other or into the same.
///
/// Nothing is changed but the container: every number keeps its bits and every table its digest.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os copy box1 -o box1.mcap
  os copy box1.mcap -o box1
  os copy box1 -o box1-viewer.mcap --foxglove")]
pub(super) struct Args {
    /// Sequence: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    /// Add channels with Foxglove's schemas, so that viewers show the sequence (MCAP only).
    #[arg(long)]
    foxglove: bool,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.foxglove && Encoding::of_output(&args.output) != Encoding::Mcap {
        anyhow::bail!(
            "--foxglove adds channels to an MCAP file; {} would be a Parquet folder",
            args.output.display()
        );
    }
    let reader = format::open(&args.sequence)?;
    if storage::exists(&args.output) && storage::same(&args.output, &args.sequence) {
        anyhow::bail!("{}: is the input itself", args.output.display());
    }
    let mut outcome = left_behind::warn(&reader)?;
    let mut stderr = io::stderr();
    let progress = Progress::new("copying", "frames");
    let options = WriteOptions { force: args.force, foxglove: args.foxglove, ..WriteOptions::default() };
    let written = format::copy(&reader, &args.output, options, &|done, total| progress.update(done, total))?;
    drop(progress);
    for summary in &reader.manifest().tables {
        let copied = written.tables.iter().find(|table| table.table == summary.table);
        if copied.is_some_and(|copied| copied != summary) {
            writeln!(
                stderr,
                "warning: {} is not what the input's summary says; try `os validate`",
                summary.table
            )?;
            outcome = Outcome::Findings;
        }
    }
    let rows: u64 = written.tables.iter().map(|table| table.rows).sum();
    writeln!(
        stdout,
        "{}: {} rows in {} tables, {}",
        args.output.display(),
        text::count(rows),
        written.tables.len(),
        text::bytes(format::stored_bytes(&args.output))
    )?;
    Ok(outcome)
}
