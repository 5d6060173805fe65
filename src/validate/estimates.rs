//! Estimates: trajectories and the maps that go with them.

use std::collections::{BTreeMap, BTreeSet};

use super::finding::{Detail, Findings};
use super::frames::{FrameIndex, quaternion};
use super::ids::Unknown;
use super::mix::{Mix, mix};
use super::positive::is_positive;
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::structure::{Iteration, MapLine, MapPoint, Record as _, TrackedFrame, TrajectoryPose};

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
            covariance(pose.covariance.as_deref(), 6, (row, TABLE), findings, || pose.key_text());
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
    check::<MapPoint>(shared, findings, |batch, first_row, _, findings| {
        remember(names, batch.iter().map(|row| &row.estimate));
        for (row, point) in (first_row..).zip(batch) {
            covariance(point.covariance.as_deref(), 3, (row, "map_points"), findings, || point.key_text());
        }
    })
}

/// Checks the table `map_lines`.
pub(crate) fn map_lines(
    shared: &Shared<'_>,
    names: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Outcome {
    check::<MapLine>(shared, findings, |batch, first_row, _, findings| {
        remember(names, batch.iter().map(|row| &row.estimate));
        for (row, line) in (first_row..).zip(batch) {
            covariance(line.covariance.as_deref(), 6, (row, "map_lines"), findings, || line.key_text());
        }
    })
}

/// Holds a covariance, the upper triangle of a matrix of so many rows, against its column's words.
fn covariance(
    numbers: Option<&[f64]>,
    dimension: usize,
    (row, table): (u64, &'static str),
    findings: &mut Findings,
    key: impl Fn() -> String,
) {
    let Some(numbers) = numbers else { return };
    let expected = dimension * (dimension + 1) / 2;
    let wrong = if numbers.len() != expected {
        format!("{} numbers", numbers.len())
    } else if !is_positive(numbers, dimension) {
        "a matrix with a negative eigenvalue".to_owned()
    } else {
        return;
    };
    findings.add(RuleId::CovariancePositive, Some(table), || {
        Detail::new(format!("{expected} numbers of a positive semi-definite matrix"), wrong)
            .row(row)
            .id(key())
    });
}

/// Checks the table `tracking`.
pub(crate) fn tracking(
    shared: &Shared<'_>,
    frames: &FrameIndex,
    names: &mut BTreeSet<String>,
    states: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Outcome {
    const TABLE: &str = "tracking";
    let mut unknown = Unknown::default();
    let outcome = check::<TrackedFrame>(shared, findings, |batch, first_row, _, findings| {
        remember(names, batch.iter().map(|row| &row.estimate));
        remember(states, batch.iter().map(|row| &row.state));
        for (row, frame) in (first_row..).zip(batch) {
            if !frames.contains(frame.frame_id.0) {
                unknown.add(frame.frame_id.0, row);
            }
            let counts = [(frame.points, frame.point_inliers), (frame.lines, frame.line_inliers)];
            for (matched, inliers) in counts {
                if inliers < 0 || inliers > matched {
                    findings.add(RuleId::TrackingCounts, Some(TABLE), || {
                        let found = format!("{inliers} inliers of {matched} matches");
                        Detail::new("at most as many inliers as matches", found).row(row).id(frame.key_text())
                    });
                }
            }
        }
    });
    unknown.report(RuleId::FrameKnown, TABLE, "frame", "frames", findings);
    outcome
}

/// Checks the table `iterations`.
pub(crate) fn iterations(
    shared: &Shared<'_>,
    names: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Outcome {
    check::<Iteration>(shared, findings, |batch, _, _, _| {
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
