//! `os import-trajectory`: a path that another system estimated becomes an estimate of the sequence.

use std::io::{self, BufReader, Write};
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::ValueEnum;

use super::{Outcome, extended, text};
use crate::exchange::{MatchBy, MatchOptions, match_trajectory};
use crate::stations::check_name;
use crate::storage::File;
use crate::structure::{Estimate, TrajectoryFormat, read_trajectory};

/// Import the path that another system estimated, as an estimate of the sequence.
///
/// Poses find their frames by stamp; by number where the file has none (KITTI), or where its stamps are frame ids, as
/// systems write them that were given no times. How many found one is told; the exit code is 3 where some did not.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os export box1 --to csv -o box1-csv
  my-slam box1-csv > my-slam.txt
  os import-trajectory box1 my-slam.txt --name my-slam -o box1-with-mine
  os import-trajectory box1.mcap poses.csv --from euroc --name vins -o box1-vins.mcap --t-max-diff 0.02")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(super) struct Args {
    /// Sequence: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Trajectory file.
    trajectory: PathBuf,
    /// Format of the file; found out by its first row where it is not given.
    #[arg(long, value_enum, value_name = "FORMAT")]
    from: Option<Format>,
    /// Name of the estimate.
    #[arg(long)]
    name: String,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// How poses find their frames; found out where it is not given.
    #[arg(long, value_enum, value_name = "WAY")]
    by: Option<By>,
    /// Longest time between a pose and its frame, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.01)]
    t_max_diff: f64,
    /// The file holds `world_from_camera`, camera positions; this is what is taken for granted.
    #[arg(long, conflicts_with = "camera_from_world")]
    world_from_camera: bool,
    /// The file holds `camera_from_world`.
    #[arg(long)]
    camera_from_world: bool,
    /// Replace an estimate of the same name, its map too.
    #[arg(long)]
    replace: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Tum,
    Kitti,
    Euroc,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum By {
    /// The frame nearest in time.
    Stamp,
    /// The stamp, in seconds, is the id of the frame.
    FrameId,
    /// Line n is the n-th frame.
    Order,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if !(args.t_max_diff >= 0.0 && args.t_max_diff <= 1e9) {
        bail!("--t-max-diff: expected seconds from 0 to 1e9, found {}", args.t_max_diff);
    }
    let (mut sequence, mut outcome) = extended::read(&args.sequence, &args.output, args.force)?;
    check_name("an estimate", &args.name, Estimate::is_in(&sequence, &args.name), args.replace)?;
    let file = File::open(&args.trajectory).with_context(|| args.trajectory.display().to_string())?;
    let from = args.from.map(|from| match from {
        Format::Tum => TrajectoryFormat::Tum,
        Format::Kitti => TrajectoryFormat::Kitti,
        Format::Euroc => TrajectoryFormat::Euroc,
    });
    let rows =
        read_trajectory(BufReader::new(file), from).with_context(|| args.trajectory.display().to_string())?;
    #[expect(clippy::cast_possible_truncation, reason = "at most 1e18")]
    let options = MatchOptions {
        by: args.by.map(|by| match by {
            By::Stamp => MatchBy::Stamp,
            By::FrameId => MatchBy::FrameId,
            By::Order => MatchBy::Order,
        }),
        max_diff_nanos: (args.t_max_diff * 1e9).round() as i64,
        camera_from_world: args.camera_from_world,
    };
    let matched = match_trajectory(&sequence.frames, &rows, &args.name, &options)
        .with_context(|| args.trajectory.display().to_string())?;
    let count = |number: usize| text::count(number as u64);
    let found = matched.estimate.trajectory.len();
    matched.estimate.put(&mut sequence);
    let frames = sequence.frames.len();
    let size = extended::write(&args.output, sequence, args.force)?;
    let by = match matched.by {
        MatchBy::Stamp => "by stamp",
        MatchBy::FrameId => "by frame id",
        MatchBy::Order => "by number",
    };
    let lost = [
        ("poses found no frame", matched.unmatched_poses),
        ("frames have no pose", matched.unmatched_frames),
    ];
    for (what, number) in lost.into_iter().filter(|(_, number)| *number > 0) {
        writeln!(io::stderr(), "warning: {} {what}", count(number))?;
        outcome = Outcome::Findings;
    }
    writeln!(
        stdout,
        "{}: estimate `{}`, {} of {} poses matched {by} with {} frames; {size}",
        args.output.display(),
        args.name,
        count(found),
        count(rows.len()),
        count(frames)
    )?;
    Ok(outcome)
}
