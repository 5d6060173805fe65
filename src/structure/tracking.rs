//! What a tracker did in each frame.

use super::id::FrameId;
use super::record::record;

record! {
    /// What a tracker did in one frame: how many measurements it had, used and believed.
    pub struct TrackedFrame in tracking (Whole, Optional, key: [estimate, frame_id]) {
        /// Name of the estimate, shared with `trajectories`.
        ["1", "-"]
        estimate: String,
        /// Frame that was tracked.
        ["1", "-"]
        frame_id: FrameId,
        /// How the pose came about, such as `tracked` or `predicted`; see the registry.
        ["1", "-"]
        state: String,
        /// Measured points that were matched to the map or to the frame before.
        ["1", "-"]
        points: i64,
        /// Measured lines that were matched to the map or to the frame before.
        ["1", "-"]
        lines: i64,
        /// Points that agree with the pose.
        ["1", "-"]
        point_inliers: i64,
        /// Lines that agree with the pose.
        ["1", "-"]
        line_inliers: i64,
        /// Root mean square of the whitened residuals of the inliers, 1 where the declared noise is right; absent without inliers.
        ["1", "-"]
        residual_rms: Option<f64>,
    }
}
