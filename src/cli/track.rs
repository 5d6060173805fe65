//! `os track`: where the camera was, and what it saw, out of the measurements.

use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Context;
use clap::ValueEnum;

use super::progress::Progress;
use super::{Outcome, extended, text};
use crate::geometry::Pose;
use crate::stations::{self, TrackRequest};
use crate::track::{Method, Sensor};

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
    fn request(&self) -> anyhow::Result<TrackRequest> {
        if self.baseline.is_some() && self.sensor != Some(SensorName::Stereo) {
            anyhow::bail!("--baseline goes with --sensor stereo");
        }
        let sensor = match self.sensor {
            Some(SensorName::Monocular) => Some(Sensor::Monocular),
            Some(SensorName::Rgbd) => Some(Sensor::Rgbd),
            Some(SensorName::Stereo) => {
                let baseline_m = self.baseline.context("--sensor stereo takes a --baseline")?;
                Some(Sensor::Stereo { baseline_m })
            }
            None => None,
        };
        let method = match self.method {
            MethodName::FrameToFrame => Method::FrameToFrame,
            MethodName::MapToFrame => Method::MapToFrame,
        };
        Ok(TrackRequest {
            method,
            classic: self.classic,
            sensor,
            first_pose: self.first_pose,
            seed: self.seed,
            name: self.name.clone(),
            replace: self.replace,
        })
    }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let request = args.request()?;
    let (sequence, mut outcome) = extended::read(&args.sequence, &args.output, args.force)?;
    let progress = Progress::new("tracking", "frames");
    let (sequence, found) = stations::track(sequence, &request, &|done, total| progress.update(done, total))?;
    drop(progress);
    if found.predicted + found.lost > 0 {
        outcome = Outcome::Findings;
    }
    let size = extended::write(&args.output, sequence, args.force)?;
    if args.json {
        let said = serde_json::to_value(&found)?;
        writeln!(stdout, "{}", serde_json::to_string_pretty(&said)?)?;
        return Ok(outcome);
    }
    writeln!(
        stdout,
        "estimate `{}` ({}): {} frames, {} tracked, {} predicted, {} lost; {} points, {} lines",
        found.estimate,
        found.sensor,
        text::count(found.frames as u64),
        text::count(found.tracked as u64),
        text::count(found.predicted as u64),
        text::count(found.lost as u64),
        text::count(found.points as u64),
        text::count(found.lines as u64)
    )?;
    if let Some(rms) = found.residual_rms_median {
        writeln!(stdout, "residuals of inliers: {rms:.2} sigma (median of the frames' RMS)")?;
    }
    // Results are the same every time; this is not.
    let (seconds, frames) = (found.seconds, found.frames as f64);
    writeln!(io::stderr(), "{seconds:.1} s, {:.0} frames/s", frames / seconds.max(1e-9))?;
    writeln!(stdout, "{}: {size}", args.output.display())?;
    Ok(outcome)
}
