//! `graph`: an estimate into a factor graph about it.

use open_structure::covisibility::{KeyFrameRule, LoopRule};
use open_structure::stations::{self, GraphKind, GraphRequest};
use open_structure::structure;
use pyo3::prelude::*;

use crate::arguments::{Given, at_least_one, choice};
use crate::errors;
use crate::sequence::Sequence;
use crate::work;

/// The sequence with a factor graph about an estimate, which ``adjust`` takes; options as of ``os graph``.
///
/// * ``estimate``: estimate to begin with; may be left out when the sequence has one alone.
/// * ``kind``: ``reprojection``, a factor for each measurement, or ``pose-graph``, relative poses and loop closures.
/// * ``name``: name of the graph; by default that of the estimate, with ``-pose-graph`` for one.
/// * ``min_views``: frames that have to see a landmark for it to be a vertex.
/// * ``key_frames``: take key frames alone, which share at most ``most_shared`` (0.8) of their landmarks with the one before and
///   lie at most ``longest_gap`` (30) frames apart.
/// * ``loop_gap``: frames for which a landmark was not seen before it closes a loop (30).
/// * ``loop_shared``: landmarks that have to return for a loop to be closed (12).
/// * ``no_loops``: close no loops.
/// * ``seed``: seed of the consensus of loop closures.
/// * ``replace``: replace a graph of the same name.
#[pyfunction]
#[pyo3(signature = (sequence, *, estimate = None, kind = "reprojection", name = None, min_views = 2, key_frames = false, most_shared = None, longest_gap = None, loop_gap = None, loop_shared = None, no_loops = false, seed = 0, replace = false))]
#[expect(clippy::too_many_arguments, reason = "the options of a command, by name")]
pub(crate) fn graph(
    py: Python<'_>,
    sequence: Given<'_>,
    estimate: Option<String>,
    kind: &str,
    name: Option<String>,
    min_views: usize,
    key_frames: bool,
    most_shared: Option<f64>,
    longest_gap: Option<usize>,
    loop_gap: Option<usize>,
    loop_shared: Option<usize>,
    no_loops: bool,
    seed: u64,
    replace: bool,
) -> PyResult<Sequence> {
    let kinds = [("reprojection", GraphKind::Reprojection), ("pose-graph", GraphKind::PoseGraph)];
    if !key_frames && (most_shared.is_some() || longest_gap.is_some()) {
        return Err(errors::option("most_shared and longest_gap go with key_frames"));
    }
    let (rule, loops) = (KeyFrameRule::default(), LoopRule::default());
    let request = GraphRequest {
        estimate,
        kind: choice("kind", kind, &kinds)?,
        name,
        min_views: at_least_one("min_views", min_views)?,
        key_frames: key_frames.then(|| KeyFrameRule {
            most_shared: most_shared.unwrap_or(rule.most_shared),
            longest_gap: longest_gap.unwrap_or(rule.longest_gap),
        }),
        loops: (!no_loops).then_some(LoopRule {
            gap: at_least_one("loop_gap", loop_gap.unwrap_or(loops.gap))?,
            least_shared: loop_shared.unwrap_or(loops.least_shared),
            ..loops
        }),
        seed,
        replace,
    };
    let input = sequence.rows()?;
    let (made, summary) =
        work::run(py, errors::of_station, |_| stations::graph(structure::Sequence::clone(&input), &request))?;
    Ok(Sequence::made(made, summary.to_json()))
}
