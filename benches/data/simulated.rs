//! Simulated sequences of the paper in memory: a fixed seed, so that every run measures the same numbers.

use std::path::Path;

use anyhow::{Context, Result};
use open_structure::simulate;
use open_structure::structure::{Estimate, MeasuredFrame, MeasurementNoise, Sequence};
use open_structure::track::{self, TrackOptions};

/// The sequence of a recipe that travels with the program, cut to its first frames.
///
/// Truth, landmarks, groups, observations and measurements; no correspondences or statistics.
pub(crate) fn simulated(name: &str, frames: usize) -> Result<Sequence> {
    let recipe = simulate::named(name)?;
    let simulation = simulate::simulate(&recipe, Path::new(""), &|_, _, _| ())?;
    let mut sequence = Sequence {
        manifest: simulation.manifest(),
        point_landmarks: simulation.point_landmarks(),
        line_landmarks: simulation.line_landmarks()?,
        structural_groups: simulation.structural_groups().to_vec(),
        ..Sequence::default()
    };
    for bundle in simulation.bundles().take(frames) {
        sequence.frames.push(bundle.frame);
        sequence.point_observations.extend(bundle.point_observations);
        sequence.line_observations.extend(bundle.line_observations);
        sequence.point_measurements.extend(bundle.point_measurements);
        sequence.line_measurements.extend(bundle.line_measurements);
    }
    sequence.sort();
    Ok(sequence)
}

/// Tracks a sequence with the built-in tracker against a map, from the true first pose.
pub(crate) fn tracked(sequence: &Sequence, frames: &[MeasuredFrame]) -> Result<Estimate> {
    let first = sequence.frames.first().and_then(|frame| frame.world_from_camera());
    let first = first.context("a first frame with a true pose")?.pose()?;
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let mut tracker = TrackOptions::default().tracker(&sequence.manifest.cameras, noise, first)?;
    Ok(track::track(frames, "tracked", tracker.as_mut(), &|_, _| ())?)
}
