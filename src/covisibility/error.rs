//! What keeps a graph from being built.

use crate::geometry;
use crate::structure::{CameraId, FrameId};

/// What keeps a graph from being built.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The estimate has no pose of any frame that was measured.
    #[error("estimate `{estimate}`: has no pose of a measured frame")]
    NoPoses {
        /// Name of the estimate.
        estimate: String,
    },
    /// A stored pose is no pose.
    #[error("trajectories: estimate `{estimate}`, {frame_id}: {cause}")]
    Pose {
        /// Name of the estimate.
        estimate: String,
        /// Its frame.
        frame_id: FrameId,
        /// What is wrong.
        cause: geometry::Error,
    },
    /// A frame's camera is not in the manifest.
    #[error("frames: {frame_id}: its {camera_id} is not in the manifest")]
    Camera {
        /// The frame.
        frame_id: FrameId,
        /// The camera.
        camera_id: CameraId,
    },
    /// An option makes no sense.
    #[error("{option}: expected {expected}, found {found}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
}
