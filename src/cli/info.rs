//! `os info`: what is in a sequence, at a glance.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use serde::Serialize;

use super::{Outcome, inputs, text};
use crate::format::{self, SequenceReader};
use crate::structure::{Camera, Frame, Manifest, Noise, TrajectoryPose};

/// Show what is in a sequence: origin, cameras, frames, tables, noise, what was recovered or left out.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os info box1.mcap
  os info out/*
  os info box1 --json | jq .tables")]
pub(super) struct Args {
    /// Sequences: MCAP files, Parquet folders or collections.
    #[arg(required = true)]
    sequences: Vec<PathBuf>,
    /// Print one JSON object per sequence.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Info<'a> {
    path: String,
    encoding: &'static str,
    bytes: u64,
    frame_count: usize,
    frames_with_truth: usize,
    duration_seconds: f64,
    estimates: Vec<String>,
    tables: BTreeMap<&'static str, Option<u64>>,
    passed_over: &'a [String],
    manifest: &'a Manifest,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    for (index, path) in inputs::sequences(&args.sequences)?.iter().enumerate() {
        let reader = format::open(path)?;
        let frames = reader.frame_list()?;
        if args.json {
            serde_json::to_writer(&mut *stdout, &info(&reader, frames)?)?;
            writeln!(stdout)?;
        } else {
            if index > 0 {
                writeln!(stdout)?;
            }
            print(&info(&reader, frames)?, frames, stdout)?;
        }
    }
    Ok(Outcome::Done)
}

fn info<'a>(reader: &'a SequenceReader, frames: &[Frame]) -> anyhow::Result<Info<'a>> {
    let stamps = frames.iter().map(|frame| frame.stamp_nanos);
    let span = stamps.clone().max().unwrap_or(0).saturating_sub(stamps.min().unwrap_or(0));
    let mut estimates: Vec<String> = Vec::new();
    for batch in reader.batches::<TrajectoryPose>()? {
        for row in batch? {
            if estimates.last() != Some(&row.estimate) {
                estimates.push(row.estimate);
            }
        }
    }
    let rows = |name: &str, stored: Option<u64>| {
        reader.manifest().table(name).map(|summary| summary.rows).or(stored)
    };
    Ok(Info {
        path: reader.path().display().to_string(),
        encoding: reader.encoding().name(),
        bytes: format::stored_bytes(reader.path()),
        frame_count: frames.len(),
        frames_with_truth: frames.iter().filter(|frame| frame.world_from_camera().is_some()).count(),
        duration_seconds: span as f64 * 1e-9,
        estimates,
        tables: reader
            .tables()
            .iter()
            .map(|stored| (stored.table.name, rows(stored.table.name, stored.rows)))
            .collect(),
        passed_over: reader.passed_over(),
        manifest: reader.manifest(),
    })
}

fn print(info: &Info<'_>, frames: &[Frame], out: &mut dyn Write) -> anyhow::Result<()> {
    let manifest = info.manifest;
    writeln!(out, "{}", manifest.name)?;
    let mut line = |name: &str, value: String| writeln!(out, "  {name:<11}{value}");
    line("file", format!("{} ({}, {})", info.path, info.encoding, text::bytes(info.bytes)))?;
    line("spec", manifest.spec_version.clone())?;
    let source = &manifest.source;
    line(
        "source",
        source.sequence.iter().fold(source.dataset.clone(), |text, sequence| format!("{text}, {sequence}")),
    )?;
    if let Some(licence) = &source.licence {
        line("licence", licence.clone())?;
    }
    let generator = &manifest.generator;
    let seed = generator.seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
    line("made by", format!("{} {}{seed}", generator.tool, generator.version))?;
    for camera in &manifest.cameras {
        line("camera", camera_text(camera))?;
    }
    let rate = if info.duration_seconds > 0.0 {
        format!(
            ", {:.1} s at {:.1} Hz",
            info.duration_seconds,
            (frames.len() - 1) as f64 / info.duration_seconds
        )
    } else {
        String::new()
    };
    let clock = &manifest.clock.kind;
    line(
        "frames",
        format!(
            "{}{rate} ({clock} clock); true pose of {}",
            text::count(frames.len() as u64),
            text::count(info.frames_with_truth as u64)
        ),
    )?;
    line("noise", manifest.noise.as_ref().map_or_else(|| "not declared".to_owned(), noise_text))?;
    if !info.estimates.is_empty() {
        line("estimates", info.estimates.join(", "))?;
    }
    for recovery in &manifest.recovered {
        let columns = if recovery.columns.is_empty() {
            String::new()
        } else {
            format!(" ({})", recovery.columns.join(", "))
        };
        line(
            "recovered",
            format!(
                "{} rows of {}{columns}: {}",
                text::count(recovery.rows),
                recovery.table,
                recovery.method
            ),
        )?;
    }
    for exclusion in &manifest.excluded {
        let first = exclusion.first_line.map(|line| format!(", first line {line}")).unwrap_or_default();
        line(
            "excluded",
            format!("{} from {}{first}: {}", text::count(exclusion.count), exclusion.file, exclusion.reason),
        )?;
    }
    for name in info.passed_over {
        line("unknown", name.clone())?;
    }
    let mut table = text::table(["TABLE", "ROWS"], &[1]);
    for (name, rows) in ordered(&info.tables) {
        table.add_row([name.to_owned(), rows.map_or_else(|| "?".to_owned(), text::count)]);
    }
    for row in text::lines(&table).lines() {
        writeln!(out, "  {}", row.trim_start())?;
    }
    Ok(())
}

/// Tables in the order of the specification.
fn ordered(tables: &BTreeMap<&'static str, Option<u64>>) -> Vec<(&'static str, Option<u64>)> {
    crate::structure::TABLES
        .iter()
        .filter_map(|table| tables.get(table.name).map(|rows| (table.name, *rows)))
        .collect()
}

fn camera_text(camera: &Camera) -> String {
    format!(
        "{} {} {}x{} px, fx {} fy {} cx {} cy {} px, {}, origin at {}",
        camera.camera_id.0,
        camera.model,
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        camera.axes,
        camera.pixel_origin
    )
}

fn noise_text(noise: &Noise) -> String {
    let parameters: Vec<String> =
        noise.parameters.iter().map(|(name, value)| format!("{name} {value}")).collect();
    let seed = noise.seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
    if parameters.is_empty() {
        format!("{}{seed}", noise.model)
    } else {
        format!("{}: {}{seed}", noise.model, parameters.join(", "))
    }
}
