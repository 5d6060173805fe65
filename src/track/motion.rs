//! Where the camera will be, if it goes on as it did.

use std::collections::VecDeque;

use crate::geometry::Pose;

/// Frames over which the speed is taken: the noise of two single poses would be carried on thrice as large.
const FRAMES: usize = 5;

/// A pause of so many frames says nothing of the speed.
const LONGEST_PAUSE: f64 = 10.0;

/// Constant velocity between frames, by their stamps.
#[derive(Clone, Debug, Default)]
pub(super) struct Motion {
    /// Stamps and poses (`world_from_camera`) of the last frames, the latest last.
    past: VecDeque<(i64, Pose)>,
}

impl Motion {
    /// The pose at a stamp; `None` before the first frame.
    pub(super) fn predict(&self, stamp_nanos: i64) -> Option<Pose> {
        let (last_stamp, last) = self.past.back()?;
        let (first_stamp, first) = self.past.front()?;
        let frames = (self.past.len() - 1) as f64;
        if frames < 1.0 {
            return Some(*last);
        }
        let whole = last_stamp.saturating_sub(*first_stamp) as f64;
        let ahead = stamp_nanos.saturating_sub(*last_stamp) as f64;
        // Stamps that stand still count as frames of one length.
        let share = if whole > 0.0 && ahead > 0.0 { ahead / whole } else { 1.0 / frames };
        let share = if share * frames <= LONGEST_PAUSE { share } else { 0.0 };
        let tangent = (first.inverse() * *last).log() * share;
        Some(*last * Pose::exp(&tangent))
    }

    /// The pose of the last frame.
    pub(super) fn last(&self) -> Option<Pose> {
        self.past.back().map(|(_, pose)| *pose)
    }

    /// Takes the pose of the next frame.
    pub(super) fn push(&mut self, stamp_nanos: i64, world_from_camera: Pose) {
        if self.past.len() >= FRAMES {
            self.past.pop_front();
        }
        self.past.push_back((stamp_nanos, world_from_camera));
    }

    /// Forgets the speed, where a pose was found anew.
    pub(super) fn restart(&mut self, stamp_nanos: i64, world_from_camera: Pose) {
        self.past.clear();
        self.past.push_back((stamp_nanos, world_from_camera));
    }
}
