//! Smooth motion: what carries frames whose own measurements hardly say where they are.

use super::elimination::for_each_factor;
use super::estimation::Estimation;
use super::linearisation::Linearisation;
use super::observations::Observations;
use super::relative_poses::RelativeView;
use crate::structure::FrameId;
use nalgebra::{DMatrix, DVector, Matrix6, SymmetricEigen, Vector6};
use std::collections::BTreeMap;

/// A frame is weak when its measurements say some direction of its pose less than this many times as well as motion does.
const WEAK: f64 = 9.0;

/// And this many times less well than it is said of the frame in the middle: where all are alike, they hold each other.
const FAR_BELOW: f64 = 8.0;

/// How many times less sure of the motion we are than its changes suggest: they are not all alike.
const DOUBT: f64 = 2.0;

/// The part of the changes of motion that is looked at, and what it is for a number of three normal components of sigma one.
const QUANTILE: [usize; 2] = [3, 4];
const QUANTILE_OF_THREE: f64 = 2.027;

/// Standard deviations of the motion between neighbours about that of the start.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Smoothness {
    rotation_rad: f64,
    translation_m: f64,
}

impl Observations {
    /// Ties weak frames to their neighbours in time by the motion that they had at the start; tells which frames are weak.
    ///
    /// A few points move a frame by half a metre within their noise, which no camera does from one frame to the next. How sure the
    /// motion is comes from the start itself: from how much it changes from step to step, where it was measured.
    ///
    /// Nothing is tied where pixels leave the scale open, for a smooth motion would choose the smallest.
    pub(super) fn tie_weak_frames(&mut self, estimation: &Estimation) -> Vec<FrameId> {
        let measured = self.measured();
        let free = estimation.free_scales(self);
        let components = self.components();
        let is_scale_free =
            components.iter().zip(&measured).any(|(part, measured)| *measured && free[*part].is_some());
        if is_scale_free {
            return Vec::new();
        }
        let Some(smoothness) = self.smoothness(&measured) else { return Vec::new() };
        let Smoothness { rotation_rad: turn, translation_m: shift } = smoothness;
        let sigma = Vector6::new(turn, turn, turn, shift, shift, shift);
        let to_sigma = Matrix6::from_diagonal(&sigma);
        let own = own_information(estimation);
        let least: Vec<f64> =
            own.iter().map(|own| SymmetricEigen::new(to_sigma * own * to_sigma).eigenvalues.min()).collect();
        let mut sorted = least.clone();
        let (_, median, _) = sorted.select_nth_unstable_by(least.len() / 2, f64::total_cmp);
        let bound = WEAK.min(*median / FAR_BELOW);
        let is_weak: Vec<bool> =
            least.iter().zip(&self.frames).map(|(least, vertex)| !vertex.fixed && *least < bound).collect();
        let usual = self.usual_gap();
        for (place, pair) in self.frames.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            let gap = after.frame_id.0.saturating_sub(before.frame_id.0);
            // Over a gap the camera may have gone anywhere.
            if gap > usual || !(is_weak[place] || is_weak[place + 1]) {
                continue;
            }
            let information = DMatrix::from_diagonal(&DVector::from_fn(6, |k, _| 1.0 / sigma[k].powi(2)));
            self.relatives.push(RelativeView {
                frame: place + 1,
                other: place,
                frame_from_other: after.camera_from_world * before.camera_from_world.inverse(),
                information: Some(information),
            });
        }
        let weak = self.frames.iter().zip(&is_weak).filter(|(_, is_weak)| **is_weak);
        weak.map(|(vertex, _)| vertex.frame_id).collect()
    }

    /// Whether a point or a line is seen, for each frame.
    fn measured(&self) -> Vec<bool> {
        let mut measured = vec![false; self.frames.len()];
        self.point_views.iter().for_each(|view| measured[view.frame] = true);
        self.line_views.iter().for_each(|view| measured[view.frame] = true);
        measured
    }

    /// The most frequent distance between neighbours, in frame ids; the smallest of several.
    fn usual_gap(&self) -> i64 {
        let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
        for pair in self.frames.windows(2) {
            *counts.entry(pair[1].frame_id.0.saturating_sub(pair[0].frame_id.0)).or_default() += 1;
        }
        let most = counts.iter().max_by_key(|(gap, count)| (**count, std::cmp::Reverse(**gap)));
        most.map_or(0, |(gap, _)| *gap)
    }

    /// How much the motion changes from one step to the next, where frames are measured; `None` for too few steps.
    fn smoothness(&self, measured: &[bool]) -> Option<Smoothness> {
        let usual = self.usual_gap();
        let (mut turns, mut shifts) = (Vec::new(), Vec::new());
        for (three, measured) in self.frames.windows(3).zip(measured.windows(3)) {
            let [a, b, c] = three else { continue };
            let is_even = b.frame_id.0.saturating_sub(a.frame_id.0) == usual
                && c.frame_id.0.saturating_sub(b.frame_id.0) == usual;
            if !is_even || measured.contains(&false) {
                continue;
            }
            let before = b.camera_from_world * a.camera_from_world.inverse();
            let after = c.camera_from_world * b.camera_from_world.inverse();
            let change = (after * before.inverse()).log();
            turns.push(change.fixed_rows::<3>(0).norm());
            shifts.push(change.fixed_rows::<3>(3).norm());
        }
        let sigma = |mut changes: Vec<f64>| {
            let place = changes.len() * QUANTILE[0] / QUANTILE[1];
            let (_, found, _) = changes.select_nth_unstable_by(place, f64::total_cmp);
            // A start that moves evenly to the last digit says nothing of its errors.
            (*found * DOUBT / QUANTILE_OF_THREE).max(LEAST_SIGMA)
        };
        let enough = turns.len() >= LEAST_STEPS;
        enough.then(|| Smoothness { rotation_rad: sigma(turns), translation_m: sigma(shifts) })
    }
}

/// Least sigma of motion, radians and metres.
const LEAST_SIGMA: f64 = 1e-4;

/// Changes of motion without which nothing is said about it.
const LEAST_STEPS: usize = 8;

/// What the factors of each pose say of it when everything else is known: `Σ JᵀJ`; zero for one that is held.
fn own_information(estimation: &Estimation) -> Vec<Matrix6<f64>> {
    let problem = &estimation.problem;
    let mut linear = Linearisation::new(problem);
    problem.linearise(&problem.numbers, &mut linear);
    let mut pose_of = vec![usize::MAX; problem.len()];
    estimation.poses.iter().enumerate().for_each(|(place, variable)| pose_of[variable.index()] = place);
    let mut found = vec![Matrix6::zeros(); estimation.poses.len()];
    for_each_factor(problem, |factor| {
        for (variable, incidence) in factor {
            let Some(information) = found.get_mut(pose_of[*variable]) else { continue };
            for row in 0..usize::from(incidence.rows) {
                let start =
                    incidence.jacobian + row * usize::from(incidence.columns) + usize::from(incidence.column);
                let row = Vector6::from_column_slice(&linear.jacobians[start..start + 6]);
                *information += row * row.transpose();
            }
        }
    });
    found
}
