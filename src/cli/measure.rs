//! `os measure`: observations into measurements.

use std::io::{self, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::builder::PossibleValuesParser;
use rayon::prelude::*;

use super::progress::Stages;
use super::{Outcome, left_behind, text};
use crate::format::{
    self, Chunk, Realisation, SequenceReader, SequenceWriter, WriteOptions, write_realisations,
};
use crate::simulate::noise::{NoiseModel, NoiseRecipe};
use crate::stations::{self, MeasureRequest};
use crate::storage;
use crate::structure::{
    FrameBundle, GraphFactor, GraphLine, GraphPoint, GraphPose, LineLandmark, LineMeasurement,
    LineObservation, MapLine, MapPoint, PointLandmark, PointMeasurement, PointObservation, Record,
    StructuralGroup, TrajectoryPose, registry,
};

/// Most realisations at once: each has a file open for every table, and rows that wait.
const MOST_SEEDS: u64 = 100;
/// Rows that are measured together, over all realisations; their frames are in memory a few times.
const CHUNK_ROWS: usize = 1 << 16;

/// Make measurements of a sequence's observations, by a noise model of the registry.
///
/// Measurements that the sequence has are replaced, and so are noise, generator, correspondences and
/// statistics. Estimates and graphs were made from the old measurements and are left out, unless
/// --keep-estimates says otherwise. The same seed gives the same measurements, on any machine.
#[derive(clap::Args, Debug)]
#[command(after_help = "Models, with their parameters and defaults:
  none
  gaussian          sigma_px=1 sigma_depth_m=0.05
  first-release     sigma_px=1 sigma_depth_m=0.05
  paper             sigma_px=1 m=35130 sigma_d=0.1667 (cm)
  kinect-disparity  sigma_px=1 m=35130 sigma_disparity=0.1667 sigma_lateral_px=0.5

Examples:
  os measure box1 -o noisy.mcap --noise gaussian --seed 7 --set sigma_px=0.5
  os measure box1.mcap -o kinect/ --noise kinect-disparity --quantise 1 --outliers 0.05
  os measure box1.mcap -o runs/box1.mcap --noise paper --seeds 0..9
  os measure box1 -o all/box1 --noise paper --seeds 0..9 --name box1-paper; os index all --adopt
  os measure box1 -o with-depth/box1 --complete-depths --noise first-release --seed 3")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(super) struct Args {
    /// Sequence with observations: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Noise model.
    #[arg(long, value_name = "MODEL", value_parser = PossibleValuesParser::new(NoiseModel::ALL.map(NoiseModel::name)))]
    noise: String,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Several seeds, both ends included: `0..9` makes ten sequences, with the seed in their names (NAME-0.mcap).
    #[arg(long, value_name = "A..B", conflicts_with = "seed", value_parser = seeds)]
    seeds: Option<RangeInclusive<u64>>,
    /// Name of the sequence [default: that of the input]; with --seeds each seed is added to it (NAME-0), so that all can lie in
    /// one collection.
    #[arg(long)]
    name: Option<String>,
    /// A parameter of the model or an option, by the registry's name; may be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, f64)>,
    /// Part of the measurements that take the place of another landmark of the frame, 0 to 1.
    #[arg(long, value_name = "F")]
    outliers: Option<f64>,
    /// Part of the observations that are not measured, 0 to 1.
    #[arg(long, value_name = "F")]
    missed: Option<f64>,
    /// Round pixel positions to multiples of this, pixels.
    #[arg(long, value_name = "PX")]
    quantise: Option<f64>,
    /// Leave out measurements that noise carries out of the image.
    #[arg(long)]
    drop_outside: bool,
    /// Keep depths outside the depth range of the camera.
    #[arg(long)]
    keep_depth: bool,
    /// Keep trajectories, maps and graphs, which were made from other measurements.
    #[arg(long)]
    keep_estimates: bool,
    /// Keep the measurements that are there, and give those without depth one, drawn about the true depth.
    ///
    /// The first release publishes the points of its simulated sequences as noisy pixels without depth, though its own
    /// tracker had depth. The noise of depth is the model's; landmarks and true poses have to be there.
    #[arg(long, conflicts_with_all = ["outliers", "missed", "quantise", "drop_outside", "keep_depth"])]
    complete_depths: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let wrong = || "expected two numbers, both included, such as 0..9".to_owned();
    let (first, last) = text.split_once("..").ok_or_else(wrong)?;
    let last = last.strip_prefix('=').unwrap_or(last);
    let first: u64 = first.parse().map_err(|_| wrong())?;
    let last: u64 = last.parse().map_err(|_| wrong())?;
    if last < first {
        return Err("the last seed comes before the first".to_owned());
    }
    if last - first >= MOST_SEEDS {
        return Err(format!("at most {MOST_SEEDS} seeds at once"));
    }
    Ok(first..=last)
}

pub(super) fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as sigma_px=0.5")?;
    let value = value.parse().map_err(|_| format!("expected a number after {name}="))?;
    Ok((name.to_owned(), value))
}

impl Args {
    fn recipe(&self) -> anyhow::Result<NoiseRecipe> {
        let model = NoiseModel::of_name(&self.noise).context("no such noise model")?;
        let mut recipe = NoiseRecipe::new(model);
        for (name, value) in &self.set {
            recipe.set(name, *value)?;
        }
        recipe.outlier_fraction = self.outliers.or(recipe.outlier_fraction);
        recipe.missed_fraction = self.missed.or(recipe.missed_fraction);
        recipe.quantisation_px = self.quantise.or(recipe.quantisation_px);
        recipe.drop_outside |= self.drop_outside;
        recipe.keep_depth |= self.keep_depth;
        recipe.check()?;
        Ok(recipe)
    }

    /// What is asked for with one seed.
    fn request(&self, recipe: &NoiseRecipe, seed: u64) -> MeasureRequest {
        let name = self.name.as_ref().map(|name| match &self.seeds {
            Some(_) => format!("{name}-{seed}"),
            None => name.clone(),
        });
        MeasureRequest { recipe: recipe.clone(), seed, keep_estimates: self.keep_estimates, name }
    }

    /// Each output with its seed.
    fn outputs(&self) -> Vec<(u64, PathBuf)> {
        match &self.seeds {
            None => vec![(self.seed, self.output.clone())],
            Some(seeds) => seeds.clone().map(|seed| (seed, with_seed(&self.output, seed))).collect(),
        }
    }
}

/// The output's name with a seed in it: `box1.mcap` is `box1-7.mcap`, and `box1/` is `box1-7`.
fn with_seed(output: &Path, seed: u64) -> PathBuf {
    let mcap = format::Encoding::of_output(output) == format::Encoding::Mcap;
    let name = if mcap { output.file_stem() } else { output.file_name() };
    let mut name = name.unwrap_or_default().to_owned();
    name.push(format!("-{seed}"));
    if let Some(extension) = output.extension().filter(|_| mcap) {
        name.push(".");
        name.push(extension);
    }
    output.with_file_name(name)
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let recipe = args.recipe()?;
    let reader = format::open(&args.sequence)?;
    let outputs = args.outputs();
    check_outputs(&outputs, args)?;
    args.request(&recipe, args.seed).check_name()?;
    if args.complete_depths {
        return complete_depths(args, &recipe, &outputs, stdout);
    }
    let frames = reader.frame_list()?;
    for frame in frames {
        if reader.manifest().camera(frame.camera_id).is_none() {
            anyhow::bail!("{}: its {} is not in the manifest", frame.frame_id, frame.camera_id);
        }
    }
    let kinds = [reader.has::<PointObservation>(), reader.has::<LineObservation>()];
    if kinds == [false; 2] {
        anyhow::bail!("{}: has no observations to measure", args.sequence.display());
    }
    let mut outcome = left_behind::warn(&reader)?;
    let measured = [reader.has::<PointMeasurement>(), reader.has::<LineMeasurement>()];
    for (kind, name) in ["points", "lines"].into_iter().enumerate() {
        if measured[kind] && !kinds[kind] {
            writeln!(
                io::stderr(),
                "warning: there are measurements of {name} and no observations; they are left out"
            )?;
            outcome = Outcome::Findings;
        }
    }
    if !args.keep_estimates {
        tell_dropped(&reader)?;
    }
    let mut realisations = begin(args, &recipe, &reader, &outputs)?;
    let seeds: Vec<u64> = outputs.iter().map(|(seed, _)| *seed).collect();
    let stages = Stages::default();
    let make = || chunks(&reader, &recipe, &seeds);
    write_realisations(&mut realisations, frames.len(), make, &|stage, done, total| {
        stages.update(stage, done, total);
    })?;
    drop(stages);
    for (realisation, (_, path)) in realisations.into_iter().zip(&outputs) {
        let [points, lines] = realisation.tally.measurements();
        let lost = realisation.tally.lost_depths();
        realisation.writer.finish()?;
        let lost = if lost > 0 { format!(", {} depths absent", text::count(lost)) } else { String::new() };
        writeln!(
            stdout,
            "{}: {} of points and {} of lines measured{lost}, {}",
            path.display(),
            text::count(points),
            text::count(lines),
            text::bytes(format::stored_bytes(path))
        )?;
    }
    Ok(outcome)
}

/// Gives measurements without depth one, seed by seed.
fn complete_depths(
    args: &Args,
    recipe: &NoiseRecipe,
    outputs: &[(u64, PathBuf)],
    stdout: &mut dyn Write,
) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::Done;
    let input = format::read(&args.sequence)?;
    if !args.keep_estimates {
        tell_dropped(&format::open(&args.sequence)?)?;
    }
    for (seed, path) in outputs {
        let request = args.request(recipe, *seed);
        let (sequence, done) = stations::complete_depths(&input, &request)
            .with_context(|| args.sequence.display().to_string())?;
        format::write(path, &sequence, WriteOptions { force: args.force, ..WriteOptions::default() })?;
        writeln!(
            stdout,
            "{}: depths of {} points and {} ends of lines drawn; {} points triangulated, {} measurements without depth, {}",
            path.display(),
            text::count(done.points as u64),
            text::count(done.line_ends as u64),
            text::count(done.triangulated as u64),
            text::count(done.without as u64),
            text::bytes(format::stored_bytes(path))
        )?;
        if done.without > 0 {
            outcome = Outcome::Findings;
        }
    }
    Ok(outcome)
}

/// Refuses what could not be written in the end, before any work.
fn check_outputs(outputs: &[(u64, PathBuf)], args: &Args) -> anyhow::Result<()> {
    for (_, path) in outputs {
        if !storage::is_taken(path).with_context(|| path.display().to_string())? {
            continue;
        }
        if storage::holds(path, &args.sequence) {
            anyhow::bail!("{}: is the input itself, or holds it", path.display());
        }
        if !args.force {
            return Err(format::Error::Exists { path: path.clone() }.into());
        }
    }
    Ok(())
}

/// Says which tables are left out.
fn tell_dropped(reader: &SequenceReader) -> anyhow::Result<()> {
    let mut dropped: Vec<&str> = Vec::new();
    macro_rules! each {
        ($($row:ident),+) => { $(if reader.has::<$row>() { dropped.push($row::TABLE.name); })+ };
    }
    each!(TrajectoryPose, MapPoint, GraphPose, GraphPoint, GraphLine, GraphFactor);
    if reader.has::<MapLine>() {
        dropped.push("map_lines (but those `unrefined`)");
    }
    if !dropped.is_empty() {
        writeln!(
            io::stderr(),
            "note: made from other measurements and left out: {}; --keep-estimates keeps them",
            dropped.join(", ")
        )?;
    }
    Ok(())
}

/// Begins every output with the tables of the whole sequence, which are read once for all.
fn begin(
    args: &Args,
    recipe: &NoiseRecipe,
    reader: &SequenceReader,
    outputs: &[(u64, PathBuf)],
) -> anyhow::Result<Vec<Realisation>> {
    let frames = reader.frame_list()?;
    let groups: Vec<StructuralGroup> = reader.table()?;
    let mut realisations = Vec::new();
    for (seed, path) in outputs {
        let manifest = stations::measured_manifest(reader.manifest(), &args.request(recipe, *seed));
        let options = WriteOptions { force: args.force, ..WriteOptions::default() };
        let writer = SequenceWriter::create(path, &manifest, frames, options)?;
        realisations.push(Realisation::new(writer, &manifest, &groups));
    }
    copy_table::<TrajectoryPose>(reader, &mut realisations, |_| args.keep_estimates)?;
    copy_table::<PointLandmark>(reader, &mut realisations, |_| true)?;
    copy_table::<LineLandmark>(reader, &mut realisations, |_| true)?;
    copy_table::<StructuralGroup>(reader, &mut realisations, |_| true)?;
    copy_table::<MapPoint>(reader, &mut realisations, |_| args.keep_estimates)?;
    // Unrefined lines were recovered from observations, which are still the same.
    copy_table::<MapLine>(reader, &mut realisations, |row| {
        args.keep_estimates || row.estimate == registry::UNREFINED
    })?;
    copy_table::<GraphPose>(reader, &mut realisations, |_| args.keep_estimates)?;
    copy_table::<GraphPoint>(reader, &mut realisations, |_| args.keep_estimates)?;
    copy_table::<GraphLine>(reader, &mut realisations, |_| args.keep_estimates)?;
    copy_table::<GraphFactor>(reader, &mut realisations, |_| args.keep_estimates)?;
    Ok(realisations)
}

/// Copies the rows of a table that are kept; the table is there where any is, or where it was empty before.
fn copy_table<R: Record>(
    reader: &SequenceReader,
    realisations: &mut [Realisation],
    keep: impl Fn(&R) -> bool,
) -> anyhow::Result<()> {
    for batch in reader.batches::<R>()? {
        let mut rows = batch?;
        rows.retain(&keep);
        if !rows.is_empty() {
            realisations.par_iter_mut().try_for_each(|output| output.writer.append(&rows))?;
        }
    }
    Ok(())
}

/// The frames of the input in chunks, measured with every seed.
fn chunks<'a>(
    reader: &'a SequenceReader,
    recipe: &'a NoiseRecipe,
    seeds: &'a [u64],
) -> anyhow::Result<impl Iterator<Item = anyhow::Result<Chunk>> + 'a> {
    let mut frames = reader.frames()?;
    let cameras = &reader.manifest().cameras;
    let most = CHUNK_ROWS.div_ceil(seeds.len());
    Ok(std::iter::from_fn(move || {
        let (mut taken, mut rows) = (Vec::new(), 0);
        while rows < most {
            match frames.next() {
                None => break,
                Some(Err(error)) => return Some(Err(error.into())),
                Some(Ok(mut frame)) => {
                    frame.point_measurements.clear();
                    frame.line_measurements.clear();
                    // A frame without rows has its cost too.
                    rows += 1 + frame.point_observations.len() + frame.line_observations.len();
                    taken.push(frame);
                }
            }
        }
        let measured = |frame: &FrameBundle, seed: u64| {
            let camera = cameras.iter().find(|camera| camera.camera_id == frame.frame.camera_id)?;
            let (points, lines) = (&frame.point_observations, &frame.line_observations);
            let (point_measurements, line_measurements) =
                recipe.measure(camera, frame.frame.frame_id, points, lines, seed);
            Some(FrameBundle { point_measurements, line_measurements, ..frame.clone() })
        };
        (!taken.is_empty()).then(|| {
            let realise = |seed: &u64| taken.par_iter().filter_map(|frame| measured(frame, *seed)).collect();
            Ok(seeds.par_iter().map(realise).collect())
        })
    }))
}
