//! `adjust`: a factor graph into an estimate.

use open_structure::adjust::{
    Eliminate, Factorisation, LineKind, Loss, Method, Optimiser, Options, Parallelism, PointForm,
    SolverOptions,
};
use open_structure::stations::{self, AdjustRequest};
use open_structure::structure::{self, FrameId};
use pyo3::prelude::*;

use crate::arguments::{Given, at_least_one, choice, not_negative, positive};
use crate::errors;
use crate::sequence::Sequence;
use crate::work;

/// Most threads that may be asked for; more only cost memory.
const MOST_THREADS: usize = 1024;

/// The sequence with a graph's poses and landmarks moved to where the measurements agree best; options as of ``os adjust``.
///
/// ``summary`` of what comes back says how it went; the table ``iterations`` has every step. The same input gives the same
/// numbers on any number of threads. An interrupt ends it at the next step.
///
/// * ``method``: ``point``, ``point-line``, ``structural`` or ``pose-graph``.
/// * ``graph``: graph to adjust; needed where there are several and none is ``initial``.
/// * ``name``: name of the estimate; by default ``point-ba``, ``point-line-ba``, ``structural-ba`` or ``pose-graph``.
/// * ``points``: how points are kept: ``xyz``, ``inverse-depth`` or ``parallax``.
/// * ``lines``: how lines are kept: ``orthonormal``, ``endpoints`` or ``plucker-cayley``.
/// * ``loss``: robust loss, KIND or KIND:SCALE in units of sigma, of ``none``, ``huber``, ``cauchy``, ``tukey`` and
///   ``geman-mcclure``; by default ``cauchy:1`` for point and point-line, ``huber:3`` for structural, ``none`` for pose-graph.
/// * ``optimiser``: ``lm`` or ``dogleg``.
/// * ``max_iterations``: steps at most.
/// * ``tolerance``: stop when a step lowers the cost by less than this part of it.
/// * ``min_views``: leave out landmarks that fewer frames see.
/// * ``fix``: frames whose poses are held.
/// * ``sigma_px``: standard deviation of pixel coordinates, in place of the declared one.
/// * ``soft``: draw parallel lines to the direction of their group, by this many degrees, in place of one direction for all.
/// * ``no_groups``: make no use of structural groups.
/// * ``no_motion``: let frames that see too little go where noise carries them.
/// * ``eliminate``: what the solver eliminates first: ``landmarks``, ``poses`` or ``nothing``; by default what costs least.
/// * ``factorise``: how the solver factorises the rest: ``dense``, ``sparse`` or ``iterative``; by default what costs least.
/// * ``covariance``: store covariances of poses and landmarks.
/// * ``replace``: replace an estimate of the same name.
/// * ``threads``: threads; by default one for each core.
#[pyfunction]
#[pyo3(signature = (sequence, *, method = "point-line", graph = None, name = None, points = None, lines = None, loss = None, optimiser = "lm", max_iterations = None, tolerance = None, min_views = None, fix = Vec::new(), sigma_px = None, soft = None, no_groups = false, no_motion = false, eliminate = None, factorise = None, covariance = false, replace = false, threads = None))]
#[pyo3(
    text_signature = "(sequence, *, method='point-line', graph=None, name=None, points=None, lines=None, loss=None, optimiser='lm', max_iterations=None, tolerance=None, min_views=None, fix=(), sigma_px=None, soft=None, no_groups=False, no_motion=False, eliminate=None, factorise=None, covariance=False, replace=False, threads=None)"
)]
#[expect(
    clippy::too_many_arguments,
    clippy::fn_params_excessive_bools,
    reason = "the options of a command, by name"
)]
pub(crate) fn adjust(
    py: Python<'_>,
    sequence: Given<'_>,
    method: &str,
    graph: Option<String>,
    name: Option<String>,
    points: Option<&str>,
    lines: Option<&str>,
    loss: Option<&str>,
    optimiser: &str,
    max_iterations: Option<usize>,
    tolerance: Option<f64>,
    min_views: Option<usize>,
    fix: Vec<i64>,
    sigma_px: Option<f64>,
    soft: Option<f64>,
    no_groups: bool,
    no_motion: bool,
    eliminate: Option<&str>,
    factorise: Option<&str>,
    covariance: bool,
    replace: bool,
    threads: Option<usize>,
) -> PyResult<Sequence> {
    let method = choice("method", method, &Method::ALL.map(|method| (method.name(), method)))?;
    let of_structural = [("soft", soft.is_some()), ("no_groups", no_groups), ("no_motion", no_motion)];
    let idle = of_structural.into_iter().find(|(_, given)| *given && method != Method::Structural);
    if let Some((option, _)) = idle {
        return Err(errors::option(format!("{option} goes with method `structural`")));
    }
    if soft.is_some() && no_groups {
        return Err(errors::option("soft does not go with no_groups"));
    }
    let usual = Options::of(method);
    let solver = SolverOptions {
        optimiser: choice(
            "optimiser",
            optimiser,
            &[("lm", Optimiser::LevenbergMarquardt), ("dogleg", Optimiser::DogLeg)],
        )?,
        max_iterations: max_iterations.unwrap_or(usual.solver.max_iterations),
        function_tolerance: match tolerance {
            Some(tolerance) => not_negative("tolerance", tolerance)?,
            None => usual.solver.function_tolerance,
        },
        eliminate: match eliminate {
            Some(found) => choice(
                "eliminate",
                found,
                &[
                    ("landmarks", Eliminate::Landmarks),
                    ("poses", Eliminate::Poses),
                    ("nothing", Eliminate::Nothing),
                ],
            )?,
            None => Eliminate::Cheapest,
        },
        factorisation: match factorise {
            Some(found) => choice(
                "factorise",
                found,
                &[
                    ("dense", Factorisation::Dense),
                    ("sparse", Factorisation::Sparse),
                    ("iterative", Factorisation::Iterative),
                ],
            )?,
            None => Factorisation::Cheapest,
        },
        ..usual.solver
    };
    let point_forms = [
        ("xyz", PointForm::Xyz),
        ("inverse-depth", PointForm::InverseDepth),
        ("parallax", PointForm::Parallax),
    ];
    let line_forms = [
        ("orthonormal", LineKind::Orthonormal),
        ("endpoints", LineKind::Endpoints),
        ("plucker-cayley", LineKind::PluckerCayley),
    ];
    let options = Options {
        name,
        points: points.map_or(Ok(usual.points), |found| choice("points", found, &point_forms))?,
        lines: lines.map_or(Ok(usual.lines), |found| choice("lines", found, &line_forms))?,
        parallelism: match soft {
            Some(degrees) => Parallelism::Soft { sigma_rad: positive("soft", degrees)?.to_radians() },
            None if no_groups => Parallelism::Ignored,
            None => usual.parallelism,
        },
        loss: match loss {
            Some(loss) => loss.parse::<Loss>().map_err(|cause| errors::option(format!("loss: {cause}")))?,
            None => usual.loss,
        },
        sigma_px: sigma_px.map(|sigma| positive("sigma_px", sigma)).transpose()?,
        min_views: min_views.map_or(Ok(usual.min_views), |views| at_least_one("min_views", views))?,
        fix: fix.into_iter().map(FrameId).collect(),
        smooth_motion: !no_motion,
        covariance,
        solver,
        ..usual
    };
    if let Some(threads) = threads {
        at_least_one("threads", threads)?;
        if threads > MOST_THREADS {
            return Err(errors::option(format!("threads: expected at most {MOST_THREADS}, found {threads}")));
        }
    }
    let (input, request) = (sequence.rows()?, AdjustRequest { options, graph, replace, threads });
    let found = work::run(py, errors::of_station, |watch| {
        stations::adjust(structure::Sequence::clone(&input), &request, &mut |_| watch.goes_on())
    })?;
    if let Some(cause) = &found.summary.no_covariance {
        py.import("warnings")?.call_method1("warn", (format!("no covariances: {cause}"),))?;
    }
    let summary = stations::adjust_json(&found.graph, &found.estimate, &found.summary, found.took);
    Ok(Sequence::made(found.sequence, summary))
}
