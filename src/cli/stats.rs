//! `os stats`: what sequences are like, in numbers and small charts.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use super::chart::chart;
use super::progress::Progress;
use super::{Outcome, inputs, text};
use crate::format;
use crate::statistics::{
    Analysed, Analysis, Counted, Difference, Distribution, FeatureStatistics, SequenceStatistics,
};
use crate::structure::{
    FrameStatistics, LineMeasurement, MotionGrade, PointMeasurement, Record, StructuralGroup,
};

/// Show what sequences are like: features, tracks, covisibility, parallax, motion, noise.
///
/// Measurements are counted, or observations where a sequence has none. One sequence is shown with charts over its
/// frames, several are compared, one in each line.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os stats box1.mcap
  os stats out/*
  os stats box1 --json | jq .points.track_length_frames
  os stats out/* --csv > statistics.csv
  os stats box1 --frames --csv > frames.csv")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub(super) struct Args {
    /// Sequences: MCAP files, Parquet folders or collections.
    #[arg(required_unless_present = "schema")]
    sequences: Vec<PathBuf>,
    /// Print one JSON object per sequence.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Print comma-separated values: a line for each sequence, or for each frame.
    #[arg(long)]
    csv: bool,
    /// Show every frame.
    #[arg(long)]
    frames: bool,
    /// Print the JSON Schema of what --json prints.
    #[arg(long, conflicts_with_all = ["json", "csv", "frames", "sequences"])]
    schema: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Shown<'a> {
    path: String,
    #[serde(flatten)]
    statistics: &'a SequenceStatistics,
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<&'a [FrameStatistics]>,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.schema {
        serde_json::to_writer_pretty(&mut *stdout, &SequenceStatistics::json_schema())?;
        writeln!(stdout)?;
        return Ok(Outcome::Done);
    }
    let mut all = Vec::new();
    let sequences = inputs::sequences(&args.sequences)?;
    for (index, path) in sequences.iter().enumerate() {
        let analysed = analyse(path)?;
        if args.json {
            let frames = args.frames.then_some(analysed.frames.as_slice());
            let shown = Shown { path: path.display().to_string(), statistics: &analysed.sequence, frames };
            serde_json::to_writer(&mut *stdout, &shown)?;
            writeln!(stdout)?;
        } else if args.frames && args.csv {
            frames_csv(&analysed, index == 0, stdout)?;
        } else if args.frames {
            frames_table(&analysed, stdout)?;
        } else if sequences.len() == 1 && !args.csv {
            one(&analysed, stdout)?;
        } else {
            // Only what is compared is kept.
            all.push((file_name(path), analysed.sequence));
        }
    }
    match (args.csv, all.is_empty()) {
        (_, true) => {}
        (true, _) => csv(all.iter().map(|(_, found)| found), stdout)?,
        (false, _) => comparison(&all, stdout)?,
    }
    Ok(Outcome::Done)
}

pub(super) fn analyse(path: &Path) -> anyhow::Result<Analysed> {
    let reader = format::open(path)?;
    let groups = reader.table::<StructuralGroup>()?;
    let counted = Counted {
        measured_points: reader.has_rows::<PointMeasurement>()?,
        measured_lines: reader.has_rows::<LineMeasurement>()?,
    };
    let mut analysis = Analysis::new(reader.manifest(), &groups, counted);
    let total = reader.frame_list()?.len() as u64;
    let progress = Progress::new("counting", "frames");
    for (done, frame) in (1..).zip(reader.frames()?) {
        analysis.add(frame?);
        progress.update(done, total);
    }
    Ok(analysis.finish())
}

fn one(analysed: &Analysed, out: &mut dyn Write) -> anyhow::Result<()> {
    let found = &analysed.sequence;
    writeln!(out, "{}", found.name)?;
    let mut line = |name: &str, value: String| writeln!(out, "  {name:<11}{value}");
    line("frames", format!("{}, {:.1} s", text::count(found.frame_count), found.duration_seconds))?;
    line("points", kind(&found.points))?;
    line("lines", kind(&found.lines))?;
    if let Some(motion) = &found.motion {
        let turned = motion.total_rotation_rad.to_degrees();
        let grade = motion.grade.map(|grade| format!("; {} rotation", grade.name())).unwrap_or_default();
        line("path", format!("{:.2} m, turned by {turned:.0}° in all{grade}", motion.path_length_m))?;
    }
    let noise = &found.noise;
    let noises: Vec<String> = [
        ("points", noise.point_px, "px"),
        ("their depth", noise.point_depth_m, "m"),
        ("line ends", noise.line_px, "px"),
        ("their depth", noise.line_depth_m, "m"),
    ]
    .into_iter()
    .filter_map(|(name, difference, unit)| difference.map(|found| difference_text(name, found, unit)))
    .collect();
    if !noises.is_empty() {
        line("noise", noises.join(", "))?;
    }
    writeln!(out)?;
    let mut table = text::table(["QUANTITY", "MIN", "MEDIAN", "MEAN", "MAX", "UNIT"], &[1, 2, 3, 4]);
    for (name, unit, scale, distribution) in rows(found) {
        let Some(distribution) = distribution else { continue };
        let cell = |number: f64| short(number * scale);
        table.add_row([
            name,
            cell(distribution.min),
            cell(distribution.median),
            cell(distribution.mean),
            cell(distribution.max),
            unit.to_owned(),
        ]);
    }
    for row in text::lines(&table).lines() {
        writeln!(out, "  {}", row.trim_start())?;
    }
    let shared: Vec<String> = found
        .points
        .shared
        .iter()
        .map(|apart| format!("{} at {}", short(apart.shared.median), apart.frames_apart))
        .collect();
    if !shared.is_empty() {
        writeln!(out, "\n  median of points shared by frames apart: {}", shared.join(", "))?;
    }
    for (name, kind) in [("points", &found.points), ("lines", &found.lines)] {
        let bins: Vec<String> = kind
            .tracks
            .iter()
            .filter(|bin| bin.landmarks > 0)
            .map(|bin| match bin.at_most {
                1 => format!("1: {}", text::count(bin.landmarks)),
                _ => format!("{}–{}: {}", bin.at_least, bin.at_most, text::count(bin.landmarks)),
            })
            .collect();
        if !bins.is_empty() {
            writeln!(out, "  {name} by frames that show them: {}", bins.join(", "))?;
        }
    }
    charts(&analysed.frames, out)
}

/// The paper's figure: features, occupied cells and rotation of each frame.
fn charts(frames: &[FrameStatistics], out: &mut dyn Write) -> anyhow::Result<()> {
    type Column = fn(&FrameStatistics) -> Option<f64>;
    let columns: [(&str, Column); 4] = [
        ("points in each frame", |frame| Some(frame.point_count as f64)),
        ("lines in each frame", |frame| Some(frame.line_count as f64)),
        ("occupied cells in each frame", |frame| Some(frame.occupied_cells as f64)),
        ("rotation since the frame before, degrees", |frame| {
            frame.rotation_since_previous.map(f64::to_degrees)
        }),
    ];
    let ids = frames.first().zip(frames.last()).map(|(first, last)| [first.frame_id.0, last.frame_id.0]);
    for (title, column) in columns {
        let numbers: Vec<Option<f64>> = frames.iter().map(column).collect();
        if numbers.iter().flatten().any(|number| *number > 0.0) {
            write!(out, "\n{}", chart(title, &numbers, ids.unwrap_or_default()))?;
        }
    }
    Ok(())
}

fn kind(found: &FeatureStatistics) -> String {
    format!("{} of {} landmarks, from {}", text::count(found.rows), text::count(found.landmarks), found.table)
}

fn difference_text(name: &str, found: Difference, unit: &str) -> String {
    format!("{name} {} {unit} (mean {} {unit})", short(found.sigma), short(found.mean))
}

/// What is shown of a sequence: name, unit for people, factor to it.
fn rows(found: &SequenceStatistics) -> Vec<(String, &'static str, f64, Option<Distribution>)> {
    let degrees = 1.0_f64.to_degrees();
    let motion = found.motion.as_ref();
    let cells = found.image_cells.map(|cells| format!(" of {}", text::count(cells))).unwrap_or_default();
    let row = |name: &str, unit, scale, distribution| (name.to_owned(), unit, scale, distribution);
    vec![
        row("points in a frame", "", 1.0, found.points.per_frame),
        row("lines in a frame", "", 1.0, found.lines.per_frame),
        row(&format!("occupied cells{cells}"), "", 1.0, found.occupied_cells),
        row(&format!("covered cells{cells}"), "", 1.0, found.covered_cells),
        row("structural constraints", "", 1.0, found.structural_constraints),
        row("frames that show a point", "frames", 1.0, found.points.track_length_frames),
        row("frames that show a line", "frames", 1.0, found.lines.track_length_frames),
        row("covisible frames of a frame", "frames", 1.0, found.covisible_frames),
        row("parallax of a point", "°", degrees, found.point_parallax_rad),
        row("parallax to the frame before", "°", degrees, found.parallax_to_previous_rad),
        row("rotation of a step", "°", degrees, motion.map(|motion| motion.rotation_rad)),
        row("translation of a step", "m", 1.0, motion.map(|motion| motion.translation_m)),
        row("speed", "m/s", 1.0, motion.and_then(|motion| motion.speed_m_per_s)),
        row("turn rate", "°/s", degrees, motion.and_then(|motion| motion.turn_rate_rad_per_s)),
    ]
}

/// The name of a sequence's file or folder, which tells apart what was made of one sequence.
fn file_name(path: &Path) -> String {
    inputs::called(path).unwrap_or_else(|| path.display().to_string())
}

fn comparison(all: &[(String, SequenceStatistics)], out: &mut dyn Write) -> anyhow::Result<()> {
    let header = [
        "SEQUENCE",
        "FRAMES",
        "POINTS",
        "LINES",
        "CELLS",
        "COVERED",
        "CONSTR.",
        "TRACK",
        "COVIS.",
        "PARALLAX °",
        "STEP °",
        "STEP m",
        "PATH m",
        "ROTATION",
    ];
    let mut table = text::table(header, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    let degrees = 1.0_f64.to_degrees();
    let median = |found: Option<Distribution>, scale: f64| {
        found.map_or_else(|| "-".to_owned(), |found| short(found.median * scale))
    };
    for (name, found) in all {
        let motion = found.motion.as_ref();
        let grade = motion.and_then(|motion| motion.grade);
        table.add_row([
            name.clone(),
            text::count(found.frame_count),
            median(found.points.per_frame, 1.0),
            median(found.lines.per_frame, 1.0),
            median(found.occupied_cells, 1.0),
            median(found.covered_cells, 1.0),
            median(found.structural_constraints, 1.0),
            median(found.points.track_length_frames, 1.0),
            median(found.covisible_frames, 1.0),
            median(found.point_parallax_rad, degrees),
            median(motion.map(|motion| motion.rotation_rad), degrees),
            median(motion.map(|motion| motion.translation_m), 1.0),
            motion.map_or_else(|| "-".to_owned(), |motion| short(motion.path_length_m)),
            grade.map_or("-", MotionGrade::name).to_owned(),
        ]);
    }
    writeln!(out, "{}", text::lines(&table))?;
    writeln!(out, "\nMedians over frames, points and steps; tracks in frames.")?;
    Ok(())
}

fn frames_table(analysed: &Analysed, out: &mut dyn Write) -> anyhow::Result<()> {
    let header = [
        "FRAME",
        "POINTS",
        "LINES",
        "CELLS",
        "COVERED",
        "CONSTR.",
        "SHARED POINTS",
        "SHARED LINES",
        "PARALLAX °",
        "STEP °",
        "STEP m",
    ];
    let mut table = text::table(header, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
    let count = |number: Option<i64>| number.map_or_else(|| "-".to_owned(), |number| number.to_string());
    let float = |number: Option<f64>, scale: f64| {
        number.map_or_else(|| "-".to_owned(), |number| short(number * scale))
    };
    let degrees = 1.0_f64.to_degrees();
    for frame in &analysed.frames {
        table.add_row([
            frame.frame_id.0.to_string(),
            frame.point_count.to_string(),
            frame.line_count.to_string(),
            frame.occupied_cells.to_string(),
            count(frame.covered_cells),
            frame.structural_constraints.to_string(),
            count(frame.points_shared_with_previous),
            count(frame.lines_shared_with_previous),
            float(frame.median_parallax_to_previous, degrees),
            float(frame.rotation_since_previous, degrees),
            float(frame.translation_since_previous, 1.0),
        ]);
    }
    writeln!(out, "{}", analysed.sequence.name)?;
    writeln!(out, "{}", text::lines(&table))?;
    Ok(())
}

/// The rows of `frame_statistics` after the sequence's name, in the units of the table.
fn frames_csv(analysed: &Analysed, header: bool, out: &mut dyn Write) -> anyhow::Result<()> {
    let columns: Vec<&str> = FrameStatistics::TABLE.fields.iter().map(|field| field.name).collect();
    if header {
        writeln!(out, "sequence,{}", columns.join(","))?;
    }
    for frame in &analysed.frames {
        let row = serde_json::to_value(frame)?;
        let cells = columns.iter().map(|column| row.get(column).map(Value::to_string).unwrap_or_default());
        let cells: Vec<String> = cells.collect();
        writeln!(out, "{},{}", csv_text(&analysed.sequence.name), cells.join(","))?;
    }
    Ok(())
}

/// A line for each sequence, a column for each number of the JSON, by its path.
fn csv<'a>(all: impl Iterator<Item = &'a SequenceStatistics>, out: &mut dyn Write) -> anyhow::Result<()> {
    let mut rows: Vec<BTreeMap<String, String>> = Vec::new();
    for found in all {
        let mut row = BTreeMap::new();
        flatten("", &serde_json::to_value(found)?, &mut row);
        rows.push(row);
    }
    let mut columns: BTreeSet<&String> = rows.iter().flat_map(BTreeMap::keys).collect();
    let name = "name".to_owned();
    columns.remove(&name);
    let columns: Vec<&String> = std::iter::once(&name).chain(columns).collect();
    let header: Vec<&str> = columns.iter().map(|column| column.as_str()).collect();
    writeln!(out, "{}", header.join(","))?;
    for row in &rows {
        let cells: Vec<&str> =
            columns.iter().map(|column| row.get(*column).map_or("", String::as_str)).collect();
        writeln!(out, "{}", cells.join(","))?;
    }
    Ok(())
}

/// Leaves of a JSON value by their path; entries of a list are named by their first number.
fn flatten(path: &str, value: &Value, row: &mut BTreeMap<String, String>) {
    let join = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    match value {
        Value::Object(members) => members.iter().for_each(|(name, value)| flatten(&join(name), value, row)),
        Value::Array(entries) => {
            for entry in entries {
                let name = ["frames_apart", "at_least"].iter().find_map(|name| entry.get(name));
                flatten(&join(&name.map(Value::to_string).unwrap_or_default()), entry, row);
            }
        }
        Value::String(text) => drop(row.insert(path.to_owned(), csv_text(text))),
        other => drop(row.insert(path.to_owned(), other.to_string())),
    }
}

/// Text as one cell (RFC 4180).
fn csv_text(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// A number with three digits or so, for people.
fn short(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        size if size >= 1e7 => format!("{number:.2e}"),
        size if size >= 100.0 || (number.fract() == 0.0 && size >= 1.0) => format!("{number:.0}"),
        size if size >= 10.0 => format!("{number:.1}"),
        size if size >= 0.1 => format!("{number:.2}"),
        size if size >= 0.001 => format!("{number:.4}"),
        _ => format!("{number:.1e}"),
    }
}
