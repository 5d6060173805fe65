//! Poses by frame: rows checked, the first of each frame kept.

use super::ledger::Ledger;
use crate::text_release::{PoseLine, TextSequence};
use open_structure::geometry::Pose;
use open_structure::structure::{FrameId, PoseRow};
use std::collections::BTreeMap;

/// The largest frame id whose stamp of a 30 Hz clock fits.
pub(super) const LARGEST_FRAME: i64 = i64::MAX / 1_000_000_000 * 30 - 30;

/// A pose as it stands in its file, and ready for use.
#[derive(Clone, Copy, Debug)]
pub(super) struct FramePose {
    /// Seven numbers, digits kept.
    pub(super) row: PoseRow,
    /// The transform into the camera, metres.
    pub(super) camera_from_world: Pose,
}

/// Poses by frame.
pub(super) type Poses = BTreeMap<FrameId, FramePose>;

/// Whether a frame of this id can be stored.
pub(super) fn is_frame(id: i64) -> bool {
    (0..=LARGEST_FRAME).contains(&id)
}

/// The poses of a file.
pub(super) fn poses(rows: &[PoseLine], file: &str, ledger: &mut Ledger) -> Poses {
    let mut poses = Poses::new();
    for line in rows {
        if !is_frame(line.id) {
            ledger.exclude(file, "frame id is negative or too large", Some(line.row));
            continue;
        }
        let row = PoseRow { translation: line.translation, rotation_xyzw: line.rotation_xyzw };
        let Ok(world_from_camera) = row.pose() else {
            ledger.exclude(file, "quaternion names no rotation", Some(line.row));
            continue;
        };
        let id = FrameId(line.id);
        if poses.contains_key(&id) {
            ledger.exclude(file, "pose of a frame comes again; the first is kept", Some(line.row));
            continue;
        }
        poses.insert(id, FramePose { row, camera_from_world: world_from_camera.inverse() });
    }
    poses
}

/// The largest distance between positions of the same frames, metres, and how many frames both have.
pub(super) fn largest_distance(one: &Poses, other: &Poses) -> (f64, usize) {
    let mut largest = 0.0_f64;
    let mut common = 0;
    for (id, pose) in one {
        if let Some(found) = other.get(id) {
            let square: f64 =
                (0..3).map(|axis| (pose.row.translation[axis] - found.row.translation[axis]).powi(2)).sum();
            largest = largest.max(square.sqrt());
            common += 1;
        }
    }
    (largest, common)
}

/// The largest angle between orientations of the same frames, radians.
pub(super) fn largest_angle(one: &Poses, other: &Poses) -> f64 {
    one.iter()
        .filter_map(|(id, pose)| {
            Some((pose.camera_from_world * other.get(id)?.camera_from_world.inverse()).rotation_angle())
        })
        .fold(0.0, f64::max)
}

/// Whether no number has more than four decimals, as TUM prints them.
pub(super) fn is_coarse(poses: &Poses) -> bool {
    let coarse = |number: f64| (number * 1e4 - (number * 1e4).round()).abs() < 1e-6;
    !poses.is_empty() && poses.values().all(|pose| pose.row.numbers().iter().all(|number| coarse(*number)))
}

/// Ground truth that is printed again may differ by its rounding, metres and radians.
pub(super) const REPEATED_TRUTH: f64 = 2e-3;

/// The true poses: of the file with all digits, or of one that prints them again.
pub(super) fn true_poses(text: &TextSequence, ledger: &mut Ledger) -> Poses {
    let repeated = || text.repeated_ground_truth.iter();
    let first = text.ground_truth.as_ref().or_else(|| {
        let most = repeated().map(|file| file.poses.len()).max();
        repeated().find(|file| Some(file.poses.len()) == most)
    });
    let Some(first) = first else { return Poses::new() };
    let mut truth = poses(&first.poses, &first.file, ledger);
    for file in repeated().filter(|file| file.file != first.file) {
        let again = poses(&file.poses, &file.file, ledger);
        let (distance, _) = largest_distance(&truth, &again);
        let angle = largest_angle(&truth, &again);
        if distance > REPEATED_TRUTH || angle > REPEATED_TRUTH {
            let reason = format!(
                "ground truth differs from {} by up to {distance:.4} m, {angle:.4} rad; the latter is kept",
                first.file
            );
            ledger.exclude_many(&file.file, &reason, again.len() as u64, None);
            continue;
        }
        let before = truth.len();
        for (id, pose) in again {
            truth.entry(id).or_insert(pose);
        }
        if truth.len() > before {
            ledger.note(format!("{} true poses are in {} alone", truth.len() - before, file.file));
        }
    }
    truth
}
