//! A tracker of one's own: the points of a frame laid on a map, three dimensions on three.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector3};
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::structure::{Camera, CameraId, MapPoint, MeasuredFrame, PointId};
use open_structure::track::{Error, FrameTrack, TrackState, Tracker, TrackerMap};

/// Points that have to be known for a pose.
const LEAST_POINTS: usize = 4;

/// Lays the points that a frame measured, with their depth, on the points of a map (Kabsch 1976), and averages them into it.
#[derive(Debug)]
pub struct CloudTracker {
    cameras: BTreeMap<CameraId, PinholeCamera>,
    /// Sum of places and how many there were.
    map: BTreeMap<PointId, (Vector3<f64>, f64)>,
    last: Pose,
    before: Pose,
    begun: bool,
}

impl CloudTracker {
    /// A tracker at its first frame, whose pose is given.
    #[must_use]
    pub fn new(cameras: &[Camera], first: Pose) -> Self {
        let cameras = cameras.iter().map(|camera| (camera.camera_id, camera.projection())).collect();
        Self { cameras, map: BTreeMap::new(), last: first, before: first, begun: false }
    }
}

impl Tracker for CloudTracker {
    fn advance(&mut self, frame: &MeasuredFrame) -> Result<FrameTrack, Error> {
        let unknown = Error::UnknownCamera { frame: frame.frame_id, camera: frame.camera_id };
        let camera = *self.cameras.get(&frame.camera_id).ok_or(unknown)?;
        let in_camera: Vec<(PointId, Point3<f64>)> = frame
            .points
            .iter()
            .filter_map(|row| {
                Some((row.point_id, camera.back_project(Point2::new(row.u, row.v), row.depth?)))
            })
            .collect();
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = in_camera
            .iter()
            .filter_map(|(id, place)| {
                let (sum, count) = self.map.get(id)?;
                Some((place.coords, sum / *count))
            })
            .collect();
        let (state, pose) = if !self.begun {
            (TrackState::Gauge, self.last)
        } else if let Some(pose) = laid_on(&pairs) {
            (TrackState::Tracked, pose)
        } else {
            // As fast as before.
            (TrackState::Predicted, self.last * self.before.inverse() * self.last)
        };
        if state != TrackState::Predicted {
            for (id, place) in &in_camera {
                let (sum, count) = self.map.entry(*id).or_insert((Vector3::zeros(), 0.0));
                *sum += (pose * *place).coords;
                *count += 1.0;
            }
        }
        self.before = if self.begun { self.last } else { pose };
        self.last = pose;
        self.begun = true;
        let matched = [pairs.len(), 0];
        Ok(FrameTrack {
            state,
            world_from_camera: pose,
            covariance: None,
            matched,
            inliers: if state == TrackState::Tracked { matched } else { [0, 0] },
            residual_rms: None,
        })
    }

    fn map(&self) -> TrackerMap {
        let point = |(id, (sum, count)): (&PointId, &(Vector3<f64>, f64))| {
            MapPoint::new(String::new(), *id, &Point3::from(sum / *count))
        };
        TrackerMap { points: self.map.iter().map(point).collect(), lines: Vec::new() }
    }
}

/// The pose that lays places in the camera on places in the world with the least squared distances.
fn laid_on(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Pose> {
    if pairs.len() < LEAST_POINTS {
        return None;
    }
    let count = pairs.len() as f64;
    let sum =
        pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
    let (camera, world) = (sum.0 / count, sum.1 / count);
    let covariance =
        pairs.iter().fold(Matrix3::zeros(), |sum, (x, y)| sum + (y - world) * (x - camera).transpose());
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mirrored = (u * v_t).determinant() < 0.0;
    let flip = Vector3::new(1.0, 1.0, if mirrored { -1.0 } else { 1.0 });
    let rotation = u * Matrix3::from_diagonal(&flip) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Pose::new(rotation, world - rotation * camera))
}
