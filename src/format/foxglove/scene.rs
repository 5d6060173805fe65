//! What stays as it is while the camera moves: maps and trajectories.

use std::collections::BTreeMap;

use ::foxglove::messages::line_primitive::Type;
use ::foxglove::messages::packed_element_field::NumericType;
use ::foxglove::messages::{
    LinePrimitive, PackedElementField, Point3 as ScenePoint, PointCloud, Pose, PosesInFrame, Quaternion,
    SceneEntity, SceneUpdate, Vector3,
};
use nalgebra::Point3;

use super::color::GroupColors;
use super::viewer_space::ViewerSpace;
use super::{camera_name, send, timestamp};
use crate::format::Error;
use crate::format::mcap_writer::McapWriter;
use crate::geometry::Segment;
use crate::structure::{CameraId, FrameId, LineId, PoseRow, TrajectoryPose};

/// Thickness of a line, pixels on the screen.
const LINE_THICKNESS: f64 = 2.0;
/// Bytes of a point: three 32-bit floats.
const POINT_STRIDE: u32 = 12;

/// Name of an estimate; the truth has none.
type Estimate = Option<String>;

/// Maps and trajectories, the truth and every estimate.
#[derive(Default)]
pub(super) struct Scene {
    trajectories: BTreeMap<(CameraId, Estimate), Vec<Pose>>,
    /// Point clouds, as the bytes of their message.
    points: BTreeMap<Estimate, Vec<u8>>,
    lines: BTreeMap<Estimate, Vec<(LineId, Segment)>>,
    first_estimate_name: Estimate,
    /// Poses of the estimate that comes first in the table `trajectories`.
    pub(super) first_estimate: BTreeMap<FrameId, PoseRow>,
}

impl Scene {
    /// Adds a pose to a trajectory; one that is no pose cannot be shown.
    pub(super) fn add_pose(
        &mut self,
        camera: CameraId,
        estimate: Option<&str>,
        world_from_camera: &PoseRow,
        space: ViewerSpace,
    ) {
        let key = (camera, estimate.map(str::to_owned));
        self.trajectories.entry(key).or_default().extend(space.pose(world_from_camera));
    }

    /// Keeps a pose of the first estimate, for frames of which nothing better is known.
    pub(super) fn keep_for_frames(&mut self, row: &TrajectoryPose) {
        let name = self.first_estimate_name.get_or_insert_with(|| row.estimate.clone());
        if *name == row.estimate {
            self.first_estimate.insert(row.frame_id, row.world_from_camera());
        }
    }

    /// Adds a point to a map.
    #[expect(clippy::cast_possible_truncation, reason = "viewers draw with 32-bit floats")]
    pub(super) fn add_point(&mut self, estimate: Option<&str>, point: Point3<f64>, space: ViewerSpace) {
        let bytes = self.points.entry(estimate.map(str::to_owned)).or_default();
        for number in space.point(point) {
            bytes.extend_from_slice(&(number as f32).to_le_bytes());
        }
    }

    /// Adds a line to a map.
    pub(super) fn add_line(&mut self, estimate: Option<&str>, line: LineId, segment: Segment) {
        self.lines.entry(estimate.map(str::to_owned)).or_default().push((line, segment));
    }

    /// Writes everything, stamped with the beginning of the sequence.
    pub(super) fn write(
        &mut self,
        writer: &mut McapWriter,
        stamp: u64,
        space: ViewerSpace,
        colors: &GroupColors,
    ) -> Result<(), Error> {
        for ((camera, estimate), poses) in std::mem::take(&mut self.trajectories) {
            let camera = camera_name(camera);
            let topic = match estimate {
                None => format!("{camera}/true_trajectory"),
                Some(name) => format!("{camera}/estimated_trajectory/{name}"),
            };
            let frame_id = space.world().to_owned();
            let message = PosesInFrame { timestamp: Some(timestamp(stamp)), frame_id, poses };
            send(writer, &topic, stamp, &message)?;
        }
        for (estimate, bytes) in std::mem::take(&mut self.points) {
            let topic = map_topic("point_landmarks", "map_points", estimate);
            send(writer, &topic, stamp, &point_cloud(bytes, stamp, space))?;
        }
        for (estimate, lines) in std::mem::take(&mut self.lines) {
            let topic = map_topic("line_landmarks", "map_lines", estimate);
            let message = scene_update(&topic, &lines, stamp, space, colors);
            send(writer, &topic, stamp, &message)?;
        }
        Ok(())
    }
}

fn map_topic(truth: &str, estimated: &str, estimate: Estimate) -> String {
    estimate.map_or_else(|| truth.to_owned(), |name| format!("{estimated}/{name}"))
}

fn point_cloud(bytes: Vec<u8>, stamp: u64, space: ViewerSpace) -> PointCloud {
    let field = |(name, offset): (&str, u32)| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: NumericType::Float32 as i32,
    };
    PointCloud {
        timestamp: Some(timestamp(stamp)),
        frame_id: space.world().to_owned(),
        pose: Some(identity()),
        point_stride: POINT_STRIDE,
        fields: [("x", 0), ("y", 4), ("z", 8)].map(field).to_vec(),
        data: bytes.into(),
    }
}

/// The lines of one map as one entity, one primitive for each colour.
fn scene_update(
    id: &str,
    lines: &[(LineId, Segment)],
    stamp: u64,
    space: ViewerSpace,
    colors: &GroupColors,
) -> SceneUpdate {
    let ends = |segment: &Segment| {
        [segment.start, segment.end].map(|end| {
            let [x, y, z] = space.point(end);
            ScenePoint { x, y, z }
        })
    };
    let primitives = colors
        .by_color(lines.iter().map(|(line, segment)| (*line, ends(segment))))
        .into_iter()
        .map(|(color, segments)| LinePrimitive {
            r#type: Type::LineList as i32,
            pose: Some(identity()),
            thickness: LINE_THICKNESS,
            scale_invariant: true,
            points: segments.concat(),
            color: Some(color),
            colors: Vec::new(),
            indices: Vec::new(),
        })
        .collect();
    let entity = SceneEntity {
        timestamp: Some(timestamp(stamp)),
        frame_id: space.world().to_owned(),
        id: id.to_owned(),
        lines: primitives,
        ..SceneEntity::default()
    };
    SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
}

fn identity() -> Pose {
    Pose {
        position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}
