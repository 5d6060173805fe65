//! A factor graph in memory, with all that an optimiser needs and nothing else.

use std::collections::{BTreeMap, BTreeSet};

use super::camera::Camera;
use super::graph::{GraphFactor, GraphLine, GraphPoint, GraphPose};
use super::id::{CameraId, FrameId};
use super::measurement_noise::MeasurementNoise;
use super::sequence::Sequence;
use super::structural_group::StructuralGroup;

/// One factor graph: initial values, factors, cameras, noise and groups. There is no truth in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FactorGraph {
    /// Name of the graph; every row has it.
    pub name: String,
    /// Cameras, as in the manifest.
    pub cameras: Vec<Camera>,
    /// The camera of each frame.
    pub camera_of_frame: BTreeMap<FrameId, CameraId>,
    /// Noise of measurements whose factor has no information matrix.
    pub noise: MeasurementNoise,
    /// Initial poses, by ascending frame.
    pub poses: Vec<GraphPose>,
    /// Initial points, by ascending id.
    pub points: Vec<GraphPoint>,
    /// Initial lines, by ascending id.
    pub lines: Vec<GraphLine>,
    /// Factors, by ascending id.
    pub factors: Vec<GraphFactor>,
    /// Structural groups; their directions are where the sequence says they are, and only their kinds and lines are
    /// given facts.
    pub groups: Vec<StructuralGroup>,
}

impl FactorGraph {
    /// The names of the graphs of a sequence, sorted.
    #[must_use]
    pub fn names(sequence: &Sequence) -> BTreeSet<String> {
        let poses = sequence.graph_poses.iter().map(|row| &row.graph);
        let points = sequence.graph_points.iter().map(|row| &row.graph);
        let lines = sequence.graph_lines.iter().map(|row| &row.graph);
        let factors = sequence.graph_factors.iter().map(|row| &row.graph);
        poses.chain(points).chain(lines).chain(factors).cloned().collect()
    }

    /// The graph of a name; `None` when the sequence has none.
    ///
    /// Directions of the groups are left out, for they may be the truth.
    #[must_use]
    pub fn of(sequence: &Sequence, name: &str) -> Option<Self> {
        macro_rules! rows {
            ($table:ident) => {{
                let mut rows: Vec<_> =
                    sequence.$table.iter().filter(|row| row.graph == name).cloned().collect();
                rows.sort_by(super::Record::compare_key);
                rows
            }};
        }
        let graph = Self {
            name: name.to_owned(),
            cameras: sequence.manifest.cameras.clone(),
            camera_of_frame: sequence.frames.iter().map(|row| (row.frame_id, row.camera_id)).collect(),
            noise: MeasurementNoise::declared(&sequence.manifest),
            poses: rows!(graph_poses),
            points: rows!(graph_points),
            lines: rows!(graph_lines),
            factors: rows!(graph_factors),
            groups: sequence.structural_groups.iter().map(StructuralGroup::without_direction).collect(),
        };
        let is_empty = graph.poses.is_empty()
            && graph.points.is_empty()
            && graph.lines.is_empty()
            && graph.factors.is_empty();
        (!is_empty).then_some(graph)
    }

    /// Puts the rows of the graph into a sequence, in place of rows of the same name; all rows get its name.
    pub fn put(self, sequence: &mut Sequence) {
        macro_rules! put {
            ($table:ident, $rows:ident) => {
                sequence.$table.retain(|row| row.graph != self.name);
                sequence.$table.extend(self.$rows.into_iter().map(|mut row| {
                    row.graph.clone_from(&self.name);
                    row
                }));
                sequence.$table.sort_by(super::Record::compare_key);
            };
        }
        put!(graph_poses, poses);
        put!(graph_points, points);
        put!(graph_lines, lines);
        put!(graph_factors, factors);
    }
}
