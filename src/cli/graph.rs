//! `os graph`: a co-visibility factor graph or a pose graph about an estimate.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::ValueEnum;
use serde_json::json;

use super::{Outcome, extended, parsed, text};
use crate::covisibility::{self, GraphOptions, KeyFrameRule, LoopRule};
use crate::structure::{Estimate, FactorGraph, MeasuredFrame, MeasurementNoise, Sequence, registry};

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

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.kind == Kind::PoseGraph && args.key_frames {
        anyhow::bail!("--key-frames goes with --kind reprojection");
    }
    let (mut sequence, mut outcome) = extended::read(&args.sequence, &args.output, args.force)?;
    extended::check_cameras(&sequence)?;
    let estimate = choose(&sequence, args.estimate.as_deref())?;
    let suffix = if args.kind == Kind::PoseGraph { "-pose-graph" } else { "" };
    let name = args.name.clone().unwrap_or_else(|| format!("{}{suffix}", estimate.name));
    let taken = FactorGraph::names(&sequence).contains(&name);
    extended::check_name("a graph", &name, taken, args.replace)?;
    let options = GraphOptions {
        name: name.clone(),
        least_views: args.min_views,
        key_frames: args
            .key_frames
            .then_some(KeyFrameRule { most_shared: args.most_shared, longest_gap: args.longest_gap }),
        loops: (!args.no_loops).then_some(LoopRule {
            gap: args.loop_gap,
            least_shared: args.loop_shared,
            ..LoopRule::default()
        }),
    };
    let frames = MeasuredFrame::of(&sequence);
    let (cameras, noise) = (&sequence.manifest.cameras, MeasurementNoise::declared(&sequence.manifest));
    let (graph, said, words) = match args.kind {
        Kind::Reprojection => {
            let groups = &sequence.structural_groups;
            let (graph, found) =
                covisibility::reprojection_graph(&frames, &estimate, cameras, noise, groups, &options)?;
            let words = format!(
                "{} poses, {} points, {} lines; {} factors of points, {} of lines, {} of parallel groups",
                text::count(found.poses as u64),
                text::count(found.points as u64),
                text::count(found.lines as u64),
                text::count(found.point_factors as u64),
                text::count(found.line_factors as u64),
                text::count(found.parallelism_factors as u64),
            );
            let said = json!({
                "graph": name, "estimate": estimate.name, "kind": "reprojection", "poses": found.poses,
                "points": found.points, "lines": found.lines, "point_factors": found.point_factors,
                "line_factors": found.line_factors, "parallelism_factors": found.parallelism_factors,
                "frames_without_pose": found.frames_without_pose, "frames_left_out": found.frames_left_out,
                "landmarks_not_in_map": found.landmarks_not_in_map,
                "landmarks_with_few_views": found.landmarks_with_few_views,
                "measurements_not_finite": found.measurements_not_finite,
            });
            if found.point_factors + found.line_factors == 0 {
                anyhow::bail!(
                    "the graph of `{}` would be empty: none of its landmarks is seen in {} frames or more ({} landmarks that were measured are not in its map)",
                    estimate.name,
                    args.min_views,
                    text::count(found.landmarks_not_in_map as u64)
                );
            }
            (graph, said, words)
        }
        Kind::PoseGraph => {
            let (graph, found) =
                covisibility::pose_graph(&frames, &estimate, cameras, noise, &options, args.seed)?;
            let words = format!(
                "{} poses, {} relative poses between neighbours ({} guessed), {} loops closed, {} refused",
                text::count(found.poses as u64),
                text::count(found.neighbours as u64),
                found.guessed,
                found.loops,
                found.loops_refused,
            );
            if found.guessed > 0 {
                outcome = Outcome::Findings;
            }
            let said = json!({
                "graph": name, "estimate": estimate.name, "kind": "pose-graph", "poses": found.poses,
                "neighbours": found.neighbours, "guessed": found.guessed, "loops": found.loops,
                "loops_refused": found.loops_refused, "frames_without_pose": found.frames_without_pose,
                "frames_left_out": found.frames_left_out,
            });
            (graph, said, words)
        }
    };
    graph.put(&mut sequence);
    let size = extended::write(&args.output, sequence, args.force)?;
    if args.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&said)?)?;
    } else {
        writeln!(stdout, "graph `{name}` of estimate `{}`: {words}", estimate.name)?;
        writeln!(stdout, "{}: {size}", args.output.display())?;
    }
    Ok(outcome)
}

/// The estimate of a name, or the only one.
pub(super) fn choose(sequence: &Sequence, name: Option<&str>) -> anyhow::Result<Estimate> {
    let names: BTreeSet<&str> = sequence
        .trajectories
        .iter()
        .map(|row| row.estimate.as_str())
        .filter(|name| *name != registry::UNREFINED)
        .collect();
    let list = || names.iter().copied().collect::<Vec<_>>().join(", ");
    let name = match (name, names.len()) {
        (Some(name), _) => name,
        (None, 0) => anyhow::bail!("the sequence has no estimate; `os track` makes one"),
        (None, 1) => names.first().copied().unwrap_or_default(),
        (None, _) => anyhow::bail!("the sequence has several estimates: {}; choose with --estimate", list()),
    };
    anyhow::ensure!(names.contains(name), "no estimate `{name}` with a trajectory; there are: {}", list());
    Estimate::of(sequence, name).context("the estimate has no rows")
}
