//! Sequence in, sequence with the estimate `plug-in` out.

#![expect(clippy::print_stdout, reason = "a program")]

use std::path::Path;

use anyhow::Context;
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::Pose;
use open_structure::structure::{MeasuredFrame, MeasurementNoise};
use open_structure::track::track;
use open_structure_plug_in::refine::refine_points;
use open_structure_plug_in::tracker::CloudTracker;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else { anyhow::bail!("usage: open-structure-plug-in IN OUT") };
    let mut sequence = format::read(Path::new(input))?;
    let frames = MeasuredFrame::of(&sequence);
    // The first pose alone is taken from the truth: nothing measures where the world begins.
    let first = frames.first().context("the sequence has no frame")?.frame_id;
    let gauge = sequence.frames.iter().find(|frame| frame.frame_id == first);
    let gauge = gauge.and_then(|frame| frame.world_from_camera()?.pose().ok()).unwrap_or_else(Pose::identity);

    let cameras = sequence.manifest.cameras.clone();
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let mut tracker = CloudTracker::new(&cameras, gauge);
    let mut estimate = track(&frames, "plug-in", &mut tracker, &|_, _| {})?;
    let [before, after] = refine_points(&frames, &cameras, noise.sigma_px, &mut estimate)?;
    println!("{} frames tracked; cost of the map {before:.6e} -> {after:.6e}", estimate.trajectory.len());
    estimate.put(&mut sequence);
    sequence.manifest.tables.clear();
    format::write(Path::new(output), &sequence, WriteOptions::default())?;
    Ok(())
}
