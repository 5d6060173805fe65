//! The example holds what it promises.

use std::sync::Arc;

use nalgebra::Point2;
use open_structure::adjust::{Factor as _, Parametrisation as _, Problem};
use open_structure::benchmark::{load, measured};
use open_structure::evaluate::{Alignment, absolute};
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::simulate::noise::{NoiseModel, NoiseRecipe};
use open_structure::structure::{Estimate, FrameId, MeasuredFrame, Sequence};
use open_structure::track::track;
use open_structure_plug_in::bearing::BearingSpace;
use open_structure_plug_in::refine::refine_points;
use open_structure_plug_in::seen::Seen;
use open_structure_plug_in::tracker::CloudTracker;

fn truth(sequence: &Sequence) -> Vec<(FrameId, Pose)> {
    let pose = |frame: &open_structure::structure::Frame| frame.world_from_camera().unwrap().pose().unwrap();
    sequence.frames.iter().map(|frame| (frame.frame_id, pose(frame))).collect()
}

fn tracked(noise: NoiseModel) -> (Sequence, Estimate, f64) {
    let sequence = measured(&load("box2").unwrap(), &NoiseRecipe::new(noise), 1);
    let frames = MeasuredFrame::of(&sequence);
    let truth = truth(&sequence);
    let mut tracker = CloudTracker::new(&sequence.manifest.cameras, truth[0].1);
    let estimate = track(&frames, "plug-in", &mut tracker, &|_, _| {}).unwrap();
    let poses: Vec<_> = estimate
        .trajectory
        .iter()
        .map(|row| (row.frame_id, row.world_from_camera().pose().unwrap()))
        .collect();
    let error = absolute(&truth, &poses, Alignment::NONE).unwrap().translation.rmse();
    (sequence, estimate, error)
}

#[test]
fn the_tracker_is_exact_without_noise() {
    let (_, _, error) = tracked(NoiseModel::None);
    // Metres: rounding over some hundred frames.
    assert!(error < 1e-9, "{error:e}");
}

#[test]
fn the_refined_map_agrees_better_with_the_pixels() {
    let (sequence, mut estimate, error) = tracked(NoiseModel::FirstRelease);
    assert!(error > 1e-4, "noise has an effect");
    let frames = MeasuredFrame::of(&sequence);
    let [before, after] = refine_points(&frames, &sequence.manifest.cameras, 1.0, &mut estimate).unwrap();
    assert!(after < before, "{before} -> {after}");
}

#[test]
fn a_step_of_zero_moves_nothing_and_directions_keep_their_length() {
    let numbers = [0.6, 0.0, 0.8, 1.2];
    let mut moved = [0.0; 4];
    BearingSpace.plus(&numbers, &[0.0; 3], &mut moved);
    for (moved, number) in moved.iter().zip(&numbers) {
        assert!((moved - number).abs() < 1e-15);
    }
    BearingSpace.plus(&numbers, &[0.3, -0.2, 0.1], &mut moved);
    assert!((moved[..3].iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-15);
}

#[test]
fn the_jacobian_is_the_difference() {
    let space = Arc::new(BearingSpace);
    let camera = PinholeCamera { fx: 535.4, fy: -539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 };
    let camera_from_anchor = Pose::from_components([0.2, -0.1, 0.3], [0.05, 0.1, -0.02, 1.0]).unwrap();
    let start = [0.1_f64, -0.2, 0.974_679_434_480_896_3, 1.1];
    let at = |numbers: &[f64], jacobian: Option<&mut [f64]>| {
        let mut problem = Problem::new();
        let point = problem.add(&space, numbers);
        let factor =
            Seen { point, camera_from_anchor, camera, pixel: Point2::new(300.0, 200.0), sigma_px: 0.5 };
        let mut residual = [0.0; 2];
        assert!(factor.evaluate(&problem.values(), &mut residual, jacobian));
        residual
    };
    let mut jacobian = [0.0; 6];
    at(&start, Some(&mut jacobian));
    for column in 0..3 {
        let moved = |size: f64| {
            let mut step = [0.0; 3];
            step[column] = size;
            let mut moved = [0.0; 4];
            BearingSpace.plus(&start, &step, &mut moved);
            at(&moved, None)
        };
        let (after, before) = (moved(1e-6), moved(-1e-6));
        for row in 0..2 {
            let difference = (after[row] - before[row]) / 2e-6;
            // Rounding of 1e3 over the step, in units of sigma.
            assert!((jacobian[3 * row + column] - difference).abs() < 1e-4, "{row} {column}");
        }
    }
}
