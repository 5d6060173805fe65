//! A factor graph into an estimate.

use std::time::{Duration, Instant};

use serde_json::json;

use super::Error;
use super::named::{check_cameras, check_name};
use crate::adjust::{Adjusted, Options, Step, Summary, Tally, adjust_watched};
use crate::structure::{Estimate, FactorGraph, FrameId, Sequence};

/// Graphs that are meant where none is named, the first of them that is there.
const USUAL: [&str; 3] = ["initial", "map-to-frame", "frame-to-frame"];

/// How to adjust; what is absent is chosen by what the sequence has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdjustRequest {
    /// What to adjust, and how.
    pub options: Options,
    /// Graph to adjust, see [`graph_to_adjust`].
    pub graph: Option<String>,
    /// Replace an estimate of the same name.
    pub replace: bool,
    /// Threads; one for each core where absent.
    pub threads: Option<usize>,
}

/// A sequence with an adjusted estimate, and how it came about.
#[derive(Clone, Debug)]
pub struct AdjustedSequence {
    /// The sequence.
    pub sequence: Sequence,
    /// The graph that was adjusted.
    pub graph: String,
    /// Name of the estimate.
    pub estimate: String,
    /// What was used, what was left out, and how it ended.
    pub summary: Summary,
    /// How long the adjustment alone took.
    pub took: Duration,
}

/// The name of the graph to adjust: the one that is named, the only one, or else `initial`, `map-to-frame` or `frame-to-frame`.
///
/// # Errors
/// [`Error::Unknown`], [`Error::Missing`] and [`Error::Several`].
pub fn graph_to_adjust(sequence: &Sequence, name: Option<&str>) -> Result<String, Error> {
    let names = FactorGraph::names(sequence);
    let there = || names.iter().cloned().collect::<Vec<_>>().join(", ");
    let found = match name {
        Some(name) if names.contains(name) => Some(name.to_owned()),
        Some(name) => {
            return Err(Error::Unknown { kind: "the graph", name: name.to_owned(), there: there() });
        }
        None => match names.len() {
            0 => {
                let remedy = "; `os graph` makes one of an estimate";
                return Err(Error::Missing { missing: "factor graph", remedy });
            }
            1 => names.first().cloned(),
            _ => USUAL.into_iter().find(|name| names.contains(*name)).map(str::to_owned),
        },
    };
    found.ok_or_else(|| Error::Several { kind: "graph", there: there() })
}

/// Adjusts a graph of a sequence, and puts the estimate into it.
///
/// * `watch` — told each step; ends the adjustment by giving `false`.
///
/// # Errors
/// [`Error::CameraModel`], [`Error::Name`], [`Error::Taken`], those of [`graph_to_adjust`], [`Error::Threads`], and those of the room
/// `adjust`.
pub fn adjust(
    mut sequence: Sequence,
    request: &AdjustRequest,
    watch: &mut (dyn FnMut(&Step) -> bool + Send),
) -> Result<AdjustedSequence, Error> {
    check_cameras(&sequence)?;
    let name = request.options.estimate_name().to_owned();
    check_name("an estimate", &name, Estimate::is_in(&sequence, &name), request.replace)?;
    let graph_name = graph_to_adjust(&sequence, request.graph.as_deref())?;
    let unknown = || Error::Unknown { kind: "the graph", name: graph_name.clone(), there: "none".to_owned() };
    let graph = FactorGraph::take(&mut sequence, &graph_name).ok_or_else(unknown)?;
    let begun = Instant::now();
    let mut run = || adjust_watched(&graph, &request.options, watch);
    let Adjusted { estimate, summary } = match request.threads {
        Some(threads) => rayon::ThreadPoolBuilder::new().num_threads(threads).build()?.install(run)?,
        None => run()?,
    };
    let took = begun.elapsed();
    graph.put(&mut sequence);
    estimate.put(&mut sequence);
    sequence.sort();
    Ok(AdjustedSequence { sequence, graph: graph_name, estimate: name, summary, took })
}

/// How an adjustment went, as `os adjust --json` prints it.
///
/// * `took` — the adjustment alone, without reading and writing.
#[must_use]
pub fn adjust_json(graph: &str, name: &str, summary: &Summary, took: Duration) -> serde_json::Value {
    let tally = |tally: &Tally| {
        let excluded: serde_json::Map<_, _> =
            tally.excluded.iter().map(|(reason, count)| (reason.words().to_owned(), json!(count))).collect();
        json!({ "used": tally.used, "excluded": excluded })
    };
    let ids = |frames: &[FrameId]| frames.iter().map(|frame| frame.0).collect::<Vec<_>>();
    json!({
        "graph": graph,
        "estimate": name,
        "ending": summary.ending.words(),
        "converged": summary.ending.has_converged(),
        "iterations": summary.iterations,
        "seconds": took.as_secs_f64(),
        "initial_cost": summary.initial_cost,
        "final_cost": summary.final_cost,
        "residual_rms_sigma": summary.residual_rms,
        "residuals": summary.residuals,
        "unknowns": summary.unknowns,
        "components": summary.components,
        "poses": tally(&summary.poses),
        "points": tally(&summary.points),
        "lines": tally(&summary.lines),
        "point_factors": tally(&summary.point_factors),
        "line_factors": tally(&summary.line_factors),
        "relative_factors": tally(&summary.relative_factors),
        "held": ids(&summary.held),
        "weak": ids(&summary.weak),
        "carried": ids(&summary.carried),
        "unconstrained": ids(&summary.unconstrained),
        "behind": summary.behind.iter().map(|point| point.0).collect::<Vec<_>>(),
        "grouped_lines": summary.grouped,
        "released_lines": summary.released.iter().map(|line| json!({
            "line_id": line.line_id.0,
            "group_id": line.group_id.0,
            "angle_deg": line.angle_rad.to_degrees(),
            "chi_squared": line.chi_squared,
        })).collect::<Vec<_>>(),
    })
}
