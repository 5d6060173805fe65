//! Estimated trajectories against the true one: errors, and coordinates and angles over time.

use std::collections::{BTreeMap, BTreeSet};

use super::error::Error;
use crate::evaluate::{EvaluateOptions, Evaluation, Reconstruction, evaluate};
use crate::format::SequenceReader;
use crate::geometry::Pose;
use crate::structure::{
    Frame, FrameId, LineLandmark, MapLine, MapPoint, PointLandmark, PoseRow, TrajectoryPose,
};

/// Estimates of a sequence against its truth.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// True poses; empty where none are known.
    pub truth: Vec<(FrameId, Pose)>,
    /// Estimates that have a pose, by name.
    pub estimates: Vec<ComparedEstimate>,
    /// Why nothing is compared though there are estimates.
    pub why_not: Option<String>,
}

/// One estimate.
#[derive(Clone, Debug)]
pub struct ComparedEstimate {
    /// Its name.
    pub name: String,
    /// Its errors; `None` without a truth to compare it with.
    pub evaluation: Option<Evaluation>,
    /// Its poses, laid on the true ones where that could be done, else as they are stored.
    pub poses: Vec<(FrameId, Pose)>,
    /// Whether the poses are laid on the true ones.
    pub aligned: bool,
    /// Why it could not be compared.
    pub problem: Option<String>,
}

/// Estimates and landmarks of a sequence.
pub(super) struct Tables<'a> {
    pub(super) frames: &'a [Frame],
    pub(super) points: &'a [PointLandmark],
    pub(super) lines: &'a [LineLandmark],
    pub(super) trajectories: &'a [TrajectoryPose],
    pub(super) map_points: &'a [MapPoint],
    pub(super) map_lines: &'a [MapLine],
}

impl Comparison {
    /// Reads the poses and maps of a sequence and compares every estimate that has a pose with the truth.
    ///
    /// # Errors
    /// Those of reading tables.
    pub fn read(reader: &SequenceReader, options: &EvaluateOptions) -> Result<Self, Error> {
        let tables = Tables {
            frames: reader.frame_list()?,
            points: &reader.table::<PointLandmark>()?,
            lines: &reader.table::<LineLandmark>()?,
            trajectories: &reader.table::<TrajectoryPose>()?,
            map_points: &reader.table::<MapPoint>()?,
            map_lines: &reader.table::<MapLine>()?,
        };
        Ok(Self::of(&tables, options))
    }

    /// Compares every estimate that has a pose.
    pub(super) fn of(tables: &Tables<'_>, options: &EvaluateOptions) -> Self {
        let truth = Reconstruction::truth(tables.frames, tables.points, tables.lines);
        let names: BTreeSet<&str> = tables.trajectories.iter().map(|row| row.estimate.as_str()).collect();
        let mut why_not = truth.as_ref().err().map(ToString::to_string);
        let reference = truth.ok().filter(|truth| !truth.poses().is_empty());
        if reference.is_none() && why_not.is_none() && !names.is_empty() {
            why_not = Some("no frame has a true pose".to_owned());
        }
        let estimates =
            names.into_iter().map(|name| ComparedEstimate::of(name, tables, reference.as_ref(), options));
        Self {
            estimates: estimates.collect(),
            truth: reference.map(|truth| truth.poses().to_vec()).unwrap_or_default(),
            why_not,
        }
    }
}

impl ComparedEstimate {
    fn of(
        name: &str,
        tables: &Tables<'_>,
        reference: Option<&Reconstruction>,
        options: &EvaluateOptions,
    ) -> Self {
        let mut found = Self {
            name: name.to_owned(),
            evaluation: None,
            poses: Vec::new(),
            aligned: false,
            problem: None,
        };
        let estimate = Reconstruction::named(name, tables.trajectories, tables.map_points, tables.map_lines);
        let estimate = match estimate {
            Ok(estimate) => estimate,
            Err(problem) => {
                found.problem = Some(problem.to_string());
                return found;
            }
        };
        found.poses = estimate.poses().to_vec();
        let Some(reference) = reference else { return found };
        let evaluation = evaluate(reference, &estimate, options);
        match &evaluation.absolute {
            Ok(absolute) => {
                let moved = |(id, pose): &(FrameId, Pose)| (*id, absolute.reference_from_estimate.pose(pose));
                found.poses = estimate.poses().iter().map(moved).collect();
                found.aligned = true;
            }
            Err(problem) => found.problem = Some(problem.to_string()),
        }
        if let (None, Err(problem)) = (&found.problem, &evaluation.relative) {
            found.problem = Some(problem.to_string());
        }
        found.evaluation = Some(evaluation);
        found
    }

    /// Poses, one for each frame.
    pub(super) fn path(&self, frames: &[Frame]) -> Vec<Option<PoseRow>> {
        let poses: BTreeMap<FrameId, &Pose> = self.poses.iter().map(|(id, pose)| (*id, pose)).collect();
        frames.iter().map(|frame| poses.get(&frame.frame_id).map(|pose| PoseRow::from(*pose))).collect()
    }
}

/// Coordinates (metres) and angles (degrees) of a path: x, y, z, roll, pitch, yaw of each pose.
///
/// `R = R_z(yaw) R_y(pitch) R_x(roll)` of `world_from_camera`; angles go on over ±180° so that they do not jump.
///
/// * `beside` — angles of poses that this path's are near to, by frame: the first angle that both have is taken there.
#[must_use]
pub fn coordinates_and_angles(
    poses: &[(FrameId, Pose)],
    beside: Option<&[(FrameId, [f64; 6])]>,
) -> Vec<(FrameId, [f64; 6])> {
    let near: BTreeMap<FrameId, &[f64; 6]> =
        beside.unwrap_or_default().iter().map(|(id, six)| (*id, six)).collect();
    let mut before: Option<[f64; 3]> = None;
    let mut found = Vec::with_capacity(poses.len());
    for (id, pose) in poses {
        let place = pose.translation();
        let wrapped = angles(pose);
        let towards = near.get(id).map(|six| [six[3], six[4], six[5]]).or(before).unwrap_or(wrapped);
        let turned =
            [0, 1, 2].map(|axis| wrapped[axis] + 360.0 * ((towards[axis] - wrapped[axis]) / 360.0).round());
        before = Some(turned);
        found.push((*id, [place.x, place.y, place.z, turned[0], turned[1], turned[2]]));
    }
    found
}

/// Roll, pitch and yaw, degrees.
fn angles(pose: &Pose) -> [f64; 3] {
    let rotation = pose.rotation_matrix();
    let roll = libm::atan2(rotation[(2, 1)], rotation[(2, 2)]);
    let pitch = libm::asin((-rotation[(2, 0)]).clamp(-1.0, 1.0));
    let yaw = libm::atan2(rotation[(1, 0)], rotation[(0, 0)]);
    [roll, pitch, yaw].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn turned(roll: f64, pitch: f64, yaw: f64) -> Pose {
        Pose::new(UnitQuaternion::from_euler_angles(roll, pitch, yaw), Vector3::zeros())
    }

    proptest! {
        #[test]
        fn angles_are_those_the_rotation_was_made_of(
            roll in -3.0..3.0_f64, pitch in -1.5..1.5_f64, yaw in -3.0..3.0_f64,
        ) {
            let found = angles(&turned(roll, pitch, yaw));
            for (found, made) in found.into_iter().zip([roll, pitch, yaw]) {
                // The cosine of the pitch divides rounding.
                prop_assert!((found.to_radians() - made).abs() < 1e-12, "{found} {made}");
            }
        }
    }

    #[test]
    fn a_full_turn_does_not_jump_and_an_estimate_begins_beside_the_truth() {
        let full: Vec<(FrameId, Pose)> =
            (0..40_i32).map(|n| (FrameId(i64::from(n)), turned(0.0, 0.0, f64::from(n) * 0.2))).collect();
        let truth = coordinates_and_angles(&full, None);
        assert!(
            truth.windows(2).all(|pair| (pair[1].1[5] - pair[0].1[5] - 0.2_f64.to_degrees()).abs() < 1e-9)
        );
        let late = coordinates_and_angles(&full[35..], Some(&truth));
        assert!((late[0].1[5] - truth[35].1[5]).abs() < 1e-9, "{late:?}");
    }
}
