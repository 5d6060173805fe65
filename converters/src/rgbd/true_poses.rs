//! Trajectories of true poses.

use open_structure::geometry::Pose;

use super::ascending::ascending;
use super::list::{Line, List};
use super::{Error, Ledger, stamp};

/// Farther from the origin no sequence was taken, metres; what is made of numbers below has all its digits.
const FARTHEST_M: f64 = 1e9;
/// What a line of a trajectory has.
const WITH_STAMP: &str = "timestamp tx ty tz qx qy qz qw, all numbers, the rotation not zero";
/// What a line of a trajectory has whose lines are numbered like the images.
const WITHOUT_STAMP: &str = "tx ty tz qx qy qz qw, all numbers, the rotation not zero";

/// True poses in the order of their stamps.
#[derive(Debug)]
pub(super) struct TruePoses {
    rows: Vec<(i64, Pose)>,
}

impl TruePoses {
    /// Reads lines `timestamp tx ty tz qx qy qz qw`: seconds, metres, a Hamilton quaternion.
    ///
    /// # Errors
    /// [`Error::Line`] for what is no pose, and for stamps that do not ascend, unless lines may be left out: then the
    /// poses are sorted, and of equal stamps the first counts.
    pub(super) fn read(list: &List, ledger: &mut Ledger) -> Result<Self, Error> {
        let mut rows = Vec::new();
        for line in list.lines() {
            let stamp = line.fields.first().and_then(|field| stamp::nanos(field));
            match stamp.zip(pose(&line, 1)) {
                Some((stamp, pose)) => rows.push((stamp, line.number, pose)),
                None => ledger.refuse(line.wrong(WITH_STAMP))?,
            }
        }
        Ok(Self { rows: ascending(list, rows, "stamp", ledger)? })
    }

    /// The pose at a stamp: one that stands there, or one between its neighbours, the rotation at constant speed.
    ///
    /// * `longest_gap` — how far the neighbours may be apart, nanoseconds; 0 for poses that stand there alone.
    pub(super) fn at(&self, stamp: i64, longest_gap: i64) -> Option<Pose> {
        let next = self.rows.partition_point(|(other, _)| *other < stamp);
        let (later, later_pose) = self.rows.get(next)?;
        if *later == stamp {
            return Some(*later_pose);
        }
        let (earlier, earlier_pose) = self.rows.get(next.checked_sub(1)?)?;
        let gap = later.abs_diff(*earlier);
        if i128::from(gap) > i128::from(longest_gap) {
            return None;
        }
        let part = stamp.abs_diff(*earlier) as f64 / gap as f64;
        Some(earlier_pose.interpolate(later_pose, part))
    }
}

/// The pose in the seven fields from `first` on.
pub(super) fn pose(line: &Line<'_>, first: usize) -> Option<Pose> {
    let [tx, ty, tz, qx, qy, qz, qw] = line.numbers::<7>(first)?;
    if [tx, ty, tz].iter().any(|metres| metres.abs() > FARTHEST_M) {
        return None;
    }
    Pose::from_components([tx, ty, tz], [qx, qy, qz, qw]).ok()
}

/// The poses of lines without stamps; `None` where one cannot be used.
///
/// # Errors
/// [`Error::Line`] for what is no pose, unless lines may be left out.
pub(super) fn by_line(list: &List, ledger: &mut Ledger) -> Result<Vec<Option<Pose>>, Error> {
    let mut poses = Vec::new();
    for line in list.lines() {
        let pose = pose(&line, 0).filter(|_| line.fields.len() == 7);
        if pose.is_none() {
            ledger.refuse(line.wrong(WITHOUT_STAMP))?;
        }
        poses.push(pose);
    }
    Ok(poses)
}
