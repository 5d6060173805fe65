//! The paper's plain trackers: `EPnP` over points with depth, landmarks as averages, nothing else.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3, Vector3};

use super::motion::Motion;
use super::options::{Method, Setting};
use super::sighting::{LineSighting, PointSighting, sightings};
use super::{Error, FrameTrack, TrackState, Tracker, TrackerMap};
use crate::geometry::{PinholeCamera, Pose, Segment, epnp};
use crate::structure::{LineId, MapLine, MapPoint, MeasuredFrame, PointId};

/// Under eight points the noise of `EPnP`'s algebraic error outweighs what they tell.
const LEAST_POINTS: usize = 8;

/// After so many predicted frames in a row nobody knows where the camera is.
const MOST_PREDICTED: u32 = 30;

/// A sum of places, and how many they are.
#[derive(Clone, Copy, Debug)]
struct Mean {
    sum: Vector3<f64>,
    count: u32,
}

impl Mean {
    fn of(place: Point3<f64>) -> Self {
        Self { sum: place.coords, count: 1 }
    }

    fn add(&mut self, place: Point3<f64>) {
        self.sum += place.coords;
        self.count += 1;
    }

    fn place(&self) -> Point3<f64> {
        Point3::from(self.sum / f64::from(self.count))
    }
}

/// The paper's tracker, from frame to frame or from the map.
#[derive(Debug)]
pub(super) struct ClassicTracker {
    setting: Setting,
    method: Method,
    motion: Motion,
    points: BTreeMap<PointId, Mean>,
    lines: BTreeMap<LineId, [Mean; 2]>,
    /// Points of the last frame, in the world.
    last: BTreeMap<PointId, Point3<f64>>,
    predicted: u32,
    ever_tracked: bool,
}

impl ClassicTracker {
    pub(super) fn new(setting: Setting, method: Method) -> Self {
        Self {
            setting,
            method,
            motion: Motion::default(),
            points: BTreeMap::new(),
            lines: BTreeMap::new(),
            last: BTreeMap::new(),
            predicted: 0,
            ever_tracked: false,
        }
    }

    /// Points in the world that a frame sees, with their pixels.
    fn pairs(&self, points: &[PointSighting]) -> Vec<(Point3<f64>, Point2<f64>)> {
        let known = |id: &PointId| match self.method {
            Method::FrameToFrame => self.last.get(id).copied(),
            Method::MapToFrame => self.points.get(id).map(Mean::place),
        };
        points.iter().filter_map(|sighting| Some((known(&sighting.id)?, sighting.pixel))).collect()
    }

    /// Takes the places of everything with depth.
    fn learn(
        &mut self,
        camera: &PinholeCamera,
        pose: &Pose,
        points: &[PointSighting],
        lines: &[LineSighting],
    ) {
        // After a predicted frame, points of the last one that was tracked stay the better known ones.
        if self.predicted == 0 {
            self.last.clear();
        }
        for sighting in points {
            let Some(depth) = sighting.depth else { continue };
            let place = pose * camera.back_project(sighting.pixel, depth.depth_m());
            self.last.entry(sighting.id).or_insert(place);
            // A guessed pose brings in what is new, and leaves alone what is known.
            let known = self.points.entry(sighting.id);
            if self.predicted == 0 {
                known.and_modify(|mean| mean.add(place)).or_insert_with(|| Mean::of(place));
            } else {
                known.or_insert_with(|| Mean::of(place));
            }
        }
        for sighting in lines {
            let [Some(start), Some(end)] = sighting.depths else { continue };
            let start = pose * camera.back_project(sighting.ends_px[0], start.depth_m());
            let end = pose * camera.back_project(sighting.ends_px[1], end.depth_m());
            if let Some(means) = self.lines.get_mut(&sighting.id) {
                if self.predicted > 0 {
                    continue;
                }
                let [known_start, known_end] = means.map(|mean| mean.place());
                // Ends come in either order.
                let turned = (start - known_end).norm_squared() + (end - known_start).norm_squared()
                    < (start - known_start).norm_squared() + (end - known_end).norm_squared();
                let (start, end) = if turned { (end, start) } else { (start, end) };
                means[0].add(start);
                means[1].add(end);
            } else {
                self.lines.insert(sighting.id, [Mean::of(start), Mean::of(end)]);
            }
        }
    }
}

impl Tracker for ClassicTracker {
    fn advance(&mut self, frame: &MeasuredFrame) -> Result<FrameTrack, Error> {
        let (camera, noise) = *self
            .setting
            .cameras
            .get(&frame.camera_id)
            .ok_or(Error::UnknownCamera { frame: frame.frame_id, camera: frame.camera_id })?;
        let (points, lines) = sightings(frame, &noise);
        let mut track = FrameTrack {
            state: TrackState::Gauge,
            world_from_camera: self.setting.first,
            covariance: None,
            matched: [0, 0],
            inliers: [0, 0],
            residual_rms: None,
        };
        if let Some(predicted) = self.motion.predict(frame.stamp_nanos) {
            let pairs = self.pairs(&points);
            track.matched = [pairs.len(), 0];
            let found = if pairs.len() >= LEAST_POINTS { epnp(&camera, &pairs).ok() } else { None };
            if let Some(camera_from_world) = found {
                track.state = TrackState::Tracked;
                track.world_from_camera = camera_from_world.inverse();
                // Nothing is gated here: what is used is believed.
                track.inliers = [pairs.len(), 0];
                let squares = pairs.iter().filter_map(|(point, pixel)| {
                    Some((camera.project(camera_from_world * *point)? - pixel).norm_squared())
                });
                let mean = squares.sum::<f64>() / (2 * pairs.len()) as f64;
                track.residual_rms = Some(mean.sqrt() / noise.sigma_px);
                self.predicted = 0;
                self.ever_tracked = true;
            } else {
                self.predicted += 1;
                if !self.ever_tracked && pairs.is_empty() && !points.is_empty() {
                    // Nothing joins the first frame to this one: the map begins here.
                    self.points.clear();
                    self.lines.clear();
                    self.last.clear();
                }
                track.state =
                    if self.predicted > MOST_PREDICTED { TrackState::Lost } else { TrackState::Predicted };
                track.world_from_camera = predicted;
            }
        }
        self.motion.push(frame.stamp_nanos, track.world_from_camera);
        self.learn(&camera, &track.world_from_camera, &points, &lines);
        Ok(track)
    }

    fn map(&self) -> TrackerMap {
        let points = self.points.iter().map(|(id, mean)| MapPoint::new(String::new(), *id, &mean.place()));
        let lines = self.lines.iter().map(|(id, means)| {
            let [start, end] = means.map(|mean| mean.place());
            MapLine::new(String::new(), *id, &Segment { start, end })
        });
        TrackerMap { points: points.collect(), lines: lines.collect() }
    }
}
