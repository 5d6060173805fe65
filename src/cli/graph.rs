//! `os graph`: a co-visibility factor graph or a pose graph about an estimate.

use std::io::Write;
use std::path::PathBuf;

use clap::ValueEnum;

use super::{Outcome, extended, parsed, text};
use crate::covisibility::{KeyFrameRule, LoopRule};
use crate::stations::{self, GraphCounts, GraphKind, GraphRequest};

/// What stands between poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Points and lines with a factor for each measurement: what bundle adjustment takes.
    Reprojection,
    /// Relative poses between neighbours, and loop closures.
    PoseGraph,
}

/// Build a factor graph about an estimate: its poses and map as initial values, the measurements as factors.
///
/// The output is the input with the graph added. Adjust it with `os adjust`, write it for other programs with `os export`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os graph tracked -o graph --estimate map-to-frame
  os graph tracked.mcap -o graph.mcap --estimate map-to-frame --key-frames --min-views 3
  os graph tracked -o loops --estimate frame-to-frame --kind pose-graph --loop-gap 50")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(super) struct Args {
    /// Sequence with measurements and an estimate: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Estimate to begin with; may be left out when the sequence has one alone.
    #[arg(long, value_name = "NAME")]
    estimate: Option<String>,
    /// What stands between poses.
    #[arg(long, value_enum, default_value_t = Kind::Reprojection)]
    kind: Kind,
    /// Name of the graph; by default that of the estimate, with `-pose-graph` for one.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Frames that have to see a landmark for it to be a vertex.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = parsed::at_least_one)]
    min_views: usize,
    /// Take key frames alone: frames that share less than --most-shared with the one before.
    #[arg(long)]
    key_frames: bool,
    /// Part of a key frame's landmarks that the next one may share at most, 0 to 1.
    #[arg(long, value_name = "F", default_value_t = KeyFrameRule::default().most_shared, requires = "key_frames")]
    most_shared: f64,
    /// Frames between two key frames at most.
    #[arg(long, value_name = "N", default_value_t = KeyFrameRule::default().longest_gap, requires = "key_frames")]
    longest_gap: usize,
    /// Frames for which a landmark was not seen before it closes a loop.
    #[arg(long, value_name = "N", default_value_t = LoopRule::default().gap, value_parser = parsed::at_least_one)]
    loop_gap: usize,
    /// Landmarks that have to return for a loop to be closed.
    #[arg(long, value_name = "N", default_value_t = LoopRule::default().least_shared)]
    loop_shared: usize,
    /// Close no loops.
    #[arg(long)]
    no_loops: bool,
    /// Seed of the consensus of loop closures.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Replace a graph of the same name.
    #[arg(long)]
    replace: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    /// Print what went into the graph as JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    fn request(&self) -> GraphRequest {
        GraphRequest {
            estimate: self.estimate.clone(),
            kind: match self.kind {
                Kind::Reprojection => GraphKind::Reprojection,
                Kind::PoseGraph => GraphKind::PoseGraph,
            },
            name: self.name.clone(),
            min_views: self.min_views,
            key_frames: self
                .key_frames
                .then_some(KeyFrameRule { most_shared: self.most_shared, longest_gap: self.longest_gap }),
            loops: (!self.no_loops).then_some(LoopRule {
                gap: self.loop_gap,
                least_shared: self.loop_shared,
                ..LoopRule::default()
            }),
            seed: self.seed,
            replace: self.replace,
        }
    }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.kind == Kind::PoseGraph && args.key_frames {
        anyhow::bail!("--key-frames goes with --kind reprojection");
    }
    let (sequence, mut outcome) = extended::read(&args.sequence, &args.output, args.force)?;
    let (sequence, found) = stations::graph(sequence, &args.request())?;
    let words = match &found.counts {
        GraphCounts::Reprojection(found) => format!(
            "{} poses, {} points, {} lines; {} factors of points, {} of lines, {} of parallel groups",
            text::count(found.poses as u64),
            text::count(found.points as u64),
            text::count(found.lines as u64),
            text::count(found.point_factors as u64),
            text::count(found.line_factors as u64),
            text::count(found.parallelism_factors as u64),
        ),
        GraphCounts::PoseGraph(found) => {
            if found.guessed > 0 {
                outcome = Outcome::Findings;
            }
            format!(
                "{} poses, {} relative poses between neighbours ({} guessed), {} loops closed, {} refused",
                text::count(found.poses as u64),
                text::count(found.neighbours as u64),
                found.guessed,
                found.loops,
                found.loops_refused,
            )
        }
    };
    let size = extended::write(&args.output, sequence, args.force)?;
    if args.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&found.to_json())?)?;
    } else {
        writeln!(stdout, "graph `{}` of estimate `{}`: {words}", found.graph, found.estimate)?;
        writeln!(stdout, "{}: {size}", args.output.display())?;
    }
    Ok(outcome)
}
