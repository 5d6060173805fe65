//! A model of another program as a sequence: frames, cameras, a graph and its measurements, no truth.

use std::collections::{BTreeMap, BTreeSet};

use super::remark::Remarks;
use super::text_file::check_finite;
use super::{Error, Remark};
use crate::geometry::PinholeCamera;
use crate::structure::{
    Camera, CameraId, Clock, Frame, FrameId, GraphFactor, GraphPoint, GraphPose, Manifest, Noise, PointId,
    PointMeasurement, PoseRow, Sequence, frame_statistics, point_correspondences, registry,
};

/// Time between frames of a source that has none: one second.
const STEP_NANOS: i64 = 1_000_000_000;
/// The largest image that is assumed where a source does not say a size, pixels.
const LARGEST_SIZE_PX: f64 = 1e6;
/// How far a stored quaternion may be from length 1 before it is scaled to it; that of the specification.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// How an imported model is called.
#[derive(Clone, Debug)]
pub struct ImportNames {
    /// Name of the sequence.
    pub sequence: String,
    /// Name of its graph.
    pub graph: String,
}

/// A model of another program, read.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The model as a sequence.
    pub sequence: Sequence,
    /// What could not be taken over, or was said in another way.
    pub remarks: Vec<Remark>,
}

/// A sequence in the making.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) graph: String,
    pub(super) cameras: Vec<Camera>,
    pub(super) camera_of_frame: BTreeMap<FrameId, CameraId>,
    pub(super) poses: Vec<GraphPose>,
    pub(super) points: Vec<GraphPoint>,
    pub(super) factors: Vec<GraphFactor>,
    /// Whether the manifest says that pixels have a sigma of 1.
    pub(super) has_pixels: bool,
    pub(super) remarks: Remarks,
}

impl Draft {
    /// A pose vertex; its quaternion is scaled to length 1 where it is far from it.
    pub(super) fn add_pose(&mut self, id: i64, fixed: bool, pose: PoseRow) -> Result<(), Error> {
        let pose = self.unit(pose, || format!("pose {id}"))?;
        self.poses.push(GraphPose::new(self.graph.clone(), FrameId(id), fixed, pose));
        Ok(())
    }

    /// A pose whose quaternion has length 1, as far as the specification asks.
    pub(super) fn unit(&mut self, pose: PoseRow, what: impl Fn() -> String) -> Result<PoseRow, Error> {
        check_finite(&what, &pose.numbers())?;
        let transform = pose.pose().map_err(|error| Error::unfit(what(), "a rigid transform", error))?;
        let norm = pose.rotation_xyzw.iter().map(|part| part * part).sum::<f64>().sqrt();
        if (norm - 1.0).abs() <= QUATERNION_TOLERANCE {
            return Ok(pose);
        }
        self.remarks.said(1, "quaternions were scaled to length 1");
        Ok(PoseRow::from(&transform))
    }

    /// A point vertex.
    pub(super) fn add_point(&mut self, id: i64, [x, y, z]: [f64; 3]) {
        self.points.push(GraphPoint { graph: self.graph.clone(), point_id: PointId(id), x, y, z });
    }

    /// A point seen in a frame.
    pub(super) fn add_view(
        &mut self,
        frame: FrameId,
        point: PointId,
        measurement: Vec<f64>,
        information: Option<Vec<f64>>,
    ) {
        self.has_pixels = true;
        self.factors.push(GraphFactor {
            frame_id: Some(frame),
            point_id: Some(point),
            measurement,
            information,
            ..self.factor(registry::POINT_REPROJECTION)
        });
    }

    /// The next factor, of a kind.
    pub(super) fn factor(&self, kind: &str) -> GraphFactor {
        GraphFactor {
            graph: self.graph.clone(),
            factor_id: i64::try_from(self.factors.len()).unwrap_or(i64::MAX),
            kind: kind.to_owned(),
            frame_id: None,
            other_frame_id: None,
            point_id: None,
            line_id: None,
            group_id: None,
            measurement: Vec::new(),
            information: None,
        }
    }

    /// Gives every camera an image large enough for what it shows, where the source does not say a size.
    pub(super) fn guess_sizes(&mut self) {
        let mut reach: BTreeMap<CameraId, [f64; 2]> = BTreeMap::new();
        for factor in &self.factors {
            let camera = factor.frame_id.and_then(|frame| self.camera_of_frame.get(&frame));
            if let (Some(camera), [u, v, ..]) = (camera, factor.measurement.as_slice()) {
                let seen = reach.entry(*camera).or_default();
                *seen = [seen[0].max(*u), seen[1].max(*v)];
            }
        }
        for camera in &mut self.cameras {
            let [u, v] = reach.get(&camera.camera_id).copied().unwrap_or_default();
            camera.width = size(u, camera.cx);
            camera.height = size(v, camera.cy);
        }
    }

    /// The whole sequence.
    pub(super) fn finish(mut self, dataset: &str, names: &ImportNames) -> Imported {
        if self.cameras.is_empty() {
            // A frame has to name a camera, also where nothing is seen.
            let pinhole =
                PinholeCamera { fx: 500.0, fy: 500.0, cx: 319.5, cy: 239.5, width: 640, height: 480 };
            self.cameras.push(Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CENTER));
            self.remarks.said(1, "camera stands in, for the source has none and a frame must name one");
        }
        let first = self.cameras[0].camera_id;
        self.poses.sort_by_key(|row| row.frame_id);
        self.points.sort_by_key(|row| row.point_id);
        let frames: Vec<Frame> = (0..)
            .zip(&self.poses)
            .map(|(place, row)| {
                let camera = self.camera_of_frame.get(&row.frame_id).copied().unwrap_or(first);
                Frame::new(row.frame_id, place * STEP_NANOS, camera, None)
            })
            .collect();
        let mut manifest = Manifest { name: names.sequence.clone(), ..Manifest::default() };
        dataset.clone_into(&mut manifest.source.dataset);
        "os import".clone_into(&mut manifest.generator.tool);
        env!("CARGO_PKG_VERSION").clone_into(&mut manifest.generator.version);
        manifest.clock =
            Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: Some(1e9 / STEP_NANOS as f64) };
        manifest.cameras = self.cameras;
        if self.has_pixels {
            let parameters = BTreeMap::from([("sigma_px".to_owned(), 1.0)]);
            let model = registry::NOISE_GAUSSIAN.to_owned();
            manifest.noise = Some(Noise { model, seed: None, parameters });
        }
        let mut sequence = Sequence {
            manifest,
            frames,
            graph_poses: self.poses,
            graph_points: self.points,
            graph_factors: self.factors,
            ..Sequence::default()
        };
        let twice = measurements(&mut sequence);
        self.remarks
            .lost(twice, "measurements of a point that the frame shows already; they are in the graph alone");
        if self.has_pixels {
            sequence.point_correspondences = point_correspondences(&sequence.point_measurements, &[]);
            sequence.frame_statistics = frame_statistics(&sequence);
        }
        Imported { sequence, remarks: self.remarks.into_vec() }
    }
}

/// Makes the rows of measurements from the factors; gives how many repeat a point of the frame.
fn measurements(sequence: &mut Sequence) -> usize {
    let mut seen = BTreeSet::new();
    let mut twice = 0;
    for factor in &sequence.graph_factors {
        let (Some(frame_id), Some(point_id), [u, v, rest @ ..]) =
            (factor.frame_id, factor.point_id, factor.measurement.as_slice())
        else {
            continue;
        };
        if seen.insert((frame_id, point_id)) {
            let depth = rest.first().copied().filter(|depth| *depth > 0.0);
            sequence.point_measurements.push(PointMeasurement { frame_id, point_id, u: *u, v: *v, depth });
        } else {
            twice += 1;
        }
    }
    sequence.point_measurements.sort_by_key(|row| (row.frame_id, row.point_id));
    twice
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
fn size(reach: f64, centre: f64) -> u32 {
    (reach + 1.0).max(2.0 * centre + 1.0).ceil().clamp(1.0, LARGEST_SIZE_PX) as u32
}
