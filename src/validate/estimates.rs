//! Estimates: trajectories and the maps that go with them.

use std::collections::{BTreeMap, BTreeSet};

use super::finding::{Detail, Findings};
use super::frames::{FrameIndex, quaternion};
use super::ids::Unknown;
use super::mix::{Mix, mix};
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::structure::{MapLine, MapPoint, TrajectoryPose};

/// Checks the table `trajectories`.
pub(crate) fn trajectories(
    shared: &Shared<'_>,
    frames: &FrameIndex,
    names: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Outcome {
    const TABLE: &str = "trajectories";
    let mut unknown = Unknown::default();
    let mut paths: BTreeMap<String, (Mix, u64, u64)> = BTreeMap::new();
    let outcome = check::<TrajectoryPose>(shared, findings, |batch, first_row, _, findings| {
        for (row, pose) in (first_row..).zip(batch) {
            let stored = pose.world_from_camera();
            quaternion(&stored, row, TABLE, findings);
            if !frames.contains(pose.frame_id.0) {
                unknown.add(pose.frame_id.0, row);
            }
            if !paths.contains_key(&pose.estimate) {
                paths.insert(pose.estimate.clone(), (Mix::default(), row, 0));
            }
            if let Some((path, _, poses)) = paths.get_mut(&pose.estimate) {
                let start = mix(pose.frame_id.0.cast_unsigned());
                path.add(stored.numbers().iter().fold(start, |hash, number| mix(hash ^ number.to_bits())));
                *poses += 1;
            }
        }
    });
    unknown.report(RuleId::FrameKnown, TABLE, "frame", "frames", findings);
    same_paths(&paths, findings);
    names.extend(paths.into_keys());
    outcome
}

fn same_paths(paths: &BTreeMap<String, (Mix, u64, u64)>, findings: &mut Findings) {
    let mut first: BTreeMap<(Mix, u64), &str> = BTreeMap::new();
    for (name, (path, row, poses)) in paths {
        if let Some(other) = first.get(&(*path, *poses)) {
            findings.add(RuleId::EstimatesDistinct, Some("trajectories"), || {
                let found = format!("the same {poses} poses as `{other}`, bit by bit");
                Detail::new("poses of its own", found).row(*row).id(format!("estimate `{name}`"))
            });
        } else {
            first.insert((*path, *poses), name);
        }
    }
}

/// Checks the table `map_points`.
pub(crate) fn map_points(
    shared: &Shared<'_>,
    names: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Outcome {
    check::<MapPoint>(shared, findings, |batch, _, _, _| {
        remember(names, batch.iter().map(|row| &row.estimate));
    })
}

/// Checks the table `map_lines`.
pub(crate) fn map_lines(
    shared: &Shared<'_>,
    names: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Outcome {
    check::<MapLine>(shared, findings, |batch, _, _, _| {
        remember(names, batch.iter().map(|row| &row.estimate));
    })
}

/// Most names of an open family that are looked at.
const MOST_NAMES: usize = 1 << 10;

pub(crate) fn remember<'a>(names: &mut BTreeSet<String>, found: impl Iterator<Item = &'a String>) {
    for name in found {
        if !names.contains(name) && names.len() < MOST_NAMES {
            names.insert(name.clone());
        }
    }
}
