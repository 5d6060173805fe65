//! `os-convert tum`, `icl` and `tartanair`: sequences made of RGB-D images.

use super::Outcome;
use super::parse::{assignment, frame_range, given_camera, sequence_name};
use super::stages::Stages;
use super::unpacked::Input;
use crate::detect::Detector;
use crate::family::FAMILIES;
use crate::generate::{self, Generated, Options};
use crate::rgbd::{self, GivenCamera, Kinect, OpenOptions, RawSequence};
use anyhow::Context as _;
use clap::builder::PossibleValuesParser;
use open_structure::datasets::{self, CameraOfDataset, Dataset, Recipe};
use open_structure::format::{self, Encoding, WriteOptions};
use open_structure::simulate::noise::{NoiseModel, NoiseRecipe};
use open_structure::storage::{self, File, Outgoing};
use serde::Serialize;
use std::io::{Read as _, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Largest configuration that is read, bytes.
const MAX_CONFIG_BYTES: u64 = 1 << 20;

/// What the three commands share.
#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// The sequence's folder, or its archive as downloaded (.tgz, .tar.gz, .zip)
    #[arg(required_unless_present = "print_config")]
    input: Option<PathBuf>,
    /// The sequence: NAME.mcap for an MCAP file, any other name for a Parquet folder
    #[arg(short, long, value_name = "OUT", required_unless_present = "print_config")]
    output: Option<PathBuf>,
    /// Name of the sequence; by default that of the dataset's
    #[arg(long, value_parser = sequence_name)]
    name: Option<String>,
    /// Recipe of the sequence, by name or file (see `os fetch`): its name, origin, licence and camera
    #[arg(long, value_name = "NAME|FILE")]
    recipe: Option<String>,
    /// Frames by their place in the dataset, B not included; either may be left out
    #[arg(long, value_name = "A..B", value_parser = frame_range)]
    frames: Option<Range<u64>>,
    /// Every N-th frame
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    stride: u64,
    /// Most points that are detected in an image
    #[arg(long, value_name = "N")]
    max_features: Option<u32>,
    /// Detector of line segments
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(["fld", "lsd", "ed"]))]
    segments: Option<String>,
    /// Thresholds, as --print-config shows them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the configuration with every threshold, what it means, and its default; with --config, that one completed
    #[arg(long)]
    print_config: bool,
    /// Camera, pixels, instead of the dataset's: of images without distortion
    #[arg(long, value_name = "FX,FY,CX,CY[,W,H]", value_parser = given_camera, allow_hyphen_values = true)]
    camera: Option<GivenCamera>,
    /// Which Kinect of TUM RGB-D took the images, where the name does not say
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(["fr1", "fr2", "fr3"]))]
    kinect: Option<String>,
    /// How far stamps of a colour image and its depth map may be apart, seconds (TUM RGB-D)
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02, value_parser = seconds)]
    max_difference: f64,
    /// Noise model of the measurements, as in `os measure`; by default that of the configuration
    #[arg(long, value_name = "MODEL", value_parser = PossibleValuesParser::new(NoiseModel::ALL.map(NoiseModel::name)))]
    noise: Option<String>,
    /// A parameter of the noise; may be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, f64)>,
    /// Seed of everything random
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads that decode and detect; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Leave frames and lines out that cannot be used, and count them, where else the first is an error
    #[arg(long)]
    keep_going: bool,
    /// Draw frames over their images, as PNG in this folder: what was detected in blue, what is observed in green, lines of a
    /// group in its colour
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Frames that are drawn, evenly over the sequence
    #[arg(long, value_name = "N", default_value_t = 10, requires = "pictures")]
    picture_count: usize,
    /// Add channels for Foxglove and Lichtblick to an MCAP file
    #[arg(long)]
    foxglove: bool,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

const AFTER_HELP: &str = "\
Examples:
  os-convert tum rgbd_dataset_freiburg3_structure_texture_near -o structure.mcap
  os-convert tum rgbd_dataset_freiburg1_desk.tgz -o desk --frames 100..200 --max-features 2000
  os-convert icl living_room_traj0_frei_png -o livingroom0.mcap --noise kinect-disparity --seed 7
  os-convert tartanair hospital/Easy/P000 -o hospital.mcap --segments lsd
  os-convert tum --print-config > thresholds.toml

Missing files that lists name are counted and passed over; a file that is there and cannot be used is an error, unless
--keep-going leaves its frame out.

Exit codes: 0 done; 1 failed; 2 misused; 3 done, and --keep-going left something out.";

fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    if (0.0..=10.0).contains(&value) { Ok(value) } else { Err("expected a number from 0 to 10".to_owned()) }
}

impl Args {
    fn options(&self) -> anyhow::Result<Options> {
        let mut options = match &self.config {
            Some(path) => Options::from_toml(&text_of(path)?).with_context(|| path.display().to_string())?,
            None => Options::default(),
        };
        options.points.max_features = self.max_features.unwrap_or(options.points.max_features);
        match self.segments.as_deref() {
            Some("lsd") => options.segments.detector = Detector::Lsd,
            Some("ed") => options.segments.detector = Detector::Ed,
            Some(_) => options.segments.detector = Detector::Fld,
            None => (),
        }
        if let Some(name) = &self.noise {
            options.noise = NoiseRecipe::new(NoiseModel::of_name(name).context("no such noise model")?);
        }
        for (name, value) in &self.set {
            options.noise.set(name, *value)?;
        }
        options.seed = self.seed.unwrap_or(options.seed);
        options.check()?;
        Ok(options)
    }

    fn recipe(&self) -> anyhow::Result<Option<Recipe>> {
        let Some(name) = &self.recipe else { return Ok(None) };
        let path = Path::new(name);
        // A name of ours goes before a folder of that name, such as one that was fetched.
        if path.extension().is_none() && !storage::is_file(path) {
            return Ok(Some(datasets::named(name)?));
        }
        Ok(Some(Recipe::from_toml(&text_of(path)?).with_context(|| name.clone())?))
    }

    fn open_options(&self, recipe: Option<&Recipe>) -> OpenOptions {
        let family = recipe.and_then(|recipe| recipe.camera.family.strip_prefix("tum-"));
        let kinect = self.kinect.as_deref().or(family).and_then(|name| match name {
            "fr1" => Some(Kinect::Fr1),
            "fr2" => Some(Kinect::Fr2),
            "fr3" => Some(Kinect::Fr3),
            _ => None,
        });
        // One that the converters know has its own numbers, and its distortion.
        let unknown = |recipe: &&Recipe| FAMILIES.iter().all(|family| family.name != recipe.camera.family);
        let camera = recipe.filter(unknown).map(|recipe| {
            let CameraOfDataset { fx, fy, cx, cy, width, height, .. } = recipe.camera;
            GivenCamera { fx, fy, cx, cy, size: Some([width, height]) }
        });
        #[expect(clippy::cast_possible_truncation, reason = "at most ten seconds")]
        let nanos = (self.max_difference * 1e9).round() as i64;
        OpenOptions {
            frames: self.frames.clone().unwrap_or(0..u64::MAX),
            stride: self.stride,
            keep_going: self.keep_going,
            max_stamp_difference_nanos: nanos,
            camera: self.camera.or(camera),
            kinect,
            ..OpenOptions::default()
        }
    }
}

fn text_of(path: &Path) -> anyhow::Result<String> {
    let mut text = String::new();
    let file = File::open(path).with_context(|| path.display().to_string())?;
    let bytes = file
        .take(MAX_CONFIG_BYTES + 1)
        .read_to_string(&mut text)
        .with_context(|| path.display().to_string())?;
    if bytes as u64 > MAX_CONFIG_BYTES {
        anyhow::bail!("{}: expected a configuration of at most {MAX_CONFIG_BYTES} bytes", path.display());
    }
    Ok(text)
}

/// Runs the command.
///
/// Results go to `stdout`, words about them to `stderr`.
///
/// # Errors
/// Where the folder is not of the dataset, an image cannot be used, or the sequence cannot be written.
pub fn run(
    dataset: Dataset,
    args: &Args,
    stdout: &mut dyn Write,
    stderr: &mut dyn Write,
) -> anyhow::Result<Outcome> {
    let options = args.options()?;
    let recipe = args.recipe()?;
    if args.print_config {
        write!(stdout, "{}", generate::documented(&options))?;
        return Ok(Outcome::Done);
    }
    let (Some(input), Some(output)) = (&args.input, &args.output) else {
        anyhow::bail!("an input and an output are wanted");
    };
    if args.kinect.is_some() && dataset != Dataset::Tum {
        writeln!(stderr, "error: --kinect is for TUM RGB-D")?;
        return Ok(Outcome::Misused);
    }
    if let Some(recipe) = recipe.as_ref().filter(|recipe| recipe.dataset != dataset) {
        writeln!(
            stderr,
            "error: {} is of another dataset: os-convert {}",
            recipe.name,
            recipe.dataset.command()
        )?;
        return Ok(Outcome::Misused);
    }
    let encoding = Encoding::of_output(output);
    if args.foxglove && encoding != Encoding::Mcap {
        writeln!(
            stderr,
            "error: --foxglove adds channels to an MCAP file; {} would be a Parquet folder",
            output.display()
        )?;
        return Ok(Outcome::Misused);
    }
    if !args.force && storage::is_taken(output).with_context(|| output.display().to_string())? {
        return Err(format::Error::Exists { path: output.clone() }.into());
    }
    if let Some(what) = replaced(input, output) {
        writeln!(stderr, "error: {} would replace the images: it is {what}", output.display())?;
        return Ok(Outcome::Misused);
    }

    let stages = Stages::default();
    let update = |stage: &'static str, done: u64, total: u64| stages.update(stage, done, total);
    let unpacked = Input::of(input, output, &update)?;
    let open_options = args.open_options(recipe.as_ref());
    let mut raw = match dataset {
        Dataset::Tum => rgbd::tum::open(unpacked.folder(), &open_options),
        Dataset::Icl => rgbd::icl::open(unpacked.folder(), &open_options),
        Dataset::Tartanair => rgbd::tartanair::open(unpacked.folder(), &open_options),
    }
    .map_err(anyhow::Error::from)
    .or_else(|error| match &unpacked {
        Input::Folder(_) => Err(error),
        // What is unpacked goes again, so the archive is what people know.
        Input::Archive(_) => Err(error).with_context(|| input.display().to_string()),
    })?;
    if let Some(recipe) =
        recipe.as_ref().filter(|recipe| recipe.camera.pixel_origin != raw.camera.pixel_origin)
    {
        let (expected, found) = (&raw.camera.pixel_origin, &recipe.camera.pixel_origin);
        anyhow::bail!(
            "recipe {}: camera.pixel_origin: expected {expected}, the dataset's, found {found}",
            recipe.name
        );
    }
    if let Some(recipe) = recipe {
        raw.name = recipe.name;
        raw.description = recipe.description;
        raw.source.sequence = Some(recipe.sequence);
        raw.source.url = Some(recipe.url);
        raw.source.licence = Some(recipe.licence);
        raw.source.citation = Some(recipe.citation);
    } else if matches!(unpacked, Input::Archive(_)) && raw.name.ends_with(".partial") {
        // The archive has no folder: its own name has to do.
        let stem = storage::without_query(input).file_name().unwrap_or_default().to_string_lossy();
        stem.split('.').next().unwrap_or_default().clone_into(&mut raw.name);
    }
    let name = args.name.clone().unwrap_or_else(|| raw.name.clone());
    // Threads are ours: those of OpenCV would come on top of them.
    opencv::core::set_num_threads(1)?;
    let threads = args
        .threads
        .map_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get), usize::from);
    let generated = generate::generate(&raw, &name, &options, threads, args.keep_going, &update)?;
    let write = WriteOptions { force: args.force, foxglove: args.foxglove, ..WriteOptions::default() };
    generated.write(output, write, &update)?;
    if let Some(folder) = &args.pictures {
        pictures(&raw, &generated, &options, folder, args.picture_count, &update)?;
    }
    drop(stages);
    drop(unpacked);

    let report = Report::of(&raw, &generated, output, encoding);
    if args.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        report.render(stdout)?;
    }
    let left_out = args.keep_going && !report.excluded.is_empty();
    Ok(if left_out { Outcome::Findings } else { Outcome::Done })
}

/// What of the input an output would take the place of, if any.
fn replaced(input: &Path, output: &Path) -> Option<&'static str> {
    if storage::holds(output, input) {
        return Some("the input itself, or holds it");
    }
    let is_sequence = storage::is_file(&output.join("sequence.json"))
        || (storage::is_file(output) && Encoding::of_output(output) == Encoding::Mcap);
    (storage::exists(output) && storage::holds(input, output) && !is_sequence)
        .then_some("a part of the input")
}

/// Draws some frames.
fn pictures(
    raw: &RawSequence,
    generated: &Generated,
    options: &Options,
    folder: &Path,
    count: usize,
    progress: &generate::Progress<'_>,
) -> anyhow::Result<()> {
    let drawn = Outgoing::folder(folder).with_context(|| folder.display().to_string())?;
    let frames = generated.frames();
    let count = count.min(frames.len());
    for number in 0..count {
        let index = number * frames.len() / count;
        let path = drawn.path().join(format!("{:06}.png", frames[index].frame_id.0));
        generate::overlay(raw, generated, options, index, &path)?;
        progress("drawing", number as u64 + 1, count as u64);
    }
    drawn.finish().with_context(|| folder.display().to_string())
}

/// What is said about a converted sequence.
#[derive(Clone, Debug, Serialize)]
struct Report {
    tool: &'static str,
    version: &'static str,
    sequence: String,
    dataset: String,
    output: PathBuf,
    encoding: &'static str,
    frames: usize,
    points: usize,
    lines: usize,
    groups: Vec<GroupReport>,
    point_observations: u64,
    line_observations: u64,
    became: generate::Ledger,
    excluded: Vec<open_structure::structure::Exclusion>,
    noise: Option<open_structure::structure::Noise>,
}

#[derive(Clone, Debug, Serialize)]
struct GroupReport {
    kind: String,
    lines: usize,
}

impl Report {
    fn of(raw: &RawSequence, generated: &Generated, output: &Path, encoding: Encoding) -> Self {
        let (points, lines, groups) = generated.landmarks();
        let [point_observations, line_observations] = generated.observations();
        let manifest = generated.manifest();
        Self {
            tool: "os-convert",
            version: env!("CARGO_PKG_VERSION"),
            sequence: manifest.name.clone(),
            dataset: raw.source.dataset.clone(),
            output: output.to_owned(),
            encoding: encoding.name(),
            frames: generated.frames().len(),
            points: points.len(),
            lines: lines.len(),
            groups: groups
                .iter()
                .map(|group| GroupReport { kind: group.kind.clone(), lines: group.line_ids.len() })
                .collect(),
            point_observations,
            line_observations,
            became: generated.ledger().clone(),
            excluded: manifest.excluded.clone(),
            noise: manifest.noise.clone(),
        }
    }

    fn render(&self, stdout: &mut dyn Write) -> anyhow::Result<()> {
        writeln!(
            stdout,
            "{}: {} frames, {} points, {} lines in {} groups, {} + {} observations",
            self.output.display(),
            self.frames,
            self.points,
            self.lines,
            self.groups.len(),
            self.point_observations,
            self.line_observations
        )?;
        let groups: Vec<String> =
            self.groups.iter().map(|group| format!("{} lines {}", group.lines, group.kind)).collect();
        if !groups.is_empty() {
            writeln!(stdout, "  groups: {}", groups.join(", "))?;
        }
        let became = &self.became;
        writeln!(
            stdout,
            "  detected: {} points, {} of them with a place in space; {} segments, {} of them",
            became.points_detected, became.points_lifted, became.segments_detected, became.segments_lifted
        )?;
        for (reason, count) in &became.left_out {
            writeln!(stdout, "  left out: {count} x {reason}")?;
        }
        for exclusion in &self.excluded {
            writeln!(stdout, "  excluded: {} x {}: {}", exclusion.count, exclusion.file, exclusion.reason)?;
        }
        Ok(())
    }
}
