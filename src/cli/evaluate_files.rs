//! The part of `os evaluate` that compares trajectory files.

use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::evaluate::{Compared, name_of};
use crate::evaluate::{Error, EvaluateOptions, Matched, evaluate_matched};
use crate::geometry::Pose;
use crate::plot;
use crate::stations::evaluated;
use crate::storage::File;
use crate::structure::{CameraId, Frame, FrameId, TrajectoryRow, read_trajectory};

/// How stamps of two files are matched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamps {
    /// Largest difference of two that belong together, nanoseconds.
    pub(super) most_apart_nanos: i64,
    /// Added to those of the estimate, nanoseconds.
    pub(super) offset_nanos: i64,
}

/// Compares trajectory files with the first of them.
pub(super) fn compare(
    paths: &[PathBuf],
    stamps: Stamps,
    options: &EvaluateOptions,
) -> anyhow::Result<Compared> {
    let [reference_path, estimate_paths @ ..] = paths else {
        anyhow::bail!("--files: expected a reference and estimates");
    };
    let reference = read(reference_path)?;
    let mut rows = Vec::new();
    for path in estimate_paths {
        let matched = matched(stamps, (reference_path, &reference), (path, &read(path)?))?;
        let evaluation = evaluate_matched(&name_of(path), matched, options);
        rows.push(evaluated(&name_of(reference_path), &name_of(reference_path), evaluation, options));
    }
    let stamp = |(place, row): (i64, &TrajectoryRow)| Some((FrameId(place), row.stamp_nanos?));
    let frames: Vec<Frame> = (0..)
        .zip(&reference)
        .map(|(place, row)| Frame::new(FrameId(place), 0, CameraId(0), Some(row.pose)))
        .collect();
    Ok(Compared {
        rows,
        stamps: (0..).zip(&reference).filter_map(stamp).collect(),
        upward: plot::upward(&[], &frames),
    })
}

fn read(path: &Path) -> anyhow::Result<Vec<TrajectoryRow>> {
    let file = File::open(path).with_context(|| path.display().to_string())?;
    read_trajectory(BufReader::new(file), None).with_context(|| path.display().to_string())
}

type Matching = Result<Matched<FrameId>, Error>;

/// Matches two files by their stamps, or, where both have none, line by line; ids are places in the reference's file.
fn matched(
    stamps: Stamps,
    (reference_path, reference): (&Path, &[TrajectoryRow]),
    (path, estimate): (&Path, &[TrajectoryRow]),
) -> anyhow::Result<Matching> {
    let poses = |path: &Path, rows: &[TrajectoryRow]| -> anyhow::Result<Vec<(i64, Pose)>> {
        (0..)
            .zip(rows)
            .map(|(place, row)| {
                let pose =
                    row.pose.pose().with_context(|| format!("{}, line {}", path.display(), row.line))?;
                Ok((row.stamp_nanos.unwrap_or(place), pose))
            })
            .collect()
    };
    let (left, right) = (poses(reference_path, reference)?, poses(path, estimate)?);
    let stamped = |rows: &[TrajectoryRow]| rows.first().is_some_and(|row| row.stamp_nanos.is_some());
    let found = match (stamped(reference), stamped(estimate)) {
        (true, true) => Matched::by_stamp(&left, &right, stamps.most_apart_nanos, stamps.offset_nanos),
        (false, false) if left.len() == right.len() => Matched::by_id(&left, &right),
        (false, false) => anyhow::bail!(
            "{}: expected {} poses as in the reference, found {}; KITTI files have no stamps by which to match them",
            path.display(),
            left.len(),
            right.len()
        ),
        _ => anyhow::bail!("{}: expected stamps in both files or in none", path.display()),
    };
    Ok(found.map(|found| {
        let place = |stamp: &i64| left.partition_point(|(other, _)| other < stamp);
        let ids = found.ids.iter().map(|stamp| FrameId(i64::try_from(place(stamp)).unwrap_or(i64::MAX)));
        Matched {
            ids: ids.collect(),
            reference: found.reference,
            estimate: found.estimate,
            missing: found.missing,
            extra: found.extra,
        }
    }))
}
