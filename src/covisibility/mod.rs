//! Co-visibility: factor graphs of measurements about an estimate, with key frames and loop closures.
//!
//! An estimate gives initial values, the measurements give factors: [`reprojection_graph`] has poses, points and lines
//! as vertices and one factor for each measurement; [`pose_graph`] has poses alone, with relative poses between
//! neighbours and loop closures where landmarks are seen again after a gap.

mod error;
mod key_frames;
mod loops;
mod options;
mod pose_graph;
mod relative_pose;
mod reprojection_graph;

#[cfg(test)]
mod tests;

pub use error::Error;
pub use options::{GraphOptions, KeyFrameRule, LoopRule};
pub use pose_graph::{PoseGraphSummary, pose_graph};
pub use relative_pose::{RelativePose, relative_pose};
pub use reprojection_graph::{GraphSummary, reprojection_graph};
