//! Measurements into poses and a map.

use std::time::Instant;

use serde::Serialize;

use super::Error;
use super::named::{check_cameras, check_name};
use crate::geometry::Pose;
use crate::structure::{
    DepthNoise, Estimate, Frame, MeasuredFrame, MeasurementNoise, Sequence, TrackedFrame, registry,
};
use crate::track::{self, Method, Sensor, TrackOptions};

/// How to track; what is absent is chosen by what the sequence has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackRequest {
    /// What a frame is aligned to.
    pub method: Method,
    /// The paper's plain variant.
    pub classic: bool,
    /// What is measured; `rgbd` where measurements have depth of declared noise, and else `monocular`.
    pub sensor: Option<Sensor>,
    /// Pose of the first frame, `world_from_camera`; its true one where the sequence has it, else the identity.
    pub first_pose: Option<Pose>,
    /// Seed of random samples.
    pub seed: u64,
    /// Name of the estimate; that of the method, with `-classic` for the plain variant.
    pub name: Option<String>,
    /// Replace an estimate of the same name.
    pub replace: bool,
}

impl TrackRequest {
    /// The name of the estimate.
    #[must_use]
    pub fn estimate_name(&self) -> String {
        let method = match self.method {
            Method::FrameToFrame => registry::FRAME_TO_FRAME,
            Method::MapToFrame => registry::MAP_TO_FRAME,
        };
        let usual = || if self.classic { format!("{method}-classic") } else { method.to_owned() };
        self.name.clone().unwrap_or_else(usual)
    }
}

/// How tracking went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackSummary {
    /// Name of the estimate.
    pub estimate: String,
    /// What was measured: `rgbd`, `stereo` or `monocular`.
    pub sensor: &'static str,
    /// Frames.
    pub frames: usize,
    /// Frames that measurements placed.
    pub tracked: usize,
    /// Frames whose pose is a prediction.
    pub predicted: usize,
    /// Frames after which tracking began anew.
    pub lost: usize,
    /// Median of the frames' root mean square residuals, sigma.
    pub residual_rms_median: Option<f64>,
    /// Points of the map.
    pub points: usize,
    /// Lines of the map.
    pub lines: usize,
    /// How long it took, seconds.
    pub seconds: f64,
}

/// Tracks the camera through a sequence, and puts the estimate into it.
///
/// * `progress` — told how many frames of how many are done.
///
/// # Errors
/// [`Error::Name`], [`Error::Taken`], [`Error::CameraModel`], [`Error::Missing`] without measurements, [`Error::FirstPose`], and those of
/// the room `track`.
pub fn track(
    mut sequence: Sequence,
    request: &TrackRequest,
    progress: &dyn Fn(u64, u64),
) -> Result<(Sequence, TrackSummary), Error> {
    let name = request.estimate_name();
    check_name("an estimate", &name, Estimate::is_in(&sequence, &name), request.replace)?;
    check_cameras(&sequence)?;
    let frames = MeasuredFrame::of(&sequence);
    if frames.iter().all(|frame| frame.points.is_empty() && frame.lines.is_empty()) {
        return Err(Error::Missing {
            missing: "measurements",
            remedy: "; `os measure` makes them of observations",
        });
    }
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let has_depth = noise.depth != DepthNoise::Unknown && has_depth(&sequence);
    let usual = if has_depth { Sensor::Rgbd } else { Sensor::Monocular };
    let sensor = request.sensor.unwrap_or(usual);
    let first = match request.first_pose {
        Some(pose) => pose,
        None => true_first_pose(&sequence, &frames)?,
    };
    let options =
        TrackOptions { method: request.method, classic: request.classic, sensor, seed: request.seed };
    let mut tracker = options.tracker(&sequence.manifest.cameras, noise, first)?;
    let begun = Instant::now();
    let estimate = track::track(&frames, &name, tracker.as_mut(), progress)?;
    let seconds = begun.elapsed().as_secs_f64();
    let count = |state: &str| estimate.tracking.iter().filter(|row| row.state == state).count();
    let summary = TrackSummary {
        sensor: match sensor {
            Sensor::Monocular => "monocular",
            Sensor::Stereo { .. } => "stereo",
            Sensor::Rgbd => "rgbd",
        },
        frames: frames.len(),
        tracked: count(registry::TRACKED),
        predicted: count(registry::PREDICTED),
        lost: count(registry::LOST),
        residual_rms_median: median_rms(&estimate.tracking),
        points: estimate.points.len(),
        lines: estimate.lines.len(),
        seconds,
        estimate: name,
    };
    estimate.put(&mut sequence);
    Ok((sequence, summary))
}

/// Whether anything has a depth.
fn has_depth(sequence: &Sequence) -> bool {
    sequence.point_measurements.iter().any(|row| row.depth.is_some())
        || sequence.line_measurements.iter().any(|row| row.start_depth.is_some() && row.end_depth.is_some())
}

/// The true pose of the first frame, which is the gauge; the identity where it is not known.
fn true_first_pose(sequence: &Sequence, frames: &[MeasuredFrame]) -> Result<Pose, Error> {
    let Some(first) = frames.first() else { return Ok(Pose::identity()) };
    let truth = sequence.frames.iter().find(|frame| frame.frame_id == first.frame_id);
    match truth.and_then(Frame::world_from_camera) {
        Some(row) => row.pose().map_err(|cause| Error::FirstPose { frame: first.frame_id, cause }),
        None => Ok(Pose::identity()),
    }
}

/// The median of the frames' root mean square residuals.
fn median_rms(tracking: &[TrackedFrame]) -> Option<f64> {
    let mut all: Vec<f64> = tracking.iter().filter_map(|row| row.residual_rms).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}
