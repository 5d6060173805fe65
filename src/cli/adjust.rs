//! `os adjust`: a factor graph into an estimate.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Context;
use serde_json::json;

use super::progress::Progress;
use super::{Outcome, extended, parsed, text};
use crate::adjust::{
    Adjusted, Eliminate, Factorisation, LineKind, Loss, Method, Optimiser, Options, Parallelism, PointForm,
    SolverOptions, Summary, Tally, adjust_watched,
};
use crate::structure::{Estimate, FactorGraph, FrameId, Sequence};

/// Names listed of a kind of frame or line before the rest is only counted.
const MOST_NAMES: usize = 8;

/// Adjust a factor graph: move poses and landmarks to where the measurements agree best.
///
/// The output is the input with the estimate added: trajectory, map and the optimiser's steps. What cannot be used is left out and
/// counted. Parallel lines are taken from the sequence's structural groups, not from factors of kind `parallelism`, which say the same.
/// The same input gives the same bytes on any number of threads.
#[derive(clap::Args, Debug)]
#[command(after_help = "Methods:
  point        poses and points by pixels (the paper's Point-BA)
  point-line   poses, points and lines by pixels (the paper's PointLine-BA)
  structural   with depths, parallel lines and the declared noise
  pose-graph   poses by relative poses

Losses, in units of sigma: none, huber:1.345, cauchy:1, tukey:4.685, geman-mcclure:3

Examples:
  os adjust graph.mcap -o adjusted.mcap --method structural --covariance
  os adjust box1 -o adjusted.mcap --method point --replace
  os adjust box1 -o again/ --method point-line --lines endpoints --loss huber:2 --name endpoints")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(super) struct Args {
    /// Sequence with a factor graph: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// What is adjusted with what.
    #[arg(long, value_enum, default_value_t = MethodName::PointLine)]
    method: MethodName,
    /// Graph to adjust; needed where there are several and none is `initial`.
    #[arg(long, value_name = "NAME")]
    graph: Option<String>,
    /// Name of the estimate [default: point-ba, point-line-ba, structural-ba or pose-graph].
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// How points are kept.
    #[arg(long, value_enum, default_value_t = PointName::Xyz)]
    points: PointName,
    /// How lines are kept.
    #[arg(long, value_enum, default_value_t = LineName::Orthonormal)]
    lines: LineName,
    /// Robust loss, KIND or KIND:SCALE [default: cauchy:1 for point and point-line, huber:3 for structural, none for pose-graph].
    #[arg(long, value_name = "LOSS", value_parser = str::parse::<Loss>)]
    loss: Option<Loss>,
    /// How steps are found.
    #[arg(long, value_enum, default_value_t = OptimiserName::Lm)]
    optimiser: OptimiserName,
    /// Steps at most.
    #[arg(long, value_name = "N")]
    max_iterations: Option<usize>,
    /// Stop when a step lowers the cost by less than this part of it.
    #[arg(long, value_name = "F", value_parser = parsed::not_negative)]
    tolerance: Option<f64>,
    /// Leave out landmarks that fewer frames see.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = parsed::at_least_one)]
    min_views: usize,
    /// Hold the pose of this frame; may be given several times.
    #[arg(long, value_name = "FRAME")]
    fix: Vec<i64>,
    /// Standard deviation of pixel coordinates, in place of the declared one.
    #[arg(long, value_name = "PX", value_parser = parsed::positive)]
    sigma_px: Option<f64>,
    /// Draw parallel lines to the direction of their group, by this many degrees of standard deviation, in place of one direction for
    /// all (structural).
    #[arg(long, value_name = "DEGREES", num_args = 0..=1, default_missing_value = "0.5", value_parser = parsed::positive)]
    soft: Option<f64>,
    /// Make no use of structural groups (structural).
    #[arg(long, conflicts_with = "soft")]
    no_groups: bool,
    /// Let frames that see too little go where noise carries them, in place of moving as they did at the start (structural).
    #[arg(long)]
    no_motion: bool,
    /// What the solver eliminates first [default: whatever costs least].
    #[arg(long, value_enum, value_name = "WHAT")]
    eliminate: Option<EliminateName>,
    /// How the solver factorises the rest [default: whatever costs least].
    #[arg(long, value_enum, value_name = "HOW")]
    factorise: Option<FactoriseName>,
    /// Say how the solver goes about it, with the cost of the other ways.
    #[arg(long)]
    explain: bool,
    /// Store covariances of poses and landmarks.
    #[arg(long)]
    covariance: bool,
    /// Replace an estimate of the same name.
    #[arg(long)]
    replace: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
    /// Threads [default: one for each core].
    #[arg(long, value_name = "N", value_parser = parsed::threads)]
    threads: Option<usize>,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum MethodName {
    Point,
    PointLine,
    Structural,
    PoseGraph,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum PointName {
    Xyz,
    InverseDepth,
    Parallax,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum LineName {
    Orthonormal,
    Endpoints,
    PluckerCayley,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum OptimiserName {
    /// Levenberg-Marquardt.
    Lm,
    /// Powell's dog-leg.
    Dogleg,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum EliminateName {
    /// Points and lines.
    Landmarks,
    /// Poses.
    Poses,
    /// Nothing: all unknowns at once.
    Nothing,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum FactoriseName {
    /// As a full matrix.
    Dense,
    /// By its non-zero parts.
    Sparse,
}

impl Args {
    /// Refuses options that the method has no use for: who gives them expects something of them.
    fn refuse_idle(&self) -> anyhow::Result<()> {
        let of_structural = [
            ("--soft", self.soft.is_some()),
            ("--no-groups", self.no_groups),
            ("--no-motion", self.no_motion),
        ];
        let idle = of_structural.into_iter().find(|(_, given)| *given);
        if let Some((option, _)) = idle.filter(|_| !matches!(self.method, MethodName::Structural)) {
            anyhow::bail!("{option} goes with --method structural");
        }
        Ok(())
    }

    fn options(&self) -> Options {
        let method = match self.method {
            MethodName::Point => Method::Point,
            MethodName::PointLine => Method::PointLine,
            MethodName::Structural => Method::Structural,
            MethodName::PoseGraph => Method::PoseGraph,
        };
        let usual = Options::of(method);
        let solver = SolverOptions {
            optimiser: match self.optimiser {
                OptimiserName::Lm => Optimiser::LevenbergMarquardt,
                OptimiserName::Dogleg => Optimiser::DogLeg,
            },
            max_iterations: self.max_iterations.unwrap_or(usual.solver.max_iterations),
            function_tolerance: self.tolerance.unwrap_or(usual.solver.function_tolerance),
            eliminate: match self.eliminate {
                Some(EliminateName::Landmarks) => Eliminate::Landmarks,
                Some(EliminateName::Poses) => Eliminate::Poses,
                Some(EliminateName::Nothing) => Eliminate::Nothing,
                None => Eliminate::Cheapest,
            },
            factorisation: match self.factorise {
                Some(FactoriseName::Dense) => Factorisation::Dense,
                Some(FactoriseName::Sparse) => Factorisation::Sparse,
                None => Factorisation::Cheapest,
            },
            ..usual.solver
        };
        Options {
            name: self.name.clone(),
            points: match self.points {
                PointName::Xyz => PointForm::Xyz,
                PointName::InverseDepth => PointForm::InverseDepth,
                PointName::Parallax => PointForm::Parallax,
            },
            lines: match self.lines {
                LineName::Orthonormal => LineKind::Orthonormal,
                LineName::Endpoints => LineKind::Endpoints,
                LineName::PluckerCayley => LineKind::PluckerCayley,
            },
            parallelism: match self.soft {
                Some(degrees) => Parallelism::Soft { sigma_rad: degrees.to_radians() },
                None if self.no_groups => Parallelism::Ignored,
                None => usual.parallelism,
            },
            loss: self.loss.unwrap_or(usual.loss),
            sigma_px: self.sigma_px,
            min_views: self.min_views,
            fix: self.fix.iter().map(|frame| FrameId(*frame)).collect(),
            smooth_motion: !self.no_motion,
            covariance: self.covariance,
            solver,
            ..usual
        }
    }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    args.refuse_idle()?;
    let (mut sequence, mut outcome) = extended::read(&args.sequence, &args.output, args.force)?;
    extended::check_cameras(&sequence)?;
    let options = args.options();
    let name = options.estimate_name().to_owned();
    extended::check_name("an estimate", &name, Estimate::is_in(&sequence, &name), args.replace)?;
    let graph = pick(args.graph.as_deref(), &sequence)?;
    if args.graph.is_none() {
        writeln!(io::stderr(), "adjusting the graph `{}`", graph.name)?;
    }
    let adjusted = adjust_on_threads(&graph, &options, args.threads)?;
    let Adjusted { estimate, summary } = adjusted;
    if args.explain {
        write!(io::stderr(), "{}", summary.plan)?;
    }
    if !summary.ending.has_converged() {
        outcome = Outcome::Findings;
    }
    if let Some(cause) = &summary.no_covariance {
        writeln!(io::stderr(), "warning: no covariances: {cause}")?;
        outcome = Outcome::Findings;
    }
    estimate.put(&mut sequence);
    sequence.sort();
    let size = extended::write(&args.output, sequence, args.force)?;
    if args.json {
        serde_json::to_writer_pretty(&mut *stdout, &as_json(&graph.name, &name, &summary))?;
        writeln!(stdout)?;
    } else {
        write!(stdout, "{}", as_text(&graph.name, &name, &summary))?;
        writeln!(stdout, "{}: {}", args.output.display(), size)?;
    }
    Ok(outcome)
}

/// The graph of a name, or the one that is meant where none is given.
fn pick(name: Option<&str>, sequence: &Sequence) -> anyhow::Result<FactorGraph> {
    let names = FactorGraph::names(sequence);
    let list = |names: &BTreeSet<String>| names.iter().cloned().collect::<Vec<_>>().join(", ");
    if let Some(name) = name {
        let known = || format!("no graph `{name}`; there are: {}", list(&names));
        return FactorGraph::of(sequence, name).with_context(known);
    }
    let usual = ["initial", "map-to-frame", "frame-to-frame"];
    let picked = match names.len() {
        0 => anyhow::bail!("the sequence has no factor graph; `os graph` makes one of an estimate"),
        1 => names.first().map(String::as_str),
        _ => usual.into_iter().find(|name| names.contains(*name)),
    };
    let picked = picked.with_context(|| format!("which graph? --graph takes one of: {}", list(&names)))?;
    FactorGraph::of(sequence, picked).context("the graph is empty")
}

fn adjust_on_threads(
    graph: &FactorGraph,
    options: &Options,
    threads: Option<usize>,
) -> anyhow::Result<Adjusted> {
    let progress = Progress::new("adjusting", "steps");
    let most = options.solver.max_iterations as u64;
    let mut done = 0;
    let mut run = || {
        adjust_watched(graph, options, &mut |_| {
            done += 1;
            progress.update(done, most.max(done));
            true
        })
    };
    let adjusted = match threads {
        Some(threads) => rayon::ThreadPoolBuilder::new().num_threads(threads).build()?.install(&mut run),
        None => run(),
    };
    Ok(adjusted?)
}

/// Names of some frames or lines, and how many there are beyond.
fn names(ids: &[i64]) -> String {
    let shown: Vec<String> = ids.iter().take(MOST_NAMES).map(i64::to_string).collect();
    let rest = ids.len().saturating_sub(MOST_NAMES);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

fn as_text(graph: &str, name: &str, summary: &Summary) -> String {
    let mut lines = vec![format!("{name} from graph `{graph}`")];
    lines.push(format!(
        "  cost       {:.6e} -> {:.6e}, residuals {:.3} sigma RMS",
        summary.initial_cost, summary.final_cost, summary.residual_rms
    ));
    lines.push(format!("  ending     {}, {} steps", summary.ending.words(), summary.iterations));
    lines.push(format!(
        "  problem    {} residuals, {} unknowns, {} part{}",
        text::count(summary.residuals as u64),
        text::count(summary.unknowns as u64),
        summary.components,
        if summary.components == 1 { "" } else { "s" }
    ));
    for (what, tally) in tallies(summary) {
        if tally.used > 0 || !tally.excluded.is_empty() {
            let excluded = tally.excluded.iter();
            let excluded: Vec<String> = excluded
                .map(|(reason, count)| format!("{} left out: {}", text::count(*count as u64), reason.words()))
                .collect();
            let excluded =
                if excluded.is_empty() { String::new() } else { format!("; {}", excluded.join("; ")) };
            lines.push(format!("  {what:<10} {} used{excluded}", text::count(tally.used as u64)));
        }
    }
    let ids = |frames: &[FrameId]| names(&frames.iter().map(|frame| frame.0).collect::<Vec<_>>());
    for (what, frames) in [
        ("held", &summary.held),
        ("open", &summary.weak),
        ("carried", &summary.carried),
        ("unmeasured", &summary.unconstrained),
    ] {
        if !frames.is_empty() {
            lines.push(format!("  {what:<10} {} poses: frames {}", frames.len(), ids(frames)));
        }
    }
    if summary.grouped > 0 || !summary.released.is_empty() {
        let released: Vec<i64> = summary.released.iter().map(|line| line.line_id.0).collect();
        let released = if released.is_empty() {
            String::new()
        } else {
            format!("; {} contradict theirs: lines {}", released.len(), names(&released))
        };
        lines.push(format!("  groups     {} lines share their group's direction{released}", summary.grouped));
    }
    lines.join("\n") + "\n"
}

fn tallies(summary: &Summary) -> [(&'static str, &Tally); 6] {
    [
        ("poses", &summary.poses),
        ("points", &summary.points),
        ("lines", &summary.lines),
        ("of points", &summary.point_factors),
        ("of lines", &summary.line_factors),
        ("relative", &summary.relative_factors),
    ]
}

fn as_json(graph: &str, name: &str, summary: &Summary) -> serde_json::Value {
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
