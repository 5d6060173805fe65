//! `os cat`: the rows of a table as text.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::ValueEnum;
use serde_json::Value;

use super::Outcome;
use crate::format::{self, SequenceReader};
use crate::structure::{
    CATALOGUE, CatalogueEntry, FrameId, Record, Sequence, Storage, TABLES, for_each_table,
};

/// Print the rows of a table as JSON lines or CSV.
///
/// Absent values are left out of JSON rows and are empty in CSV. Floats have as many digits as are
/// needed to read the same number back. Every JSON row satisfies `os schema TABLE`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os cat box1.mcap point_measurements --limit 3
  os cat box1 line_landmarks --format csv > lines.csv
  os cat box1 point_measurements --frame 17
  os cat box1 manifest | jq .cameras")]
pub(super) struct Args {
    /// Sequence: an MCAP file or a Parquet folder; for the catalogue, a collection.
    sequence: PathBuf,
    /// Table name, or `manifest`; `catalogue` of a collection.
    table: String,
    /// How rows are written.
    #[arg(long, value_enum, default_value_t = Format::Json)]
    format: Format,
    /// Only the rows of one frame (per-frame tables).
    #[arg(long, value_name = "ID", allow_negative_numbers = true)]
    frame: Option<i64>,
    /// At most so many rows.
    #[arg(long, value_name = "N")]
    limit: Option<usize>,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// One JSON object a line.
    Json,
    /// Comma-separated values with a header; lists are JSON arrays in quotes.
    Csv,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if !["manifest", CATALOGUE.name].contains(&args.table.as_str())
        && TABLES.iter().all(|table| table.name != args.table)
    {
        let names: Vec<&str> = TABLES.iter().map(|table| table.name).collect();
        bail!("there is no table `{}`; expected manifest, {}", args.table, names.join(", "));
    }
    if args.table == CATALOGUE.name {
        return catalogue(args, stdout);
    }
    let reader = format::open(&args.sequence)?;
    if args.table == "manifest" {
        serde_json::to_writer_pretty(&mut *stdout, reader.manifest())?;
        writeln!(stdout)?;
        return Ok(Outcome::Done);
    }
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            match args.table.as_str() {
                $(stringify!($name) => print::<crate::structure::$row>(args, &reader, stdout)?,)+
                _ => {}
            }
        };
    }
    for_each_table!(each);
    Ok(Outcome::Done)
}

/// The catalogue of a collection, as it stands there.
fn catalogue(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.frame.is_some() {
        bail!("{} has no column frame_id; leave --frame out", CATALOGUE.name);
    }
    print_header::<CatalogueEntry>(args.format, stdout)?;
    let rows = format::read_catalogue(&args.sequence)?;
    print_rows(args.format, &rows, &mut args.limit.unwrap_or(usize::MAX), stdout)?;
    Ok(Outcome::Done)
}

fn print_header<R: Record>(format: Format, stdout: &mut dyn Write) -> anyhow::Result<()> {
    if format == Format::Csv {
        let names: Vec<&str> = R::TABLE.fields.iter().map(|field| field.name).collect();
        writeln!(stdout, "{}", names.join(","))?;
    }
    Ok(())
}

fn print<R: Record>(args: &Args, reader: &SequenceReader, stdout: &mut dyn Write) -> anyhow::Result<()> {
    if !reader.has::<R>() {
        bail!("{}: has no table {}", args.sequence.display(), R::TABLE.name);
    }
    print_header::<R>(args.format, stdout)?;
    let mut left = args.limit.unwrap_or(usize::MAX);
    if let Some(frame) = args.frame {
        let Some(rows) = rows_of_frame::<R>(reader, FrameId(frame))? else {
            bail!("{}: there is no frame {frame}", args.sequence.display());
        };
        return print_rows(args.format, &rows, &mut left, stdout);
    }
    for batch in reader.batches::<R>()? {
        if left == 0 {
            break;
        }
        print_rows(args.format, &batch?, &mut left, stdout)?;
    }
    Ok(())
}

/// The rows of a frame: through the index for per-frame tables, by looking at all rows for the others.
fn rows_of_frame<R: Record>(reader: &SequenceReader, frame_id: FrameId) -> anyhow::Result<Option<Vec<R>>> {
    if R::TABLE.storage == Storage::PerFrame {
        let Some(bundle) = reader.frame_of(frame_id, &|table| table == R::TABLE.name)? else {
            return Ok(None);
        };
        let sequence = Sequence {
            point_observations: bundle.point_observations,
            line_observations: bundle.line_observations,
            point_measurements: bundle.point_measurements,
            line_measurements: bundle.line_measurements,
            ..Sequence::default()
        };
        return Ok(Some(R::rows(&sequence).to_vec()));
    }
    if reader.frame_list()?.iter().all(|frame| frame.frame_id != frame_id) {
        return Ok(None);
    }
    if R::TABLE.fields.iter().all(|field| field.name != "frame_id") {
        bail!("{} has no column frame_id; leave --frame out", R::TABLE.name);
    }
    let id = Value::from(frame_id.0);
    let mut rows = Vec::new();
    for batch in reader.batches::<R>()? {
        for row in batch? {
            if serde_json::to_value(&row)?.get("frame_id") == Some(&id) {
                rows.push(row);
            }
        }
    }
    Ok(Some(rows))
}

fn print_rows<R: Record>(
    format: Format,
    rows: &[R],
    left: &mut usize,
    stdout: &mut dyn Write,
) -> anyhow::Result<()> {
    for row in rows.iter().take(*left) {
        match format {
            Format::Json => serde_json::to_writer(&mut *stdout, row)?,
            Format::Csv => {
                let value = serde_json::to_value(row).context("a row that JSON cannot hold")?;
                let cells: Vec<String> =
                    R::TABLE.fields.iter().map(|field| cell(value.get(field.name))).collect();
                write!(stdout, "{}", cells.join(","))?;
            }
        }
        writeln!(stdout)?;
    }
    *left = left.saturating_sub(rows.len());
    Ok(())
}

fn cell(value: Option<&Value>) -> String {
    let text = match value {
        None | Some(Value::Null) => return String::new(),
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
    };
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}
