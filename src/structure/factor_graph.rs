//! A factor graph in memory, with all that an optimiser needs and nothing else.

use std::collections::{BTreeMap, BTreeSet};
use std::mem;

use super::camera::Camera;
use super::graph::{GraphFactor, GraphLine, GraphPoint, GraphPose};
use super::id::{CameraId, FrameId};
use super::measurement_noise::MeasurementNoise;
use super::record::Record;
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
            ($table:ident) => {
                sequence.$table.iter().filter(|row| row.graph == name).cloned().collect()
            };
        }
        Self::about(
            sequence,
            name,
            rows!(graph_poses),
            rows!(graph_points),
            rows!(graph_lines),
            rows!(graph_factors),
        )
    }

    /// The graph of a name as of [`FactorGraph::of`], its rows moved out of the sequence; [`FactorGraph::put`] brings them back.
    ///
    /// A graph of ten million factors takes gigabytes, which are there once so.
    #[must_use]
    pub fn take(sequence: &mut Sequence, name: &str) -> Option<Self> {
        macro_rules! rows {
            ($table:ident) => {
                if sequence.$table.iter().all(|row| row.graph == name) {
                    mem::take(&mut sequence.$table)
                } else {
                    sequence.$table.extract_if(.., |row| row.graph == name).collect()
                }
            };
        }
        let (poses, points) = (rows!(graph_poses), rows!(graph_points));
        let (lines, factors) = (rows!(graph_lines), rows!(graph_factors));
        Self::about(sequence, name, poses, points, lines, factors)
    }

    /// The rows of a graph, sorted, with what the sequence says about them; `None` without rows.
    fn about(
        sequence: &Sequence,
        name: &str,
        mut poses: Vec<GraphPose>,
        mut points: Vec<GraphPoint>,
        mut lines: Vec<GraphLine>,
        mut factors: Vec<GraphFactor>,
    ) -> Option<Self> {
        if poses.is_empty() && points.is_empty() && lines.is_empty() && factors.is_empty() {
            return None;
        }
        poses.sort_by(Record::compare_key);
        points.sort_by(Record::compare_key);
        lines.sort_by(Record::compare_key);
        factors.sort_by(Record::compare_key);
        Some(Self {
            name: name.to_owned(),
            cameras: sequence.manifest.cameras.clone(),
            camera_of_frame: sequence.frames.iter().map(|row| (row.frame_id, row.camera_id)).collect(),
            noise: MeasurementNoise::declared(&sequence.manifest),
            poses,
            points,
            lines,
            factors,
            groups: sequence.structural_groups.iter().map(StructuralGroup::without_direction).collect(),
        })
    }

    /// Puts the rows of the graph into a sequence, in place of rows of the same name; all rows get its name.
    pub fn put(self, sequence: &mut Sequence) {
        macro_rules! put {
            ($table:ident, $rows:ident) => {
                let mut rows = self.$rows;
                rows.iter_mut().for_each(|row| row.graph.clone_from(&self.name));
                sequence.$table.retain(|row| row.graph != self.name);
                // Where there is no other graph, no row is moved.
                if !sequence.$table.is_empty() {
                    rows.splice(..0, mem::take(&mut sequence.$table));
                }
                sequence.$table = rows;
                sequence.$table.sort_by(Record::compare_key);
            };
        }
        put!(graph_poses, poses);
        put!(graph_points, points);
        put!(graph_lines, lines);
        put!(graph_factors, factors);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{FrameId, PointId};

    fn graph(name: &str, points: &[i64]) -> FactorGraph {
        let point =
            |id: &i64| GraphPoint { graph: name.to_owned(), point_id: PointId(*id), ..GraphPoint::default() };
        let factor = |id: &i64| GraphFactor {
            graph: name.to_owned(),
            factor_id: *id,
            frame_id: Some(FrameId(7)),
            point_id: Some(PointId(*id)),
            ..GraphFactor::default()
        };
        FactorGraph {
            name: name.to_owned(),
            points: points.iter().map(point).collect(),
            factors: points.iter().map(factor).collect(),
            ..FactorGraph::default()
        }
    }

    #[test]
    fn what_is_taken_is_what_is_there_and_comes_back_where_it_was() {
        let mut sequence = Sequence::default();
        graph("b", &[1, 3, 4]).put(&mut sequence);
        for others in [&[][..], &[2, 5]] {
            if !others.is_empty() {
                graph("a", others).put(&mut sequence);
                graph("c", others).put(&mut sequence);
            }
            let before = sequence.clone();
            let there = FactorGraph::of(&sequence, "b");
            let taken = FactorGraph::take(&mut sequence, "b").unwrap();
            assert_eq!(Some(&taken), there.as_ref());
            assert_eq!(taken.factors.len(), 3);
            assert!(FactorGraph::of(&sequence, "b").is_none());
            assert_eq!(sequence.graph_factors.len(), 2 * others.len());
            taken.put(&mut sequence);
            assert_eq!(sequence, before);
        }
        assert!(FactorGraph::take(&mut sequence, "d").is_none());
    }
}
