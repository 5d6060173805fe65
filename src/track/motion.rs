//! Where the camera will be, if it goes on as it did.

use crate::geometry::Pose;

/// Constant velocity between frames, by their stamps.
#[derive(Clone, Debug, Default)]
pub(super) struct Motion {
    /// Stamp and pose (`world_from_camera`) of the last two frames.
    last: Option<(i64, Pose)>,
    before: Option<(i64, Pose)>,
}

impl Motion {
    /// The pose at a stamp; `None` before the first frame.
    pub(super) fn predict(&self, stamp_nanos: i64) -> Option<Pose> {
        let (last_stamp, last) = self.last?;
        let Some((before_stamp, before)) = self.before else { return Some(last) };
        let step = last_stamp.saturating_sub(before_stamp) as f64;
        let ahead = stamp_nanos.saturating_sub(last_stamp) as f64;
        // Stamps that stand still, or a long pause, say nothing of the speed.
        let share = if step > 0.0 && ahead > 0.0 { ahead / step } else { 1.0 };
        let share = if share <= 10.0 { share } else { 0.0 };
        let tangent = (before.inverse() * last).log() * share;
        Some(last * Pose::exp(&tangent))
    }

    /// The pose of the last frame.
    pub(super) fn last(&self) -> Option<Pose> {
        self.last.map(|(_, pose)| pose)
    }

    /// Takes the pose of the next frame.
    pub(super) fn push(&mut self, stamp_nanos: i64, world_from_camera: Pose) {
        self.before = self.last.replace((stamp_nanos, world_from_camera));
    }

    /// Forgets the speed, where a pose was found anew.
    pub(super) fn restart(&mut self, stamp_nanos: i64, world_from_camera: Pose) {
        (self.before, self.last) = (None, Some((stamp_nanos, world_from_camera)));
    }
}
