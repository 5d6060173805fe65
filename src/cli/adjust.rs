//! `os adjust`: a factor graph into an estimate.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context;

use super::adjust_words::as_text;
use super::foreign::{self, Foreign};
use super::progress::Progress;
use super::{Outcome, adjust_foreign, extended, parsed};
use crate::adjust::{
    Eliminate, Error, Factorisation, LineKind, Loss, Method, Optimiser, Options, Parallelism, PointForm,
    SolverOptions, Step, Summary,
};
use crate::format;
use crate::stations::{self, AdjustRequest};
use crate::storage;
use crate::structure::FrameId;

/// Adjust a factor graph: move poses and landmarks to where the measurements agree best.
///
/// The output is the input with the estimate added: trajectory, map and the optimiser's steps. What cannot be used is left out and
/// counted. Parallel lines are taken from the sequence's structural groups, not from factors of kind `parallelism`, which say the same.
/// The same input gives the same bytes on any number of threads.
///
/// A graph of g2o and a problem of Bundle Adjustment in the Large are read as they are. A problem of BAL is adjusted by its own camera:
/// focal length and two radial coefficients of every image are free, and nothing is held. The output is a file of the input's kind
/// (NAME.g2o, NAME.txt), or a sequence with the initial graph and the estimate.
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
  os adjust box1 -o again/ --method point-line --lines endpoints --loss huber:2 --name endpoints
  os adjust sphere2500.g2o -o adjusted.g2o
  os adjust problem-49-7776-pre.txt -o adjusted.txt --explain
  os adjust problem-49-7776-pre.txt -o ladybug.mcap --loss huber:1")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(super) struct Args {
    /// Sequence with a factor graph (an MCAP file or a Parquet folder), a graph of g2o, or a problem of BAL, uncompressed.
    #[arg(value_name = "INPUT")]
    pub(super) input: PathBuf,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder; NAME.g2o for a graph of g2o, NAME.txt for a problem of
    /// BAL.
    #[arg(short, long, value_name = "PATH")]
    pub(super) output: PathBuf,
    /// What the input is, if it is no sequence; found out by the name and the first line where it is not given.
    #[arg(long, value_enum, value_name = "FORMAT")]
    from: Option<Foreign>,
    /// What is adjusted with what [default: point-line; for g2o pose-graph, or point where there are points].
    #[arg(long, value_enum)]
    pub(super) method: Option<MethodName>,
    /// Graph to adjust; needed where there are several and none is `initial`.
    #[arg(long, value_name = "NAME")]
    pub(super) graph: Option<String>,
    /// Name of the estimate [default: point-ba, point-line-ba, structural-ba, pose-graph or bal].
    #[arg(long, value_name = "NAME")]
    pub(super) name: Option<String>,
    /// How points are kept [default: xyz].
    #[arg(long, value_enum)]
    pub(super) points: Option<PointName>,
    /// How lines are kept [default: orthonormal].
    #[arg(long, value_enum)]
    pub(super) lines: Option<LineName>,
    /// Robust loss, KIND or KIND:SCALE [default: cauchy:1 for point and point-line, huber:3 for structural, none for pose-graph and BAL].
    #[arg(long, value_name = "LOSS", value_parser = str::parse::<Loss>)]
    pub(super) loss: Option<Loss>,
    /// How steps are found.
    #[arg(long, value_enum, default_value_t = OptimiserName::Lm)]
    optimiser: OptimiserName,
    /// Steps at most.
    #[arg(long, value_name = "N")]
    max_iterations: Option<usize>,
    /// Stop when a step lowers the cost by less than this part of it.
    #[arg(long, value_name = "F", value_parser = parsed::not_negative)]
    tolerance: Option<f64>,
    /// Leave out landmarks that fewer frames see [default: 3].
    #[arg(long, value_name = "N", value_parser = parsed::at_least_one)]
    pub(super) min_views: Option<usize>,
    /// Hold the pose of this frame; may be given several times.
    #[arg(long, value_name = "FRAME")]
    pub(super) fix: Vec<i64>,
    /// Standard deviation of pixel coordinates, in place of the declared one.
    #[arg(long, value_name = "PX", value_parser = parsed::positive)]
    pub(super) sigma_px: Option<f64>,
    /// Draw parallel lines to the direction of their group, by this many degrees of standard deviation, in place of one direction for
    /// all (structural).
    #[arg(long, value_name = "DEGREES", num_args = 0..=1, default_missing_value = "0.5", value_parser = parsed::positive)]
    pub(super) soft: Option<f64>,
    /// Make no use of structural groups (structural).
    #[arg(long, conflicts_with = "soft")]
    pub(super) no_groups: bool,
    /// Let frames that see too little go where noise carries them, in place of moving as they did at the start (structural).
    #[arg(long)]
    pub(super) no_motion: bool,
    /// What the solver eliminates first [default: whatever costs least].
    #[arg(long, value_enum, value_name = "WHAT")]
    eliminate: Option<EliminateName>,
    /// How the solver factorises the rest [default: whatever costs least].
    #[arg(long, value_enum, value_name = "HOW")]
    factorise: Option<FactoriseName>,
    /// Say how the solver goes about it, with the cost of the other ways.
    #[arg(long)]
    pub(super) explain: bool,
    /// Store covariances of poses and landmarks.
    #[arg(long)]
    pub(super) covariance: bool,
    /// Replace an estimate of the same name.
    #[arg(long)]
    pub(super) replace: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    pub(super) force: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Threads [default: one for each core].
    #[arg(long, value_name = "N", value_parser = parsed::threads)]
    pub(super) threads: Option<usize>,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
pub(super) enum MethodName {
    Point,
    PointLine,
    Structural,
    PoseGraph,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
pub(super) enum PointName {
    Xyz,
    InverseDepth,
    Parallax,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
pub(super) enum LineName {
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
    /// Not at all: it is solved by conjugate gradients.
    Iterative,
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
        if let Some((option, _)) = idle.filter(|_| !matches!(self.method, Some(MethodName::Structural))) {
            anyhow::bail!("{option} goes with --method structural");
        }
        Ok(())
    }

    /// What is asked for; `usual` is the method where none is given.
    pub(super) fn options(&self, usual: Method) -> Options {
        let method = match self.method {
            Some(MethodName::Point) => Method::Point,
            Some(MethodName::PointLine) => Method::PointLine,
            Some(MethodName::Structural) => Method::Structural,
            Some(MethodName::PoseGraph) => Method::PoseGraph,
            None => usual,
        };
        let usual = Options::of(method);
        Options {
            name: self.name.clone(),
            points: match self.points {
                Some(PointName::InverseDepth) => PointForm::InverseDepth,
                Some(PointName::Parallax) => PointForm::Parallax,
                Some(PointName::Xyz) | None => usual.points,
            },
            lines: match self.lines {
                Some(LineName::Endpoints) => LineKind::Endpoints,
                Some(LineName::PluckerCayley) => LineKind::PluckerCayley,
                Some(LineName::Orthonormal) | None => usual.lines,
            },
            parallelism: match self.soft {
                Some(degrees) => Parallelism::Soft { sigma_rad: degrees.to_radians() },
                None if self.no_groups => Parallelism::Ignored,
                None => usual.parallelism,
            },
            loss: self.loss.unwrap_or(usual.loss),
            sigma_px: self.sigma_px,
            min_views: self.min_views.unwrap_or(usual.min_views),
            fix: self.fix.iter().map(|frame| FrameId(*frame)).collect(),
            smooth_motion: !self.no_motion,
            covariance: self.covariance,
            solver: self.solver(usual.solver),
            ..usual
        }
    }

    /// When to stop and how to step; what is not given is as usual.
    pub(super) fn solver(&self, usual: SolverOptions) -> SolverOptions {
        SolverOptions {
            optimiser: match self.optimiser {
                OptimiserName::Lm => Optimiser::LevenbergMarquardt,
                OptimiserName::Dogleg => Optimiser::DogLeg,
            },
            max_iterations: self.max_iterations.unwrap_or(usual.max_iterations),
            function_tolerance: self.tolerance.unwrap_or(usual.function_tolerance),
            eliminate: match self.eliminate {
                Some(EliminateName::Landmarks) => Eliminate::Landmarks,
                Some(EliminateName::Poses) => Eliminate::Poses,
                Some(EliminateName::Nothing) => Eliminate::Nothing,
                None => Eliminate::Cheapest,
            },
            factorisation: match self.factorise {
                Some(FactoriseName::Dense) => Factorisation::Dense,
                Some(FactoriseName::Sparse) => Factorisation::Sparse,
                Some(FactoriseName::Iterative) => Factorisation::Iterative,
                None => Factorisation::Cheapest,
            },
            ..usual
        }
    }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    args.refuse_idle()?;
    if let Some(from) = args.from.map_or_else(|| foreign::of(&args.input), |from| Ok(Some(from)))? {
        return adjust_foreign::run(args, from, stdout);
    }
    if storage::is_file(&args.input)
        && storage::without_query(&args.input).extension().is_none_or(|extension| extension != "mcap")
    {
        format::open(&args.input).map(drop).with_context(|| {
            let input = args.input.display();
            format!(
                "{input}: not known as a graph of g2o or a problem of BAL; if it is one, say so with --from"
            )
        })?;
    }
    adjust_foreign::refuse_output_of_others(&args.output)?;
    let (sequence, mut outcome) = extended::read(&args.input, &args.output, args.force)?;
    let graph = stations::graph_to_adjust(&sequence, args.graph.as_deref())?;
    if args.graph.is_none() {
        writeln!(io::stderr(), "adjusting the graph `{graph}`")?;
    }
    let request = AdjustRequest {
        options: args.options(Method::default()),
        graph: Some(graph),
        replace: args.replace,
        threads: args.threads,
    };
    let progress = Progress::new("adjusting", "steps");
    let found = stations::adjust(sequence, &request, &mut args.watch(&progress))?;
    drop(progress);
    outcome = args.outcome(&found.summary, outcome)?;
    let size = extended::write(&args.output, found.sequence, args.force)?;
    args.tell([&found.graph, &found.estimate], &found.summary, found.took, &size, stdout)?;
    Ok(outcome)
}

impl Args {
    /// Adjusts on the threads that are asked for, with a progress bar; gives the estimate and how long it took.
    pub(super) fn watched<T: Send>(
        &self,
        adjust: impl FnOnce(&mut dyn FnMut(&Step) -> bool) -> Result<T, Error> + Send,
    ) -> anyhow::Result<(T, Duration)> {
        let progress = Progress::new("adjusting", "steps");
        let mut watch = self.watch(&progress);
        let run = || adjust(&mut watch);
        let start = Instant::now();
        let adjusted = match self.threads {
            Some(threads) => rayon::ThreadPoolBuilder::new().num_threads(threads).build()?.install(run),
            None => run(),
        };
        Ok((adjusted?, start.elapsed()))
    }

    /// Shows each step on a progress bar.
    fn watch(&self, progress: &Progress) -> impl FnMut(&Step) -> bool + Send {
        let most = self.solver(SolverOptions::default()).max_iterations as u64;
        let mut done = 0;
        move |_| {
            done += 1;
            progress.update(done, most.max(done));
            true
        }
    }

    /// Says the plan where it is asked for, and what is left to be desired.
    pub(super) fn outcome(&self, summary: &Summary, outcome: Outcome) -> anyhow::Result<Outcome> {
        let mut outcome = outcome;
        if self.explain {
            write!(io::stderr(), "{}", summary.plan)?;
        }
        if !summary.ending.has_converged() {
            outcome = Outcome::Findings;
        }
        if let Some(cause) = &summary.no_covariance {
            writeln!(io::stderr(), "warning: no covariances: {cause}")?;
            outcome = Outcome::Findings;
        }
        Ok(outcome)
    }

    /// Prints how it went.
    ///
    /// * `took` — without reading and writing.
    pub(super) fn tell(
        &self,
        [graph, name]: [&str; 2],
        summary: &Summary,
        took: Duration,
        size: &str,
        stdout: &mut dyn Write,
    ) -> anyhow::Result<()> {
        if self.json {
            serde_json::to_writer_pretty(&mut *stdout, &stations::adjust_json(graph, name, summary, took))?;
            writeln!(stdout)?;
        } else {
            write!(stdout, "{}", as_text(graph, name, summary))?;
            writeln!(stdout, "{}: {size}", self.output.display())?;
        }
        Ok(())
    }
}
