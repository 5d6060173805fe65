//! What a method is given: noise where the source has none, depth where it has none.

use super::Plan;
use crate::simulate::noise::NoiseRecipe;
use crate::structure::{FrameBundle, Sequence, registry};

/// A sequence with the measurements that a plan gives to methods: those of a seed, or its own.
pub(super) fn given(sequence: &Sequence, plan: &Plan, seed: u64) -> Sequence {
    if !plan.as_measured {
        return measured(sequence, &plan.noise, seed);
    }
    Sequence {
        point_measurements: sequence.point_measurements.clone(),
        line_measurements: sequence.line_measurements.clone(),
        ..without_measurements(sequence)
    }
}

/// A sequence with the measurements of a seed.
///
/// Points and lines each: where the sequence has noise-free observations, measurements are drawn from them; where it has noisy
/// measurements alone, those stay as published. Measurements without depth then get one, drawn about the true depth. So a seed
/// changes everything of a noise-free source, and the depths of a noisy one.
#[must_use]
pub fn measured(sequence: &Sequence, noise: &NoiseRecipe, seed: u64) -> Sequence {
    let mut made = without_measurements(sequence);
    let (points, lines) = (!sequence.point_observations.is_empty(), !sequence.line_observations.is_empty());
    if !points {
        made.point_measurements.clone_from(&sequence.point_measurements);
    }
    if !lines {
        made.line_measurements.clone_from(&sequence.line_measurements);
    }
    for FrameBundle { frame, point_observations, line_observations, .. } in sequence.bundles() {
        let Some(camera) = sequence.manifest.camera(frame.camera_id) else { continue };
        let (of_points, of_lines) =
            noise.measure(camera, frame.frame_id, &point_observations, &line_observations, seed);
        made.point_measurements.extend(of_points);
        made.line_measurements.extend(of_lines);
    }
    noise.complete_depths(&mut made, seed);
    if points || lines || made.manifest.noise.is_none() {
        made.manifest.noise = Some(noise.declared(seed));
    }
    made.sort();
    made
}

/// What a method may know of a sequence beside its measurements, and what it is held against.
fn without_measurements(sequence: &Sequence) -> Sequence {
    let unrefined = sequence.map_lines.iter().filter(|row| row.estimate == registry::UNREFINED);
    Sequence {
        manifest: sequence.manifest.clone(),
        frames: sequence.frames.clone(),
        point_landmarks: sequence.point_landmarks.clone(),
        line_landmarks: sequence.line_landmarks.clone(),
        structural_groups: sequence.structural_groups.clone(),
        // The lines as they were observed: what the bound is computed at.
        map_lines: unrefined.cloned().collect(),
        ..Sequence::default()
    }
}
