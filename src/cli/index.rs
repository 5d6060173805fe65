//! `os index`: the catalogue of a collection.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail};

use super::progress::Progress;
use super::{Outcome, text};
use crate::format::{Collection, write_catalogue};
use crate::storage;
use crate::structure::CatalogueEntry;

/// Write the catalogue of a collection: a row for each of its sequences.
///
/// A collection is a folder of Parquet sequences that are called `sequence=NAME`, so that duckdb, polars, Spark and Dask query
/// all of them at once. The catalogue, `catalogue.parquet`, says what is in each: origin, frames, landmarks, measurements, the
/// path, estimates. Commands that take several sequences take a collection for all of its own.
///
/// A sequence that cannot be read is an error, and the catalogue stays as it was.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os simulate box1 -o all/sequence=box1
  os copy desk.mcap -o all/sequence=desk
  os index all
  os index out --adopt                   out/box1 becomes out/sequence=box1
  os cat all catalogue --limit 1")]
pub(super) struct Args {
    /// Folder of the collection.
    collection: PathBuf,
    /// Rename Parquet folders in it that are not called `sequence=NAME`, each by the name in its manifest.
    #[arg(long)]
    adopt: bool,
    /// Replace a catalogue that is there.
    #[arg(long)]
    force: bool,
    /// Print the rows as JSON lines.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let folder = &args.collection;
    if storage::exists(&folder.join("sequence.json")) {
        bail!("{}: a sequence; expected a folder of sequences called sequence=NAME", folder.display());
    }
    let mut collection = Collection::open(folder)?;
    if collection.has_catalogue && !args.force {
        bail!("{}: exists already; --force replaces it", collection.catalogue().display());
    }
    if args.adopt {
        for (before, after) in collection.adopt()? {
            let name = after.file_name().unwrap_or_default().to_string_lossy().into_owned();
            writeln!(std::io::stderr(), "{}: now {name}", before.display())?;
        }
    }
    collection.refuse_outside()?;
    if collection.members.is_empty() {
        bail!("{}: no sequences; expected folders called sequence=NAME", folder.display());
    }
    let progress = Progress::new("indexing", "sequences");
    let entries = collection.entries(Some(&|done, total| progress.update(done, total)));
    drop(progress);
    let entries = collection
        .members
        .iter()
        .zip(entries)
        .map(|(member, entry)| entry.with_context(|| format!("sequence {}", member.name)))
        .collect::<anyhow::Result<Vec<CatalogueEntry>>>()?;
    write_catalogue(folder, &entries, args.force)?;
    if args.json {
        for entry in &entries {
            serde_json::to_writer(&mut *stdout, entry)?;
            writeln!(stdout)?;
        }
        return Ok(Outcome::Done);
    }
    let sum = |number: fn(&CatalogueEntry) -> i64| {
        entries.iter().map(|entry| u64::try_from(number(entry)).unwrap_or(0)).fold(0, u64::saturating_add)
    };
    writeln!(
        stdout,
        "{}: {} {}, {} frames, {} rows, {}",
        collection.catalogue().display(),
        text::count(entries.len() as u64),
        if entries.len() == 1 { "sequence" } else { "sequences" },
        text::count(sum(|entry| entry.frames)),
        text::count(sum(|entry| entry.total_rows)),
        text::bytes(sum(|entry| entry.bytes)),
    )?;
    Ok(Outcome::Done)
}
