//! Estimated camera paths.

use super::id::FrameId;
use super::pose_row::{PoseRow, stored_pose};
use super::record::record;

record! {
    /// One pose of one estimated trajectory.
    pub struct TrajectoryPose in trajectories (Whole, Optional, key: [estimate, frame_id]) {
        /// Name of the estimate, shared with `map_points` and `map_lines`; the registry has well-known ones, such as `map-to-frame`.
        ["1", "-"]
        estimate: String,
        /// Frame whose pose is estimated.
        ["1", "-"]
        frame_id: FrameId,
        /// Estimated camera centre, x.
        ["m", "world"]
        world_from_camera_tx: f64,
        /// Estimated camera centre, y.
        ["m", "world"]
        world_from_camera_ty: f64,
        /// Estimated camera centre, z.
        ["m", "world"]
        world_from_camera_tz: f64,
        /// Estimated rotation, Hamilton quaternion, x.
        ["1", "world_from_camera"]
        world_from_camera_qx: f64,
        /// Estimated rotation, Hamilton quaternion, y.
        ["1", "world_from_camera"]
        world_from_camera_qy: f64,
        /// Estimated rotation, Hamilton quaternion, z.
        ["1", "world_from_camera"]
        world_from_camera_qz: f64,
        /// Estimated rotation, Hamilton quaternion, w.
        ["1", "world_from_camera"]
        world_from_camera_qw: f64,
        /// Upper triangle, row by row, of the covariance of the tangent `[rotation; translation]` (rad, m) that is applied on the left of `world_from_camera`: 21 numbers; absent where it is not known.
        ["rad, m", "world", "1.3.0"]
        covariance: Option<Vec<f64>>,
    }
}

stored_pose!(TrajectoryPose { estimate: String, frame_id: FrameId } absent: covariance);
