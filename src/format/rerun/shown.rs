//! Where the poses, landmarks and pixels of a sequence are shown, and in which colours.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::format::foxglove::color::GroupColors;
use crate::format::foxglove::viewer_space::{ViewerSpace, from_corner};
use crate::structure::{Camera, CameraId, FrameBundle, FrameId, LineId, PoseRow, Sequence};

/// How far before the camera its image is shown, of the length of the path, and metres at least.
const IMAGE_OF_PATH: f64 = 0.02;
const LEAST_IMAGE_M: f64 = 0.05;

/// What is shown, and how.
pub(super) struct Shown<'a> {
    pub(super) sequence: &'a Sequence,
    pub(super) space: ViewerSpace,
    pub(super) colors: GroupColors,
    /// Frame and nanoseconds since the first frame.
    pub(super) times: BTreeMap<FrameId, [i64; 2]>,
}

/// Paths of cameras by estimate; the truth has no name.
pub(super) type Paths = BTreeMap<(Option<String>, CameraId), Vec<(FrameId, PoseRow)>>;

impl<'a> Shown<'a> {
    pub(super) fn of(sequence: &'a Sequence) -> Self {
        let mut colors = GroupColors::default();
        sequence.structural_groups.iter().for_each(|group| colors.add(group));
        let first = sequence.frames.iter().map(|frame| frame.stamp_nanos).min().unwrap_or(0);
        let times = sequence
            .frames
            .iter()
            .map(|frame| (frame.frame_id, [frame.frame_id.0, frame.stamp_nanos.saturating_sub(first)]));
        Self { sequence, space: ViewerSpace::of(&sequence.manifest), colors, times: times.collect() }
    }

    pub(super) fn point(&self, point: Point3<f64>) -> [f32; 3] {
        self.space.point(point).map(single)
    }

    /// Paths of the truth and of every estimate.
    pub(super) fn paths(&self) -> Paths {
        let mut paths = Paths::new();
        let camera_of: BTreeMap<FrameId, CameraId> =
            self.sequence.frames.iter().map(|frame| (frame.frame_id, frame.camera_id)).collect();
        for frame in &self.sequence.frames {
            if let Some(pose) = frame.world_from_camera() {
                paths.entry((None, frame.camera_id)).or_default().push((frame.frame_id, pose));
            }
        }
        for row in &self.sequence.trajectories {
            if let Some(camera) = camera_of.get(&row.frame_id) {
                let path = paths.entry((Some(row.estimate.clone()), *camera)).or_default();
                path.push((row.frame_id, row.world_from_camera()));
            }
        }
        paths
    }

    /// Where cameras are shown: the truth, or the first estimate of a sequence without any truth.
    pub(super) fn poses(&self) -> BTreeMap<FrameId, PoseRow> {
        let truth: BTreeMap<FrameId, PoseRow> = self
            .sequence
            .frames
            .iter()
            .filter_map(|frame| Some((frame.frame_id, frame.world_from_camera()?)))
            .collect();
        let first = self.sequence.trajectories.first().map(|row| &row.estimate);
        if truth.is_empty() {
            let rows = self.sequence.trajectories.iter().filter(|row| Some(&row.estimate) == first);
            return rows.map(|row| (row.frame_id, row.world_from_camera())).collect();
        }
        truth
    }

    /// Which axis of the shown world points up, as the viewer's directions of its three axes.
    pub(super) fn upward(&self) -> [u8; 3] {
        // up 1, down 2, right 3, left 4, forward 5, back 6
        let mut up = Vector3::<f64>::zeros();
        for pose in self.poses().values() {
            let Some((_, [x, y, z, w])) = self.space.position_and_rotation(pose) else { continue };
            // The second column of the rotation points down in the image.
            up -= Vector3::new(2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w));
        }
        match (up.iamax(), up[up.iamax()] < 0.0) {
            _ if up.norm() < 1e-9 => [3, 5, 1],
            (0, false) => [1, 3, 5],
            (0, true) => [2, 4, 5],
            (1, false) => [3, 1, 6],
            (1, true) => [3, 2, 5],
            (_, false) => [3, 5, 1],
            (_, true) => [3, 6, 2],
        }
    }
}

fn is_measured(bundle: &FrameBundle) -> bool {
    !(bundle.point_measurements.is_empty() && bundle.line_measurements.is_empty())
}

/// Points of a frame: its measurements, or its observations if it has no measurement.
pub(super) fn points_of(camera: &Camera, bundle: &FrameBundle) -> Vec<[f32; 2]> {
    let pixel = |u: f64, v: f64| from_corner(camera, [u, v]).map(single);
    if is_measured(bundle) {
        bundle.point_measurements.iter().map(|row| pixel(row.u, row.v)).collect()
    } else {
        bundle.point_observations.iter().map(|row| pixel(row.u, row.v)).collect()
    }
}

/// Segments of a frame, likewise.
pub(super) fn segments_of(camera: &Camera, bundle: &FrameBundle) -> Vec<(LineId, Vec<[f32; 2]>)> {
    let pixel = |u: f64, v: f64| from_corner(camera, [u, v]).map(single);
    macro_rules! segments {
        ($rows:expr) => {
            $rows
                .iter()
                .map(|row| (row.line_id, vec![pixel(row.start_u, row.start_v), pixel(row.end_u, row.end_v)]))
                .collect()
        };
    }
    if is_measured(bundle) {
        segments!(bundle.line_measurements)
    } else {
        segments!(bundle.line_observations)
    }
}

/// How far before the camera its image is shown, metres.
pub(super) fn image_distance(poses: &BTreeMap<FrameId, PoseRow>) -> f32 {
    let places: Vec<Vector3<f64>> = poses.values().map(|pose| Vector3::from(pose.translation)).collect();
    let length: f64 =
        places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).filter(|step| step.is_finite()).sum();
    single((IMAGE_OF_PATH * length).max(LEAST_IMAGE_M))
}

#[expect(clippy::cast_possible_truncation, reason = "viewers draw with 32-bit floats")]
pub(super) fn single(number: f64) -> f32 {
    number as f32
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
pub(super) fn rgba(color: &::foxglove::messages::Color) -> u32 {
    let byte = |part: f64| (part * 255.0).round().clamp(0.0, 255.0) as u32;
    byte(color.r) << 24 | byte(color.g) << 16 | byte(color.b) << 8 | byte(color.a)
}
