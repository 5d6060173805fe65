//! Paths of a sequence to and from trajectory files: which pose belongs to which frame.

use std::collections::{BTreeMap, BTreeSet};

use super::Error;
use crate::structure::{
    Estimate, Frame, FrameId, PoseRow, Sequence, TrajectoryFormat, TrajectoryPose, TrajectoryRow,
};

/// A second, nanoseconds.
const SECOND: i64 = 1_000_000_000;

/// The poses of an estimate, or the true ones, with the stamps of their frames: what
/// [`write_trajectory`](crate::structure::write_trajectory) takes.
///
/// * `estimate` — name of the estimate; `None` for the truth.
///
/// # Errors
/// [`Error::Unfit`] when there are none, or when frames have none and the file is one of KITTI, which counts frames.
pub fn trajectory_of(
    sequence: &Sequence,
    estimate: Option<&str>,
    format: TrajectoryFormat,
) -> Result<Vec<(i64, PoseRow)>, Error> {
    let poses: BTreeMap<FrameId, PoseRow> = match estimate {
        None => {
            sequence.frames.iter().filter_map(|row| Some((row.frame_id, row.world_from_camera()?))).collect()
        }
        Some(name) => {
            let rows = sequence.trajectories.iter().filter(|row| row.estimate == name);
            rows.map(|row| (row.frame_id, row.world_from_camera())).collect()
        }
    };
    let what = || estimate.map_or("true poses".to_owned(), |name| format!("estimate `{name}`"));
    if poses.is_empty() {
        let known: BTreeSet<&str> = sequence.trajectories.iter().map(|row| row.estimate.as_str()).collect();
        let known = known.into_iter().collect::<Vec<_>>().join(", ");
        let found = if known.is_empty() { "none".to_owned() } else { format!("none; there are {known}") };
        return Err(Error::unfit(what(), "poses", found));
    }
    let rows: Vec<_> = sequence
        .frames
        .iter()
        .filter_map(|frame| Some((frame.stamp_nanos, *poses.get(&frame.frame_id)?)))
        .collect();
    if format == TrajectoryFormat::Kitti && rows.len() < sequence.frames.len() {
        let expected = "a pose of every frame, for lines of KITTI are frames by their number";
        return Err(Error::unfit(what(), expected, format!("{} of {}", rows.len(), sequence.frames.len())));
    }
    Ok(rows)
}

/// How poses of a file find their frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatchBy {
    /// The frame nearest in time.
    Stamp,
    /// The stamp, in whole seconds, is the id of the frame: systems that were given no stamps write such files.
    FrameId,
    /// The pose of line n belongs to the n-th frame.
    Order,
}

/// How a trajectory is matched.
#[derive(Clone, Copy, Debug)]
pub struct MatchOptions {
    /// How poses find frames; found out when `None`.
    pub by: Option<MatchBy>,
    /// The longest time between a pose and its frame, nanoseconds.
    pub max_diff_nanos: i64,
    /// Whether the file holds `camera_from_world`.
    pub camera_from_world: bool,
}

/// Poses with their frames.
#[derive(Clone, Debug)]
pub struct Matched {
    /// The path: an estimate without a map.
    pub estimate: Estimate,
    /// How poses found frames.
    pub by: MatchBy,
    /// Poses of the file that found none.
    pub unmatched_poses: usize,
    /// Frames of the sequence that got none.
    pub unmatched_frames: usize,
}

/// The poses of a trajectory file as an estimate of a sequence.
///
/// Where [`MatchOptions::by`] does not say how: a file without stamps is matched by order, and one with stamps by them;
/// one whose stamps are whole seconds that are all ids of frames is matched by ids if its stamps do not all find a frame.
///
/// * `frames` — the table `frames`.
/// * `rows` — the file, see [`read_trajectory`](crate::structure::read_trajectory).
/// * `name` — name of the estimate.
///
/// # Errors
/// [`Error::Unfit`] when stamps are missing, when both readings of the stamps find all frames but not the same ones, when
/// lines are to be counted and are not as many as frames, and when no pose finds a frame.
pub fn match_trajectory(
    frames: &[Frame],
    rows: &[TrajectoryRow],
    name: &str,
    options: &MatchOptions,
) -> Result<Matched, Error> {
    let stamped = rows.iter().all(|row| row.stamp_nanos.is_some());
    let (by, places) = match options.by {
        Some(by @ (MatchBy::Stamp | MatchBy::FrameId)) if !stamped => {
            let expected = format!("stamps, to match by {by:?}");
            return Err(Error::unfit("trajectory", expected, "a file without"));
        }
        Some(MatchBy::Stamp) => (MatchBy::Stamp, by_stamp(frames, rows, options.max_diff_nanos)),
        Some(MatchBy::FrameId) => (MatchBy::FrameId, by_id(frames, rows)),
        Some(MatchBy::Order) => (MatchBy::Order, by_order(frames, rows)?),
        None if !stamped => (MatchBy::Order, by_order(frames, rows)?),
        None => guessed(frames, rows, options.max_diff_nanos)?,
    };
    if places.is_empty() {
        let expected = match by {
            MatchBy::Stamp => {
                let (first, last) = (frames.first(), frames.last());
                let [from, to] = [first, last].map(|frame| frame.map_or(0, |frame| frame.stamp_nanos));
                format!("stamps within {} ns of a frame's, from {from} to {to} ns", options.max_diff_nanos)
            }
            MatchBy::FrameId => "stamps, in seconds, that are ids of frames".to_owned(),
            MatchBy::Order => "poses".to_owned(),
        };
        let stamp = rows.first().and_then(|row| row.stamp_nanos);
        let found = stamp.map_or("none".to_owned(), |stamp| format!("none; the first is {stamp} ns"));
        return Err(Error::unfit("trajectory", expected, found));
    }
    let mut trajectory = Vec::with_capacity(places.len());
    for (frame, row) in &places {
        let row = &rows[*row];
        let mut pose = row.pose;
        if options.camera_from_world {
            let camera_from_world =
                pose.pose().map_err(|error| Error::content("", row.line, "a rigid transform", error))?;
            pose = PoseRow::from(&camera_from_world.inverse());
        }
        trajectory.push(TrajectoryPose::new(name.to_owned(), frames[*frame].frame_id, pose));
    }
    Ok(Matched {
        estimate: Estimate { name: name.to_owned(), trajectory, ..Estimate::default() },
        by,
        unmatched_poses: rows.len() - places.len(),
        unmatched_frames: frames.len() - places.len(),
    })
}

/// Places of frames with places of their poses.
type Places = BTreeMap<usize, usize>;

/// Each pose goes to the nearest frame, and each frame takes the nearest of its poses, the first where two are as near.
fn by_stamp(frames: &[Frame], rows: &[TrajectoryRow], max_diff_nanos: i64) -> Places {
    let mut nearest: BTreeMap<usize, (i128, usize)> = BTreeMap::new();
    for (place, row) in rows.iter().enumerate() {
        let Some(stamp) = row.stamp_nanos else { continue };
        let after = frames.partition_point(|frame| frame.stamp_nanos < stamp);
        let candidates = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let distance = |frame: usize| {
            frames.get(frame).map(|frame| (i128::from(frame.stamp_nanos) - i128::from(stamp)).abs())
        };
        let best = candidates.filter_map(|frame| Some((distance(frame)?, frame))).min();
        if let Some((distance, frame)) = best.filter(|(distance, _)| *distance <= i128::from(max_diff_nanos))
        {
            let entry = nearest.entry(frame).or_insert((distance, place));
            *entry = (*entry).min((distance, place));
        }
    }
    nearest.into_iter().map(|(frame, (_, row))| (frame, row)).collect()
}

fn by_id(frames: &[Frame], rows: &[TrajectoryRow]) -> Places {
    let places: BTreeMap<i64, usize> =
        frames.iter().enumerate().map(|(place, frame)| (frame.frame_id.0, place)).collect();
    let mut found = Places::new();
    for (place, row) in rows.iter().enumerate() {
        let id = row.stamp_nanos.filter(|stamp| stamp % SECOND == 0).map(|stamp| stamp / SECOND);
        if let Some(frame) = id.and_then(|id| places.get(&id)) {
            found.entry(*frame).or_insert(place);
        }
    }
    found
}

fn by_order(frames: &[Frame], rows: &[TrajectoryRow]) -> Result<Places, Error> {
    if rows.len() != frames.len() {
        let expected = format!("{} poses, one for each frame, for lines are counted", frames.len());
        return Err(Error::unfit("trajectory", expected, rows.len()));
    }
    Ok((0..rows.len()).map(|place| (place, place)).collect())
}

fn guessed(
    frames: &[Frame],
    rows: &[TrajectoryRow],
    max_diff_nanos: i64,
) -> Result<(MatchBy, Places), Error> {
    let (stamps, ids) = (by_stamp(frames, rows, max_diff_nanos), by_id(frames, rows));
    if ids.len() < rows.len() || stamps == ids {
        return Ok((MatchBy::Stamp, stamps));
    }
    if stamps.len() < rows.len() {
        return Ok((MatchBy::FrameId, ids));
    }
    let expected = "stamps that are either times or ids of frames; say which they are";
    Err(Error::unfit("trajectory", expected, "stamps that can be both"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::CameraId;
    use proptest::prelude::*;

    const AUTO: MatchOptions =
        MatchOptions { by: None, max_diff_nanos: 10_000_000, camera_from_world: false };

    /// Frames at 30 Hz.
    fn frames(count: i64) -> Vec<Frame> {
        (0..count).map(|id| Frame::new(FrameId(id), id * 33_333_333, CameraId(0), None)).collect()
    }

    fn rows(stamps: impl IntoIterator<Item = Option<i64>>) -> Vec<TrajectoryRow> {
        let pose = |x| PoseRow { translation: [x, 0.0, 0.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        let stamps = stamps.into_iter().enumerate();
        stamps
            .map(|(at, stamp_nanos)| TrajectoryRow { line: at + 1, stamp_nanos, pose: pose(at as f64) })
            .collect()
    }

    fn ids(matched: &Matched) -> Vec<i64> {
        matched.estimate.trajectory.iter().map(|row| row.frame_id.0).collect()
    }

    #[test]
    fn stamps_find_their_frames_and_what_finds_none_is_counted() {
        let shifted = rows([5_000_000, 33_000_000, 50_000_000, 66_666_000].map(Some));
        let matched = match_trajectory(&frames(4), &shifted, "a", &AUTO).unwrap();
        assert_eq!(ids(&matched), [0, 1, 2]);
        assert_eq!((matched.by, matched.unmatched_poses, matched.unmatched_frames), (MatchBy::Stamp, 1, 1));
    }

    #[test]
    fn stamps_that_are_ids_are_known_by_finding_all_frames() {
        let numbered = rows((0..10).map(|id| Some(id * SECOND)));
        let matched = match_trajectory(&frames(10), &numbered, "a", &AUTO).unwrap();
        assert_eq!((matched.by, ids(&matched)), (MatchBy::FrameId, (0..10).collect()));
        let message = match_trajectory(&frames(400), &numbered, "a", &AUTO).unwrap_err().to_string();
        assert!(message.contains("can be both"), "{message}");
        let by_stamp = MatchOptions { by: Some(MatchBy::Stamp), ..AUTO };
        let matched = match_trajectory(&frames(400), &numbered, "a", &by_stamp).unwrap();
        assert_eq!(ids(&matched)[..3], [0, 30, 60]);
    }

    #[test]
    fn lines_are_counted_only_where_there_are_as_many_as_frames() {
        let matched = match_trajectory(&frames(3), &rows([None; 3]), "a", &AUTO).unwrap();
        assert_eq!((matched.by, ids(&matched)), (MatchBy::Order, vec![0, 1, 2]));
        let message = match_trajectory(&frames(4), &rows([None; 3]), "a", &AUTO).unwrap_err().to_string();
        assert!(message.contains("expected 4 poses"), "{message}");
    }

    #[test]
    fn the_other_direction_is_turned_round() {
        let inverse = MatchOptions { camera_from_world: true, ..AUTO };
        let matched = match_trajectory(&frames(2), &rows([None; 2]), "a", &inverse).unwrap();
        assert_eq!(matched.estimate.trajectory[1].world_from_camera().translation, [-1.0, 0.0, 0.0]);
    }

    #[test]
    fn nothing_in_common_is_told_with_both_times() {
        let message =
            match_trajectory(&frames(3), &rows([Some(77 * SECOND + 1)]), "a", &AUTO).unwrap_err().to_string();
        assert!(
            message.contains("from 0 to 66666666 ns, found none; the first is 77000000001 ns"),
            "{message}"
        );
    }

    proptest! {
        #[test]
        fn no_frame_and_no_pose_is_used_twice(
            stamps in prop::collection::btree_set(any::<i64>(), 0..20), at in prop::collection::btree_set(any::<i64>(), 1..20),
            max_diff_nanos in any::<i64>(),
        ) {
            let frames: Vec<Frame> =
                (0..).zip(&at).map(|(id, stamp)| Frame::new(FrameId(id), *stamp, CameraId(0), None)).collect();
            let rows = rows(stamps.into_iter().map(Some));
            let options = MatchOptions { by: Some(MatchBy::Stamp), max_diff_nanos, ..AUTO };
            if let Ok(matched) = match_trajectory(&frames, &rows, "a", &options) {
                let found = ids(&matched);
                prop_assert!(found.windows(2).all(|pair| pair[0] < pair[1]));
                let mut lines: Vec<_> =
                    matched.estimate.trajectory.iter().map(|row| row.world_from_camera_tx as usize).collect();
                lines.sort_unstable();
                lines.dedup();
                prop_assert_eq!(lines.len(), found.len());
            }
        }
    }
}
