//! Trajectories as text: the files of TUM RGB-D, KITTI and EuRoC, read and written.

mod decimal;
mod error;
mod lines;
mod read;
#[cfg(test)]
mod tests;
mod write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PoseRow;

pub use error::TrajectoryFileError;
pub use lines::LARGEST_TRAJECTORY_FILE_BYTES;
pub use read::{MOST_TRAJECTORY_ROWS, read_trajectory};
pub use write::write_trajectory;

/// A text format of trajectories.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TrajectoryFormat {
    /// TUM RGB-D: `stamp tx ty tz qx qy qz qw` a line, the stamp in seconds; `#` begins a comment.
    Tum,
    /// KITTI odometry: the upper 3 × 4 numbers of the matrix, row by row, a line; no stamps.
    Kitti,
    /// EuRoC: comma-separated `stamp,px,py,pz,qw,qx,qy,qz`, the stamp in nanoseconds, under a header; further
    /// columns are passed over.
    Euroc,
}

/// One pose of a trajectory file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryRow {
    /// The line it stands on, counted from 1.
    pub line: usize,
    /// The stamp, nanoseconds; KITTI files have none.
    pub stamp_nanos: Option<i64>,
    /// The pose as the file has it, metres; most files mean `world_from_camera`, EuRoC's mean `world_from_body`.
    pub pose: PoseRow,
}
