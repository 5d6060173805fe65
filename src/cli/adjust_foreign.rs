//! `os adjust` of graphs and problems of other programs.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Write};
use std::path::Path;

use anyhow::{Context, bail};

use super::adjust::Args;
use super::export::refuse_input;
use super::foreign::{Foreign, has_extension};
use super::import::{name, source_files};
use super::{Outcome, extended, text};
use crate::adjust::{
    Adjusted, BalAdjusted, BalBundle, BalView, Loss, Method, SolverOptions, adjust_bal, adjust_watched,
    iterations,
};
use crate::exchange::{
    self, BalCamera, BalProblem, ImportNames, Imported, Remark, bal_estimate, from_bal, from_g2o, read_bal,
    read_g2o, with_estimate,
};
use crate::format::{self, Partial};
use crate::stations::check_name;
use crate::storage;
use crate::structure::{FactorGraph, Sequence, registry};

/// The graph that is read.
const GRAPH: &str = "initial";
/// The usual name of the estimate of a problem of BAL.
const BAL_ESTIMATE: &str = "bal";

pub(super) fn run(args: &Args, from: Foreign, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let as_file = is_file_of(&args.output, from)?;
    refuse_idle(args, from, as_file)?;
    if storage::is_folder(&args.input) {
        bail!("{}: expected {}, found a folder", args.input.display(), from.words());
    }
    refuse_input(&args.input, &args.output)?;
    if !args.force && storage::is_taken(&args.output)? {
        return Err(format::Error::Exists { path: args.output.clone() }.into());
    }
    match from {
        Foreign::G2o => run_g2o(args, as_file, stdout),
        Foreign::Bal => run_bal(args, as_file, stdout),
    }
}

/// Whether the output is a file of the input's kind, otherwise a sequence; refuses the other kind.
fn is_file_of(output: &Path, from: Foreign) -> anyhow::Result<bool> {
    let other = match from {
        Foreign::G2o => Foreign::Bal,
        Foreign::Bal => Foreign::G2o,
    };
    if has_extension(output, other) {
        bail!(
            "{}: {} becomes NAME.{}, NAME.mcap or a folder, not {}",
            output.display(),
            from.words(),
            from.extension(),
            other.words()
        );
    }
    Ok(has_extension(output, from))
}

/// Refuses an output that looks like a file of another program, for a sequence that is adjusted.
pub(super) fn refuse_output_of_others(output: &Path) -> anyhow::Result<()> {
    for (kind, to) in [(Foreign::G2o, "g2o"), (Foreign::Bal, "bal")] {
        if has_extension(output, kind) {
            bail!(
                "{}: a sequence becomes a sequence, NAME.mcap or a folder; `os export --to {to}` makes {} of it",
                output.display(),
                kind.words()
            );
        }
    }
    Ok(())
}

/// Refuses options for which there is no use: who gives them expects something of them.
fn refuse_idle(args: &Args, from: Foreign, as_file: bool) -> anyhow::Result<()> {
    let of_sequences = [("--graph", args.graph.is_some()), ("--replace", args.replace)];
    let of_rows = [("--name", args.name.is_some()), ("--covariance", args.covariance)];
    let of_graphs = [
        ("--method", args.method.is_some()),
        ("--points", args.points.is_some()),
        ("--lines", args.lines.is_some()),
        ("--min-views", args.min_views.is_some()),
        ("--fix", !args.fix.is_empty()),
        ("--sigma-px", args.sigma_px.is_some()),
        ("--soft", args.soft.is_some()),
        ("--no-groups", args.no_groups),
        ("--no-motion", args.no_motion),
        ("--covariance", args.covariance),
    ];
    let given =
        |options: &[(&'static str, bool)]| options.iter().find(|(_, given)| *given).map(|(name, _)| *name);
    if let Some(option) = given(&of_sequences) {
        bail!("{option} goes with a sequence, not with {}", from.words());
    }
    if let Some(option) = given(&of_graphs).filter(|_| from == Foreign::Bal) {
        bail!(
            "{option} does not go with a problem of BAL, whose camera says what is adjusted; `os import` makes a sequence of it"
        );
    }
    if let Some(option) = given(&of_rows).filter(|_| as_file) {
        bail!("{option} goes with an output that is a sequence");
    }
    Ok(())
}

fn run_g2o(args: &Args, as_file: bool, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let model = read(&args.input, read_g2o)?;
    let names = names(args)?;
    let Imported { mut sequence, remarks } =
        from_g2o(&model, &names).with_context(|| args.input.display().to_string())?;
    let graph = FactorGraph::of(&sequence, GRAPH)
        .with_context(|| format!("{}: has no vertices and edges", args.input.display()))?;
    let has_points = graph.factors.iter().any(|factor| factor.kind == registry::POINT_REPROJECTION);
    let options = args.options(if has_points { Method::Point } else { Method::PoseGraph });
    let outcome = told(&remarks, as_file)?;
    let idle = match options.method {
        Method::PoseGraph => ("points in frames", registry::POINT_REPROJECTION),
        _ => ("relative poses", registry::RELATIVE_POSE),
    };
    let idle_count = graph.factors.iter().filter(|factor| factor.kind == idle.1).count();
    if idle_count > 0 {
        let (count, method) = (text::count(idle_count as u64), options.method.name());
        writeln!(io::stderr(), "note: {count} {} have no part in the method {method}", idle.0)?;
    }
    let (Adjusted { estimate, summary }, took) =
        args.watched(|watch| adjust_watched(&graph, &options, watch))?;
    let outcome = args.outcome(&summary, outcome)?;
    let size = if as_file {
        let moved = with_estimate(&model, &estimate);
        into_file(&args.output, args.force, |output| exchange::write_g2o(output, &moved))?
    } else {
        sequence.manifest.source.files = source_files(vec![args.input.clone()])?;
        estimate.put(&mut sequence);
        write(args, sequence)?
    };
    args.tell([GRAPH, options.estimate_name()], &summary, took, &size, stdout)?;
    Ok(outcome)
}

fn run_bal(args: &Args, as_file: bool, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let problem = read(&args.input, read_bal)?;
    let names = names(args)?;
    let bundle = BalBundle {
        cameras: problem.cameras.iter().map(BalCamera::numbers).collect(),
        points: problem.points.clone(),
        views: problem
            .observations
            .iter()
            .map(|seen| BalView { camera: seen.camera, point: seen.point, pixel: seen.pixel })
            .collect(),
    };
    let (loss, solver) = (args.loss.unwrap_or(Loss::None), args.solver(SolverOptions::default()));
    let (adjusted, took) = args.watched(|watch| adjust_bal(&bundle, loss, &solver, watch))?;
    let BalAdjusted { cameras, points, steps, summary } = adjusted;
    let mut outcome = args.outcome(&summary, Outcome::Done)?;
    let cameras = cameras.into_iter().map(BalCamera::from_numbers).collect();
    let moved = BalProblem { cameras, points, observations: problem.observations.clone() };
    let estimate_name = args.name.as_deref().unwrap_or(BAL_ESTIMATE);
    let size = if as_file {
        into_file(&args.output, args.force, |output| exchange::write_bal(output, &moved))?
    } else {
        // A sequence has one set of cameras, by which its pixels are undistorted: the one that the estimate goes with.
        let cameras = problem.cameras.iter().zip(&moved.cameras);
        let cameras =
            cameras.map(|(before, after)| BalCamera { focal: after.focal, radial: after.radial, ..*before });
        let initial = BalProblem { cameras: cameras.collect(), ..problem };
        let Imported { mut sequence, remarks } =
            from_bal(&initial, &names).with_context(|| args.input.display().to_string())?;
        if told(&remarks, as_file)? == Outcome::Findings {
            outcome = Outcome::Findings;
        }
        sequence.manifest.source.files = source_files(vec![args.input.clone()])?;
        let mut estimate = bal_estimate(&moved, estimate_name);
        estimate.iterations = iterations(estimate_name, &steps);
        estimate.put(&mut sequence);
        write(args, sequence)?
    };
    args.tell([GRAPH, estimate_name], &summary, took, &size, stdout)?;
    Ok(outcome)
}

fn names(args: &Args) -> anyhow::Result<ImportNames> {
    check_name("an estimate", args.name.as_deref().unwrap_or(BAL_ESTIMATE), false, false)?;
    Ok(ImportNames { sequence: name(None, &args.input)?, graph: GRAPH.to_owned() })
}

fn read<T>(
    path: &Path,
    parse: impl FnOnce(BufReader<storage::File>) -> Result<T, exchange::Error>,
) -> anyhow::Result<T> {
    let open = storage::File::open(path).map(BufReader::new).with_context(|| path.display().to_string())?;
    parse(open).with_context(|| path.display().to_string())
}

/// Says what was left out on the way in and, where a sequence is written, what is said in another way there.
fn told(remarks: &[Remark], as_file: bool) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::Done;
    for remark in remarks.iter().filter(|remark| remark.loss || !as_file) {
        let word = if remark.loss { "warning" } else { "note" };
        writeln!(io::stderr(), "{word}: {remark}")?;
        if remark.loss {
            outcome = Outcome::Findings;
        }
    }
    Ok(outcome)
}

fn write(args: &Args, mut sequence: Sequence) -> anyhow::Result<String> {
    sequence.sort();
    extended::write(&args.output, sequence, args.force)
}

/// Writes a file under another name first; gives how large it is, in words.
fn into_file(
    path: &Path,
    force: bool,
    fill: impl FnOnce(&mut dyn Write) -> Result<(), exchange::Error>,
) -> anyhow::Result<String> {
    let partial = Partial::new(path, force)?;
    let mut output = BufWriter::new(File::create(partial.path())?);
    fill(&mut output)?;
    output.flush()?;
    drop(output);
    partial.finish()?;
    Ok(text::bytes(storage::size(path, &[])))
}
