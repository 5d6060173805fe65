//! Channels with Foxglove's schemas, so that viewers show a sequence without a plug-in.
//!
//! | topic below `/foxglove/` | message | when |
//! |---|---|---|
//! | `camera_N/transform` | `FrameTransform` from the world to the camera | each frame whose pose is known |
//! | `camera_N/calibration` | `CameraCalibration` | each frame |
//! | `camera_N/annotations` | `ImageAnnotations`: points, segments in the colour of their group | each frame |
//! | `camera_N/true_trajectory` | `PosesInFrame` | first stamp |
//! | `camera_N/estimated_trajectory/NAME` | `PosesInFrame` | first stamp |
//! | `point_landmarks`, `map_points/NAME` | `PointCloud` | first stamp |
//! | `line_landmarks`, `map_lines/NAME` | `SceneUpdate`: lines in the colour of their group | first stamp |
//!
//! They are a rendering: 32-bit points, normalised quaternions. Readers of the format pass over them.

mod annotations;
pub(super) mod color;
mod scene;
pub(super) mod viewer_space;

use std::any::Any;
use std::collections::BTreeMap;

use ::foxglove::Encode;
use ::foxglove::messages::{CameraCalibration, FrameTransform, Timestamp};

use self::annotations::annotations;
use self::color::GroupColors;
use self::scene::Scene;
use self::viewer_space::ViewerSpace;
use super::Error;
use super::mcap_writer::McapWriter;
use super::names::FOXGLOVE_PREFIX;
use super::writer::FrameRows;
use crate::structure::{
    Camera, CameraId, Frame, FrameId, LineLandmark, Manifest, MapLine, MapPoint, PointLandmark, PoseRow,
    Record, StructuralGroup, TrajectoryPose,
};

/// What viewers are shown; filled in as the sequence is written.
///
/// The map and the trajectories are kept until the first frame comes, the groups throughout.
pub(super) struct FoxgloveChannels {
    space: ViewerSpace,
    cameras: Vec<Camera>,
    /// Camera of each frame.
    camera_of: BTreeMap<FrameId, CameraId>,
    /// Where the camera is shown: the truth, or the first estimate of a sequence without any truth.
    shown_poses: BTreeMap<FrameId, PoseRow>,
    scene: Scene,
    colors: GroupColors,
}

impl FoxgloveChannels {
    pub(super) fn new(manifest: &Manifest) -> Self {
        Self {
            space: ViewerSpace::of(manifest),
            cameras: manifest.cameras.clone(),
            camera_of: BTreeMap::new(),
            shown_poses: BTreeMap::new(),
            scene: Scene::default(),
            colors: GroupColors::default(),
        }
    }

    /// Takes what will be shown from rows of any table.
    pub(super) fn remember<R: Record>(&mut self, rows: &[R]) {
        for row in rows {
            self.remember_row(row);
        }
    }

    fn remember_row(&mut self, row: &dyn Any) {
        let scene = &mut self.scene;
        if let Some(row) = row.downcast_ref::<Frame>() {
            self.camera_of.insert(row.frame_id, row.camera_id);
            if let Some(pose) = row.world_from_camera() {
                self.shown_poses.insert(row.frame_id, pose);
                scene.add_pose(row.camera_id, None, &pose, self.space);
            }
        } else if let Some(row) = row.downcast_ref::<TrajectoryPose>() {
            if let Some(camera) = self.camera_of.get(&row.frame_id) {
                scene.add_pose(*camera, Some(&row.estimate), &row.world_from_camera(), self.space);
                scene.keep_for_frames(row);
            }
        } else if let Some(row) = row.downcast_ref::<PointLandmark>() {
            scene.add_point(None, row.position(), self.space);
        } else if let Some(row) = row.downcast_ref::<MapPoint>() {
            scene.add_point(Some(&row.estimate), [row.x, row.y, row.z].into(), self.space);
        } else if let Some(row) = row.downcast_ref::<LineLandmark>() {
            scene.add_line(None, row.line_id, row.segment());
        } else if let Some(row) = row.downcast_ref::<MapLine>() {
            scene.add_line(Some(&row.estimate), row.line_id, row.segment());
        } else if let Some(row) = row.downcast_ref::<StructuralGroup>() {
            self.colors.add(row);
        }
    }

    /// Writes what stays as it is: the map and the trajectories.
    pub(super) fn write_scene(&mut self, writer: &mut McapWriter, stamp: u64) -> Result<(), Error> {
        let mut scene = std::mem::take(&mut self.scene);
        scene.write(writer, stamp, self.space, &self.colors)?;
        if self.shown_poses.is_empty() {
            self.shown_poses = scene.first_estimate;
        }
        Ok(())
    }

    /// Writes what a frame shows, also if it has no rows.
    pub(super) fn write_frame(
        &self,
        writer: &mut McapWriter,
        frame: &Frame,
        rows: FrameRows<'_>,
    ) -> Result<(), Error> {
        let stamp = u64::try_from(frame.stamp_nanos).unwrap_or(0);
        let topic = |what: &str| format!("{}/{what}", camera_name(frame.camera_id));
        let shown = self.shown_poses.get(&frame.frame_id).and_then(|pose| self.space.pose(pose));
        if let Some(pose) = shown {
            let transform = FrameTransform {
                timestamp: Some(timestamp(stamp)),
                parent_frame_id: self.space.world().to_owned(),
                child_frame_id: camera_name(frame.camera_id),
                translation: pose.position,
                rotation: pose.orientation,
            };
            send(writer, &topic("transform"), stamp, &transform)?;
        }
        // A frame of an unknown camera has pixels, but nobody knows on which image.
        let Some(camera) = self.cameras.iter().find(|camera| camera.camera_id == frame.camera_id) else {
            return Ok(());
        };
        send(writer, &topic("calibration"), stamp, &self.calibration(camera, stamp))?;
        send(writer, &topic("annotations"), stamp, &annotations(camera, rows, &self.colors, stamp))
    }

    fn calibration(&self, camera: &Camera, stamp: u64) -> CameraCalibration {
        let [fx, fy, cx, cy] = self.space.intrinsics(camera);
        CameraCalibration {
            timestamp: Some(timestamp(stamp)),
            frame_id: camera_name(camera.camera_id),
            width: camera.width,
            height: camera.height,
            // Pixel positions of the format are free of distortion.
            distortion_model: String::new(),
            d: Vec::new(),
            k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
    }
}

/// Name of a camera's coordinate frame, and of its part of the topics.
fn camera_name(camera: CameraId) -> String {
    format!("camera_{}", camera.0)
}

/// A stamp as Foxglove has it; its seconds end in the year 2106.
fn timestamp(nanos: u64) -> Timestamp {
    const NANOS: u64 = 1_000_000_000;
    let seconds = u32::try_from(nanos / NANOS).unwrap_or(u32::MAX);
    Timestamp::new(seconds, u32::try_from(nanos % NANOS).unwrap_or(0))
}

/// Writes a message, on a channel that is made on first use.
fn send<M: Encode>(writer: &mut McapWriter, topic: &str, stamp: u64, message: &M) -> Result<(), Error> {
    let topic = format!("{FOXGLOVE_PREFIX}{topic}");
    writer.channel(&topic, &M::get_message_encoding(), |writer| {
        M::get_schema()
            .map(|schema| (schema.name, schema.encoding, schema.data.into_owned()))
            .ok_or_else(|| writer.failed("a Foxglove message without schema"))
    })?;
    let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
    message.encode(&mut bytes).map_err(|error| writer.failed(error.to_string()))?;
    writer.write_message(&topic, stamp, &bytes)
}
