//! Published results: trajectories and maps, each under the name of its estimate.

use super::graph::Vertices;
use super::landmarks::{Points, Segments, points, segments};
use super::ledger::Ledger;
use super::poses::{Poses, poses};
use crate::text_release::{Association, TextSequence};
use nalgebra::Point3;
use open_structure::structure::{FrameId, MapLine, MapPoint, Sequence, TrajectoryPose, registry};
use std::collections::BTreeMap;

/// One estimate: whatever of a path and a map it has.
#[derive(Default)]
pub(super) struct Estimate {
    pub(super) poses: Poses,
    pub(super) points: Points,
    pub(super) lines: Segments,
}

/// Estimates by name.
pub(super) type Estimates = BTreeMap<String, Estimate>;

/// The registry's name of an estimate.
fn registered(estimate: &str) -> String {
    if estimate == "pointline-ba" { registry::POINT_LINE_BA.to_owned() } else { estimate.to_owned() }
}

/// What published estimates and embedded blocks are held against.
pub(super) struct Known<'a> {
    pub(super) truth: &'a Poses,
    pub(super) points: &'a Points,
    pub(super) lines: &'a Segments,
    pub(super) graph: &'a Vertices,
}

/// Every estimate of a sequence: published trajectories and maps, and blocks embedded in files of observations, where
/// they are neither the truth nor the graph.
pub(super) fn estimates(text: &TextSequence, known: &Known<'_>, ledger: &mut Ledger) -> Estimates {
    let mut estimates = Estimates::new();
    for trajectory in &text.trajectories {
        let estimate = estimates.entry(registered(&trajectory.estimate)).or_default();
        estimate.poses = poses(&trajectory.poses, &trajectory.file, ledger);
    }
    for map in &text.maps {
        let name = registered(&map.estimate);
        let file_of = |ending: &str| {
            let fits = |file: &&String| file.to_ascii_lowercase().trim_end_matches(".txt").ends_with(ending);
            map.files.iter().find(fits).or(map.files.first()).cloned().unwrap_or_default()
        };
        let (points_file, lines_file) = (file_of("point"), file_of("line"));
        let map_points = points(&map.points, &points_file, ledger);
        let map_lines = segments(&map.lines, &lines_file, ledger);
        let estimate = estimates.entry(name).or_default();
        if is_same_naming(&map_points, first_known(known.points, &known.graph.points), |a, b| (a - b).norm())
        {
            estimate.points = map_points;
        } else {
            let reason =
                "ids of the map are not those of the landmarks: no nearer to their own than to others";
            ledger.exclude_many(&points_file, reason, map_points.len() as u64, None);
        }
        let between = |a: &open_structure::geometry::Segment, b: &open_structure::geometry::Segment| {
            (a.midpoint() - b.midpoint()).norm()
        };
        if is_same_naming(&map_lines, first_known(known.lines, &known.graph.lines), between) {
            estimate.lines = map_lines;
        } else {
            let reason =
                "ids of the map are not those of the landmarks: no nearer to their own than to others";
            ledger.exclude_many(&lines_file, reason, map_lines.len() as u64, None);
        }
    }
    if let Some(association) = &text.association {
        embedded(association, "association-embedded", known, &mut estimates, ledger);
    }
    if let Some(graph) = &text.graph {
        embedded(graph, "graph-embedded", known, &mut estimates, ledger);
    }
    estimates.retain(|_, estimate| {
        !(estimate.poses.is_empty() && estimate.points.is_empty() && estimate.lines.is_empty())
    });
    estimates
}

fn first_known<'a, K, V>(first: &'a BTreeMap<K, V>, second: &'a BTreeMap<K, V>) -> &'a BTreeMap<K, V> {
    if first.is_empty() { second } else { first }
}

/// Whether a map names its landmarks as the others do.
///
/// A map may have drifted far from the truth, so that no distance is too large by itself; but the median distance to the
/// landmark of the same id is then still smaller than half of that to landmarks of other ids.
fn is_same_naming<K: Ord, V>(
    map: &BTreeMap<K, V>,
    known: &BTreeMap<K, V>,
    distance: impl Fn(&V, &V) -> f64,
) -> bool {
    let pairs: Vec<(&V, &V)> = map.iter().filter_map(|(id, value)| Some((value, known.get(id)?))).collect();
    // Too few to tell.
    if pairs.len() < 8 {
        return true;
    }
    let median = |shift: usize| {
        let mut distances: Vec<f64> =
            (0..pairs.len()).map(|at| distance(pairs[at].0, pairs[(at + shift) % pairs.len()].1)).collect();
        distances.sort_by(f64::total_cmp);
        distances[pairs.len() / 2]
    };
    median(0) < 0.5 * median(pairs.len() / 2)
}

/// Blocks that stand in a file of observations. They are estimates, never truth.
fn embedded(
    file: &Association,
    name: &str,
    known: &Known<'_>,
    estimates: &mut Estimates,
    ledger: &mut Ledger,
) {
    // A repeated id was told when the graph's own vertices were taken.
    let mut quiet = Ledger::default();
    let ledger = if name == "graph-embedded" { &mut quiet } else { ledger };
    let named = |number: u32| if number == 0 { name.to_owned() } else { format!("{name}-{}", number + 1) };
    for block in &file.rows.vertices {
        let found = poses(&block.rows, &file.file, ledger);
        if !within(&found, &known.graph.poses, same_pose) && !within(&found, known.truth, same_pose) {
            estimates.entry(named(block.number)).or_default().poses = found;
        }
    }
    for block in &file.rows.points {
        let found = points(&block.rows, &file.file, ledger);
        if !within(&found, &known.graph.points, Point3::eq) && !within(&found, known.points, Point3::eq) {
            estimates.entry(named(block.number)).or_default().points = found;
        }
    }
    for block in &file.rows.lines {
        let found = segments(&block.rows, &file.file, ledger);
        let same = open_structure::geometry::Segment::eq;
        if !within(&found, &known.graph.lines, same) && !within(&found, known.lines, same) {
            estimates.entry(named(block.number)).or_default().lines = found;
        }
    }
}

fn same_pose(one: &super::poses::FramePose, other: &super::poses::FramePose) -> bool {
    one.row == other.row
}

/// Whether every entry of a map stands in another one.
fn within<K: Ord, V>(map: &BTreeMap<K, V>, other: &BTreeMap<K, V>, same: impl Fn(&V, &V) -> bool) -> bool {
    map.iter().all(|(id, value)| other.get(id).is_some_and(|found| same(value, found)))
}

/// Puts estimates into the tables.
pub(super) fn add_estimates(estimates: &Estimates, sequence: &mut Sequence) {
    for (name, estimate) in estimates {
        let poses = estimate.poses.iter();
        sequence
            .trajectories
            .extend(poses.map(|(id, pose)| TrajectoryPose::new(name.clone(), *id, pose.row)));
        sequence
            .map_points
            .extend(estimate.points.iter().map(|(id, at)| MapPoint::new(name.to_owned(), *id, at)));
        sequence
            .map_lines
            .extend(estimate.lines.iter().map(|(id, segment)| MapLine::new(name.to_owned(), *id, segment)));
    }
}

/// Frames that estimates name.
pub(super) fn frames(estimates: &Estimates) -> impl Iterator<Item = FrameId> {
    estimates.values().flat_map(|estimate| estimate.poses.keys().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use open_structure::structure::PointId;

    #[test]
    fn a_drifted_map_keeps_its_ids_and_a_renumbered_one_does_not() {
        let landmarks: Points = (0..100)
            .map(|id| (PointId(id), Point3::new((id * 37 % 100) as f64, (id * 71 % 100) as f64, 0.0)))
            .collect();
        let drifted: Points = landmarks
            .iter()
            .map(|(id, at)| (*id, at * 1.1 + nalgebra::Vector3::new(3.0, 1.0, 0.0)))
            .collect();
        let renumbered: Points = landmarks.iter().map(|(id, at)| (PointId((id.0 + 13) % 100), *at)).collect();
        let distance = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm();
        assert!(is_same_naming(&drifted, &landmarks, distance));
        assert!(!is_same_naming(&renumbered, &landmarks, distance));
        assert!(is_same_naming(&Points::new(), &landmarks, distance));
    }
}
