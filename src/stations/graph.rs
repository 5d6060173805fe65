//! An estimate into a factor graph about it.

use std::collections::BTreeSet;

use serde_json::json;

use super::Error;
use super::named::{check_cameras, check_name};
use crate::covisibility::{self, GraphOptions, KeyFrameRule, LoopRule, PoseGraphSummary};
use crate::structure::{Estimate, FactorGraph, MeasuredFrame, MeasurementNoise, Sequence, registry};

/// What stands between poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GraphKind {
    /// Points and lines with a factor for each measurement: what bundle adjustment takes.
    #[default]
    Reprojection,
    /// Relative poses between neighbours, and loop closures.
    PoseGraph,
}

/// How to build a graph; what is absent is chosen by what the sequence has.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphRequest {
    /// Estimate to begin with; the only one where it is absent.
    pub estimate: Option<String>,
    /// What stands between poses.
    pub kind: GraphKind,
    /// Name of the graph; that of the estimate, with `-pose-graph` for one.
    pub name: Option<String>,
    /// Frames that have to see a landmark for it to be a vertex.
    pub min_views: usize,
    /// Take key frames alone, by this rule.
    pub key_frames: Option<KeyFrameRule>,
    /// Close loops, by this rule.
    pub loops: Option<LoopRule>,
    /// Seed of the consensus of loop closures.
    pub seed: u64,
    /// Replace a graph of the same name.
    pub replace: bool,
}

impl Default for GraphRequest {
    fn default() -> Self {
        Self {
            estimate: None,
            kind: GraphKind::default(),
            name: None,
            min_views: 2,
            key_frames: None,
            loops: Some(LoopRule::default()),
            seed: 0,
            replace: false,
        }
    }
}

/// What went into a graph.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphSummary {
    /// Name of the graph.
    pub graph: String,
    /// Name of the estimate.
    pub estimate: String,
    /// What was counted.
    pub counts: GraphCounts,
}

/// What was counted of a graph.
#[derive(Clone, Debug, PartialEq)]
pub enum GraphCounts {
    /// Of a graph of measurements.
    Reprojection(covisibility::GraphSummary),
    /// Of a pose graph.
    PoseGraph(PoseGraphSummary),
}

impl GraphSummary {
    /// As `os graph --json` prints it.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        let (graph, estimate) = (&self.graph, &self.estimate);
        match &self.counts {
            GraphCounts::Reprojection(found) => json!({
                "graph": graph, "estimate": estimate, "kind": "reprojection", "poses": found.poses,
                "points": found.points, "lines": found.lines, "point_factors": found.point_factors,
                "line_factors": found.line_factors, "parallelism_factors": found.parallelism_factors,
                "frames_without_pose": found.frames_without_pose, "frames_left_out": found.frames_left_out,
                "landmarks_not_in_map": found.landmarks_not_in_map,
                "landmarks_with_few_views": found.landmarks_with_few_views,
                "measurements_not_finite": found.measurements_not_finite,
            }),
            GraphCounts::PoseGraph(found) => json!({
                "graph": graph, "estimate": estimate, "kind": "pose-graph", "poses": found.poses,
                "neighbours": found.neighbours, "guessed": found.guessed, "loops": found.loops,
                "loops_refused": found.loops_refused, "frames_without_pose": found.frames_without_pose,
                "frames_left_out": found.frames_left_out,
            }),
        }
    }
}

/// Builds a factor graph about an estimate, and puts it into the sequence.
///
/// # Errors
/// [`Error::Idle`], [`Error::CameraModel`], [`Error::Missing`] and [`Error::Several`] for the estimate, [`Error::Unknown`],
/// [`Error::Name`], [`Error::Taken`], [`Error::EmptyGraph`], and those of the room `covisibility`.
pub fn graph(mut sequence: Sequence, request: &GraphRequest) -> Result<(Sequence, GraphSummary), Error> {
    if request.kind == GraphKind::PoseGraph && request.key_frames.is_some() {
        return Err(Error::Idle { option: "a rule for key frames", with: "a graph of measurements" });
    }
    check_cameras(&sequence)?;
    let estimate = estimate_of(&sequence, request.estimate.as_deref())?;
    let suffix = if request.kind == GraphKind::PoseGraph { "-pose-graph" } else { "" };
    let name = request.name.clone().unwrap_or_else(|| format!("{}{suffix}", estimate.name));
    let taken = FactorGraph::names(&sequence).contains(&name);
    check_name("a graph", &name, taken, request.replace)?;
    let options = GraphOptions {
        name: name.clone(),
        least_views: request.min_views,
        key_frames: request.key_frames,
        loops: request.loops,
    };
    let frames = MeasuredFrame::of(&sequence);
    let (cameras, noise) = (&sequence.manifest.cameras, MeasurementNoise::declared(&sequence.manifest));
    let (graph, counts) = match request.kind {
        GraphKind::Reprojection => {
            let groups = &sequence.structural_groups;
            let (graph, found) =
                covisibility::reprojection_graph(&frames, &estimate, cameras, noise, groups, &options)?;
            if found.point_factors + found.line_factors == 0 {
                return Err(Error::EmptyGraph {
                    estimate: estimate.name,
                    least_views: request.min_views,
                    not_in_map: found.landmarks_not_in_map,
                });
            }
            (graph, GraphCounts::Reprojection(found))
        }
        GraphKind::PoseGraph => {
            let (graph, found) =
                covisibility::pose_graph(&frames, &estimate, cameras, noise, &options, request.seed)?;
            (graph, GraphCounts::PoseGraph(found))
        }
    };
    graph.put(&mut sequence);
    Ok((sequence, GraphSummary { graph: name, estimate: estimate.name, counts }))
}

/// The estimate of a name, or the only one.
///
/// # Errors
/// [`Error::Missing`] where there is none, [`Error::Several`] where none is named, and [`Error::Unknown`].
pub fn estimate_of(sequence: &Sequence, name: Option<&str>) -> Result<Estimate, Error> {
    let names: BTreeSet<&str> = sequence
        .trajectories
        .iter()
        .map(|row| row.estimate.as_str())
        .filter(|name| *name != registry::UNREFINED)
        .collect();
    let there = || names.iter().copied().collect::<Vec<_>>().join(", ");
    let name = match (name, names.len()) {
        (Some(name), _) => name,
        (None, 0) => return Err(Error::Missing { missing: "estimate", remedy: "; `os track` makes one" }),
        (None, 1) => names.first().copied().unwrap_or_default(),
        (None, _) => return Err(Error::Several { kind: "estimate", there: there() }),
    };
    let known = names.contains(name).then(|| Estimate::of(sequence, name)).flatten();
    let unknown =
        || Error::Unknown { kind: "an estimate with a trajectory,", name: name.to_owned(), there: there() };
    known.ok_or_else(unknown)
}
