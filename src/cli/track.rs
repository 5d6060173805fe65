//! `os track`: where the camera was, and what it saw, out of the measurements.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use clap::ValueEnum;
use serde_json::json;

use super::progress::Progress;
use super::{Outcome, extended, text};
use crate::geometry::Pose;
use crate::structure::{
    DepthNoise, Estimate, Frame, MeasuredFrame, MeasurementNoise, Sequence, TrackedFrame, registry,
};
use crate::track::{self, Method, Sensor, TrackOptions};

/// What a frame is aligned to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    /// The frame before: errors add up.
    FrameToFrame,
    /// A map of every landmark seen so far.
    MapToFrame,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SensorName {
    /// Pixels alone: depth is not looked at, and the scale is free (the first two views are 1 apart).
    Monocular,
    /// Pixels, and depth by disparity over --baseline.
    Stereo,
    /// Pixels, and depth with the noise that the sequence declares.
    Rgbd,
}

/// Track the camera through a sequence: poses of its frames and a map, from measurements alone.
///
/// By default outliers are found and left out, poses follow from points and lines by least squares, and landmarks are fused by their
/// covariances, all by the noise that the sequence declares. Ground truth is not looked at, but for the first pose, which nothing
/// measured tells. A frame with too few measurements gets a predicted pose, and the exit code is 3.
///
/// The output is the input with the estimate added: trajectories, map and what happened in each frame (table `tracking`).
#[derive(clap::Args, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command")]
#[command(after_help = "Examples:
  os track box1 -o tracked --name ours
  os track box1.mcap -o tracked.mcap --method frame-to-frame --replace
  os track box1 -o plain --classic
  os track box1 -o stereo --sensor stereo --baseline 0.12 --name stereo
  os track box1 -o moved --first-pose 0,0,0,0,0,0,1 --name moved --json")]
pub(super) struct Args {
    /// Sequence with measurements: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// What a frame is aligned to.
    #[arg(long, value_enum, default_value_t = MethodName::MapToFrame)]
    method: MethodName,
    /// The paper's plain variant: `EPnP` over points with depth, no outliers sought, no refinement, landmarks averaged.
    #[arg(long)]
    classic: bool,
    /// What is measured; by default `rgbd` where measurements have depth, and `monocular` where none has.
    #[arg(long, value_enum)]
    sensor: Option<SensorName>,
    /// Distance of the two cameras of --sensor stereo, metres.
    #[arg(long, value_name = "M", required_if_eq("sensor", "stereo"))]
    baseline: Option<f64>,
    /// Pose of the first frame (`world_from_camera`, metres); by default its true one where the sequence has it, else the identity.
    #[arg(long, value_name = "TX,TY,TZ,QX,QY,QZ,QW", value_parser = pose, allow_hyphen_values = true)]
    first_pose: Option<Pose>,
    /// Seed of random samples.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Name of the estimate; by default that of the method, with `-classic` for --classic.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Replace an estimate of the same name.
    #[arg(long)]
    replace: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    /// Print what came out as JSON.
    #[arg(long)]
    json: bool,
}

fn pose(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let numbers = numbers.map_err(|error| format!("expected seven numbers: {error}"))?;
    let [tx, ty, tz, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!("expected seven numbers tx,ty,tz,qx,qy,qz,qw, found {}", numbers.len()));
    };
    Pose::from_components([tx, ty, tz], [qx, qy, qz, qw]).map_err(|error| error.to_string())
}

impl Args {
    fn default_name(&self) -> String {
        let method = match self.method {
            MethodName::FrameToFrame => registry::FRAME_TO_FRAME,
            MethodName::MapToFrame => registry::MAP_TO_FRAME,
        };
        if self.classic { format!("{method}-classic") } else { method.to_owned() }
    }

    fn options(&self, sensor: SensorName) -> anyhow::Result<TrackOptions> {
        if self.baseline.is_some() && !matches!(sensor, SensorName::Stereo) {
            anyhow::bail!("--baseline goes with --sensor stereo");
        }
        let sensor = match sensor {
            SensorName::Monocular => Sensor::Monocular,
            SensorName::Rgbd => Sensor::Rgbd,
            SensorName::Stereo => {
                Sensor::Stereo { baseline_m: self.baseline.context("--sensor stereo takes a --baseline")? }
            }
        };
        let method = match self.method {
            MethodName::FrameToFrame => Method::FrameToFrame,
            MethodName::MapToFrame => Method::MapToFrame,
        };
        Ok(TrackOptions { method, classic: self.classic, sensor, seed: self.seed })
    }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let (mut sequence, mut outcome) = extended::read(&args.sequence, &args.output, args.force)?;
    let name = args.name.clone().unwrap_or_else(|| args.default_name());
    extended::check_name("an estimate", &name, Estimate::is_in(&sequence, &name), args.replace)?;
    extended::check_cameras(&sequence)?;
    let frames = MeasuredFrame::of(&sequence);
    let measured = frames.iter().any(|frame| !frame.points.is_empty() || !frame.lines.is_empty());
    anyhow::ensure!(measured, "the sequence has no measurements; `os measure` makes them of observations");
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let sensor = args.sensor.unwrap_or(if noise.depth != DepthNoise::Unknown && has_depth(&sequence) {
        SensorName::Rgbd
    } else {
        SensorName::Monocular
    });
    let first = match args.first_pose {
        Some(pose) => pose,
        None => true_first_pose(&sequence, &frames)?,
    };
    let mut tracker = args.options(sensor)?.tracker(&sequence.manifest.cameras, noise, first)?;
    let progress = Progress::new("tracking", "frames");
    let begun = Instant::now();
    let estimate =
        track::track(&frames, &name, tracker.as_mut(), &|done, total| progress.update(done, total))?;
    let seconds = begun.elapsed().as_secs_f64();
    drop(progress);
    let count = |state: &str| estimate.tracking.iter().filter(|row| row.state == state).count();
    let (tracked, predicted, lost) =
        (count(registry::TRACKED), count(registry::PREDICTED), count(registry::LOST));
    if predicted + lost > 0 {
        outcome = Outcome::Findings;
    }
    let rms = median_rms(&estimate.tracking);
    let (points, lines) = (estimate.points.len(), estimate.lines.len());
    let sensor_name = match sensor {
        SensorName::Monocular => "monocular",
        SensorName::Stereo => "stereo",
        SensorName::Rgbd => "rgbd",
    };
    estimate.put(&mut sequence);
    let size = extended::write(&args.output, sequence, args.force)?;
    if args.json {
        let said = json!({
            "estimate": name, "sensor": sensor_name, "frames": frames.len(), "tracked": tracked,
            "predicted": predicted, "lost": lost, "residual_rms_median": rms, "points": points, "lines": lines,
            "seconds": seconds,
        });
        writeln!(stdout, "{}", serde_json::to_string_pretty(&said)?)?;
        return Ok(outcome);
    }
    writeln!(
        stdout,
        "estimate `{name}` ({sensor_name}): {} frames, {} tracked, {} predicted, {} lost; {} points, {} lines",
        text::count(frames.len() as u64),
        text::count(tracked as u64),
        text::count(predicted as u64),
        text::count(lost as u64),
        text::count(points as u64),
        text::count(lines as u64)
    )?;
    if let Some(rms) = rms {
        writeln!(stdout, "residuals of inliers: {rms:.2} sigma (median of the frames' RMS)")?;
    }
    // Results are the same every time; this is not.
    writeln!(io::stderr(), "{seconds:.1} s, {:.0} frames/s", frames.len() as f64 / seconds.max(1e-9))?;
    writeln!(stdout, "{}: {size}", args.output.display())?;
    Ok(outcome)
}

/// Whether anything has a depth.
fn has_depth(sequence: &Sequence) -> bool {
    sequence.point_measurements.iter().any(|row| row.depth.is_some())
        || sequence.line_measurements.iter().any(|row| row.start_depth.is_some() && row.end_depth.is_some())
}

/// The true pose of the first frame, which is the gauge; the identity where it is not known.
fn true_first_pose(sequence: &Sequence, frames: &[MeasuredFrame]) -> anyhow::Result<Pose> {
    let Some(first) = frames.first() else { return Ok(Pose::identity()) };
    let truth = sequence.frames.iter().find(|frame| frame.frame_id == first.frame_id);
    match truth.and_then(Frame::world_from_camera) {
        Some(row) => row.pose().with_context(|| format!("frames: the true pose of {}", first.frame_id)),
        None => Ok(Pose::identity()),
    }
}

/// The median of the frames' root mean square residuals.
fn median_rms(tracking: &[TrackedFrame]) -> Option<f64> {
    let mut all: Vec<f64> = tracking.iter().filter_map(|row| row.residual_rms).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}
