//! Factor graphs: vertices, the shape of factors, information matrices.

use std::collections::{BTreeMap, BTreeSet};

use super::estimates::remember;
use super::finding::{Detail, Findings};
use super::frames::{FrameIndex, quaternion};
use super::ids::Unknown;
use super::positive::is_positive;
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::structure::{GraphFactor, GraphLine, GraphPoint, GraphPose, registry};

const FACTORS: Option<&str> = Some("graph_factors");

/// Vertices of one kind, by graph.
#[derive(Default)]
struct Vertices(BTreeMap<String, Vec<i64>>);

impl Vertices {
    fn add(&mut self, graph: &str, id: i64) {
        match self.0.get_mut(graph) {
            Some(ids) => ids.push(id),
            None => drop(self.0.insert(graph.to_owned(), vec![id])),
        }
    }

    fn sort(&mut self) {
        self.0.values_mut().for_each(|ids| ids.sort_unstable());
    }

    fn contains(&self, graph: &str, id: i64) -> bool {
        self.0.get(graph).is_some_and(|ids| ids.binary_search(&id).is_ok())
    }
}

/// Checks the four tables of graphs; gives their outcomes by table.
pub(crate) fn graphs(
    shared: &Shared<'_>,
    frames: &FrameIndex,
    kinds: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> Vec<(&'static str, Outcome)> {
    let (mut poses, mut points, mut lines) = (Vertices::default(), Vertices::default(), Vertices::default());
    let mut unknown = Unknown::default();
    let pose_outcome = check::<GraphPose>(shared, findings, |batch, first_row, _, findings| {
        for (row, pose) in (first_row..).zip(batch) {
            quaternion(&pose.world_from_camera(), row, "graph_poses", findings);
            if !frames.contains(pose.frame_id.0) {
                unknown.add(pose.frame_id.0, row);
            }
            poses.add(&pose.graph, pose.frame_id.0);
        }
    });
    unknown.report(RuleId::FrameKnown, "graph_poses", "frame", "frames", findings);
    let point_outcome = check::<GraphPoint>(shared, findings, |batch, _, _, _| {
        for point in batch {
            points.add(&point.graph, point.point_id.0);
        }
    });
    let line_outcome = check::<GraphLine>(shared, findings, |batch, _, _, _| {
        for line in batch {
            lines.add(&line.graph, line.line_id.0);
        }
    });
    [&mut poses, &mut points, &mut lines].into_iter().for_each(Vertices::sort);
    let factor_outcome = check::<GraphFactor>(shared, findings, |batch, first_row, _, findings| {
        remember(kinds, batch.iter().map(|factor| &factor.kind));
        for (row, factor) in (first_row..).zip(batch) {
            let pose = |id: i64| poses.contains(&factor.graph, id);
            let vertices = [
                ("frame", factor.frame_id.map(|id| id.0).filter(|id| !pose(*id)), "graph_poses"),
                ("frame", factor.other_frame_id.map(|id| id.0).filter(|id| !pose(*id)), "graph_poses"),
                (
                    "point",
                    factor.point_id.map(|id| id.0).filter(|id| !points.contains(&factor.graph, *id)),
                    "graph_points",
                ),
                (
                    "line",
                    factor.line_id.map(|id| id.0).filter(|id| !lines.contains(&factor.graph, *id)),
                    "graph_lines",
                ),
            ];
            for (word, missing, table) in vertices {
                if let Some(id) = missing {
                    findings.add(RuleId::GraphVerticesKnown, FACTORS, || {
                        let expected = format!("{word} {id} in {table} of graph `{}`", factor.graph);
                        Detail::new(expected, "not there").row(row).id(format!("factor {}", factor.factor_id))
                    });
                }
            }
            shape(factor, row, findings);
            information(factor, row, findings);
        }
    });
    vec![
        ("graph_poses", pose_outcome),
        ("graph_points", point_outcome),
        ("graph_lines", line_outcome),
        ("graph_factors", factor_outcome),
    ]
}

fn shape(factor: &GraphFactor, row: u64, findings: &mut Findings) {
    let Some(shape) = registry::factor_shape(&factor.kind) else { return };
    let named = [
        ("frame_id", factor.frame_id.is_some()),
        ("other_frame_id", factor.other_frame_id.is_some()),
        ("point_id", factor.point_id.is_some()),
        ("line_id", factor.line_id.is_some()),
        ("group_id", factor.group_id.is_some()),
    ];
    let mut broken = |expected: String, found: String| {
        findings.add(RuleId::GraphFactorShape, FACTORS, || {
            let id = format!("factor {} of graph `{}`", factor.factor_id, factor.graph);
            Detail::new(expected, found).row(row).id(id)
        });
    };
    for (column, there) in named {
        let wanted = shape.columns.contains(&column);
        if there != wanted {
            let word = |there: bool| if there { "a value" } else { "null" };
            broken(
                format!("{} in {column} of a {} factor", word(wanted), factor.kind),
                word(there).to_owned(),
            );
        }
    }
    let count = factor.measurement.len();
    let Some(size) = shape.sizes.iter().find(|size| size.measurement == count) else {
        let counts: Vec<String> = shape.sizes.iter().map(|size| size.measurement.to_string()).collect();
        let expected = format!("a measurement of {} numbers for {}", counts.join(" or "), factor.kind);
        broken(expected, format!("{count} numbers"));
        return;
    };
    if let Some(information) = &factor.information {
        let dimension = size.dimension;
        let wanted = dimension * (dimension + 1) / 2;
        if information.len() != wanted {
            let expected =
                format!("the {wanted} numbers of the upper triangle of a {dimension}x{dimension} matrix");
            broken(expected, format!("{} numbers", information.len()));
        }
    }
}

/// The dimension of a matrix whose upper triangle has so many numbers.
fn dimension_of(count: usize) -> Option<usize> {
    (1..=64).find(|dimension| dimension * (dimension + 1) / 2 == count)
}

fn information(factor: &GraphFactor, row: u64, findings: &mut Findings) {
    let Some(numbers) = factor.information.as_deref().filter(|numbers| !numbers.is_empty()) else { return };
    // What is not finite is a finding of its own.
    let Some(dimension) = dimension_of(numbers.len()) else { return };
    if numbers.iter().all(|number| number.is_finite()) && !is_positive(numbers, dimension) {
        findings.add(RuleId::GraphInformationPositive, FACTORS, || {
            let id = format!("factor {} of graph `{}`", factor.factor_id, factor.graph);
            let found = format!("a {dimension}x{dimension} matrix with a negative eigenvalue");
            Detail::new("a positive semi-definite information matrix", found).row(row).id(id)
        });
    }
}
