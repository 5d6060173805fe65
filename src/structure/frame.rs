//! One exposure of one camera.

use super::id::{CameraId, FrameId};
use super::pose_row::PoseRow;
use super::record::record;

record! {
    /// One exposure of one camera, with its true pose where that is known.
    ///
    /// The seven `world_from_camera` columns are present together or absent together.
    pub struct Frame in frames (Whole, Required, key: [frame_id]) {
        /// Name of the frame; ascending in time.
        ["1", "-"]
        frame_id: FrameId,
        /// Time of the exposure since the Unix epoch, or since the start of the sequence where the manifest's clock is `synthetic`.
        ["ns", "-"]
        stamp_nanos: i64,
        /// Camera of the manifest that took the frame.
        ["1", "-"]
        camera_id: CameraId,
        /// True camera centre, x.
        ["m", "world"]
        world_from_camera_tx: Option<f64>,
        /// True camera centre, y.
        ["m", "world"]
        world_from_camera_ty: Option<f64>,
        /// True camera centre, z.
        ["m", "world"]
        world_from_camera_tz: Option<f64>,
        /// True rotation, Hamilton quaternion, x.
        ["1", "world_from_camera"]
        world_from_camera_qx: Option<f64>,
        /// True rotation, Hamilton quaternion, y.
        ["1", "world_from_camera"]
        world_from_camera_qy: Option<f64>,
        /// True rotation, Hamilton quaternion, z.
        ["1", "world_from_camera"]
        world_from_camera_qz: Option<f64>,
        /// True rotation, Hamilton quaternion, w.
        ["1", "world_from_camera"]
        world_from_camera_qw: Option<f64>,
    }
}

impl Frame {
    /// A frame with its true pose, if known.
    #[must_use]
    pub fn new(
        frame_id: FrameId,
        stamp_nanos: i64,
        camera_id: CameraId,
        world_from_camera: Option<PoseRow>,
    ) -> Self {
        let number = |index: usize| world_from_camera.map(|pose| pose.numbers()[index]);
        Self {
            frame_id,
            stamp_nanos,
            camera_id,
            world_from_camera_tx: number(0),
            world_from_camera_ty: number(1),
            world_from_camera_tz: number(2),
            world_from_camera_qx: number(3),
            world_from_camera_qy: number(4),
            world_from_camera_qz: number(5),
            world_from_camera_qw: number(6),
        }
    }

    /// The true pose; `None` when it is not known or not whole.
    #[must_use]
    pub fn world_from_camera(&self) -> Option<PoseRow> {
        let [tx, ty, tz, qx, qy, qz, qw] = self.pose_columns();
        Some(PoseRow::from_numbers([tx?, ty?, tz?, qx?, qy?, qz?, qw?]))
    }

    /// The seven pose columns as they are.
    #[must_use]
    pub const fn pose_columns(&self) -> [Option<f64>; 7] {
        [
            self.world_from_camera_tx,
            self.world_from_camera_ty,
            self.world_from_camera_tz,
            self.world_from_camera_qx,
            self.world_from_camera_qy,
            self.world_from_camera_qz,
            self.world_from_camera_qw,
        ]
    }
}
