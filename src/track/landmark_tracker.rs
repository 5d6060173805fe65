//! Tracking against landmarks with covariances: all that were seen, or those of the last frame.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Vector6};

use super::alignment::{Alignment, Matches};
use super::line_landmark::{LineLandmark, PendingLine};
use super::motion::Motion;
use super::options::Setting;
use super::point_landmark::{PendingPoint, PointLandmark, View};
use super::sighting::{LineSighting, PointSighting, sightings};
use super::tracker::upper_triangle;
use super::{Error, FrameTrack, TrackState, Tracker, TrackerMap};
use crate::geometry::{LineMatch, PointMatch, Pose};
use crate::structure::{LineId, MapLine, MapPoint, MeasuredFrame, PointId};

/// A landmark that so many frames in a row contradict is measured anew.
const MOST_CONTRADICTIONS: u32 = 5;

/// After so many predicted frames in a row nobody knows where the camera is.
const MOST_PREDICTED: u32 = 30;

/// With fewer matches than this there is nothing known in view, and the map goes on from the predicted pose.
const FEW_MATCHES: usize = 3;

/// How much of the map is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Memory {
    /// What the last frame measured.
    LastFrame,
    /// Everything.
    Whole,
}

/// A tracker against landmarks with covariances.
#[derive(Debug)]
pub(super) struct LandmarkTracker {
    setting: Setting,
    memory: Memory,
    motion: Motion,
    points: BTreeMap<PointId, PointLandmark>,
    lines: BTreeMap<LineId, LineLandmark>,
    pending_points: BTreeMap<PointId, PendingPoint>,
    pending_lines: BTreeMap<LineId, PendingLine>,
    /// Landmarks that are no longer tracked against, as last seen.
    past_points: BTreeMap<PointId, PointLandmark>,
    past_lines: BTreeMap<LineId, LineLandmark>,
    /// Covariance of the last pose, over the tangent on the left of `world_from_camera`.
    covariance: Matrix6<f64>,
    /// Predicted frames in a row.
    predicted: u32,
}

/// What was measured in a frame, and what is known of it.
struct Seen<'a> {
    points: &'a [PointSighting],
    lines: &'a [LineSighting],
    /// Places in `points` and `lines` of what is matched.
    point_places: Vec<usize>,
    line_places: Vec<usize>,
}

impl LandmarkTracker {
    pub(super) fn new(setting: Setting, memory: Memory) -> Self {
        Self {
            setting,
            memory,
            motion: Motion::default(),
            points: BTreeMap::new(),
            lines: BTreeMap::new(),
            pending_points: BTreeMap::new(),
            pending_lines: BTreeMap::new(),
            past_points: BTreeMap::new(),
            past_lines: BTreeMap::new(),
            covariance: Matrix6::zeros(),
            predicted: 0,
        }
    }

    /// Covariance of a predicted pose: that of the last one, and half of the motion that was assumed.
    fn predicted_covariance(&self, last: &Pose, predicted: &Pose) -> Matrix6<f64> {
        let step = (last.inverse() * *predicted).log();
        let turn = 0.5 * step.fixed_rows::<3>(0).norm() + 0.01;
        let shift = 0.5 * step.fixed_rows::<3>(3).norm() + 0.01;
        let sigma = Vector6::new(turn, turn, turn, shift, shift, shift);
        let adjoint = predicted.adjoint();
        self.covariance + adjoint * Matrix6::from_diagonal(&sigma.map(|s| s * s)) * adjoint.transpose()
    }

    /// What a frame's pose adds to landmarks: nothing where only the last frame counts.
    fn view_covariance(&self, camera_from_world: &Pose, world: &Matrix6<f64>) -> Matrix6<f64> {
        match self.memory {
            Memory::LastFrame => Matrix6::zeros(),
            Memory::Whole => {
                let adjoint = camera_from_world.adjoint();
                adjoint * world * adjoint.transpose()
            }
        }
    }

    /// Brings measurements that agree into their landmarks, and new ones into the map.
    fn learn(&mut self, view: &View, seen: &Seen<'_>, alignment: Option<&Alignment>) {
        let agrees = |flags: Option<&Vec<bool>>, places: &[usize], place: usize| {
            flags.and_then(|flags| places.binary_search(&place).ok().map(|at| flags[at]))
        };
        if self.memory == Memory::LastFrame {
            self.past_points.append(&mut self.points);
            self.past_lines.append(&mut self.lines);
            self.pending_points.retain(|id, _| seen.points.binary_search_by_key(id, |s| s.id).is_ok());
            self.pending_lines.retain(|id, _| seen.lines.binary_search_by_key(id, |s| s.id).is_ok());
        }
        for (place, sighting) in seen.points.iter().enumerate() {
            let agreed = agrees(alignment.map(|a| &a.points), &seen.point_places, place);
            if let Some(landmark) = self.points.get_mut(&sighting.id) {
                match agreed {
                    Some(true) => landmark.fuse(view, sighting),
                    Some(false) => {
                        landmark.contradictions += 1;
                        if landmark.contradictions >= MOST_CONTRADICTIONS {
                            self.points.remove(&sighting.id);
                        }
                    }
                    None => {}
                }
                continue;
            }
            if self.memory == Memory::LastFrame && agreed == Some(false) {
                // Whichever of the two frames was wrong, its past leads nowhere.
                self.pending_points.remove(&sighting.id);
            }
            let landmark = PointLandmark::from_depth(view, sighting)
                .or_else(|| self.pending_points.entry(sighting.id).or_default().push(view, sighting));
            if let Some(landmark) = landmark {
                self.points.insert(sighting.id, landmark);
                if self.memory == Memory::Whole {
                    self.pending_points.remove(&sighting.id);
                }
            }
        }
        for (place, sighting) in seen.lines.iter().enumerate() {
            let agreed = agrees(alignment.map(|a| &a.lines), &seen.line_places, place);
            if let Some(landmark) = self.lines.get_mut(&sighting.id) {
                match agreed {
                    Some(true) => landmark.fuse(view, sighting),
                    Some(false) => {
                        landmark.contradictions += 1;
                        if landmark.contradictions >= MOST_CONTRADICTIONS {
                            self.lines.remove(&sighting.id);
                        }
                    }
                    None => {}
                }
                continue;
            }
            if self.memory == Memory::LastFrame && agreed == Some(false) {
                self.pending_lines.remove(&sighting.id);
            }
            let landmark = LineLandmark::from_depth(view, sighting)
                .or_else(|| self.pending_lines.entry(sighting.id).or_default().push(view, sighting));
            if let Some(landmark) = landmark {
                self.lines.insert(sighting.id, landmark);
                if self.memory == Memory::Whole {
                    self.pending_lines.remove(&sighting.id);
                }
            }
        }
    }
}

impl Tracker for LandmarkTracker {
    fn advance(&mut self, frame: &MeasuredFrame) -> Result<FrameTrack, Error> {
        let (camera, noise) = *self
            .setting
            .cameras
            .get(&frame.camera_id)
            .ok_or(Error::UnknownCamera { frame: frame.frame_id, camera: frame.camera_id })?;
        let (points, lines) = sightings(frame, &noise);
        let mut seen =
            Seen { points: &points, lines: &lines, point_places: Vec::new(), line_places: Vec::new() };
        let sigma_px = noise.sigma_px;
        let view = |world_from_camera: &Pose, covariance: Matrix6<f64>| View {
            camera,
            sigma_px,
            camera_from_world: world_from_camera.inverse(),
            covariance,
        };
        let Some(predicted) = self.motion.predict(frame.stamp_nanos) else {
            let first = self.setting.first;
            self.motion.push(frame.stamp_nanos, first);
            self.learn(&view(&first, Matrix6::zeros()), &seen, None);
            return Ok(FrameTrack {
                state: TrackState::Gauge,
                world_from_camera: first,
                covariance: Some(Matrix6::zeros()),
                matched: [0, 0],
                inliers: [0, 0],
                residual_rms: None,
            });
        };
        let (mut point_matches, mut line_matches): (Vec<PointMatch>, Vec<LineMatch>) =
            (Vec::new(), Vec::new());
        for (place, sighting) in points.iter().enumerate() {
            if let Some(landmark) = self.points.get(&sighting.id) {
                seen.point_places.push(place);
                point_matches.push(landmark.matched(sighting));
            }
        }
        for (place, sighting) in lines.iter().enumerate() {
            if let Some(landmark) = self.lines.get(&sighting.id) {
                seen.line_places.push(place);
                line_matches.push(landmark.matched(sighting));
            }
        }
        let matched = [point_matches.len(), line_matches.len()];
        let matches = Matches { camera: &camera, sigma_px, points: &point_matches, lines: &line_matches };
        let seed = self.setting.seed ^ frame.frame_id.0.cast_unsigned().wrapping_mul(0x9e37_79b9_7f4a_7c15);
        if let Some(found) = matches.align(&predicted.inverse(), seed) {
            let world_from_camera = found.camera_from_world.inverse();
            let adjoint = world_from_camera.adjoint();
            let of_frame = adjoint * found.covariance * adjoint.transpose();
            self.covariance = match self.memory {
                Memory::LastFrame => self.covariance + of_frame,
                Memory::Whole => of_frame,
            };
            let covariance = self.view_covariance(&found.camera_from_world, &self.covariance);
            self.learn(&view(&world_from_camera, covariance), &seen, Some(&found));
            if self.predicted > 0 {
                self.motion.restart(frame.stamp_nanos, world_from_camera);
            } else {
                self.motion.push(frame.stamp_nanos, world_from_camera);
            }
            self.predicted = 0;
            let agree = |flags: &[bool]| flags.iter().filter(|agrees| **agrees).count();
            return Ok(FrameTrack {
                state: TrackState::Tracked,
                world_from_camera,
                covariance: Some(self.covariance),
                matched,
                inliers: [agree(&found.points), agree(&found.lines)],
                residual_rms: Some(found.residual_rms),
            });
        }
        self.predicted += 1;
        let last = self.motion.last().unwrap_or(predicted);
        self.covariance = self.predicted_covariance(&last, &predicted);
        self.motion.push(frame.stamp_nanos, predicted);
        if self.memory == Memory::LastFrame || matched[0] + matched[1] < FEW_MATCHES {
            let covariance = self.view_covariance(&predicted.inverse(), &self.covariance);
            self.learn(&view(&predicted, covariance), &seen, None);
        }
        let state = if self.predicted > MOST_PREDICTED { TrackState::Lost } else { TrackState::Predicted };
        Ok(FrameTrack {
            state,
            world_from_camera: predicted,
            covariance: Some(self.covariance),
            matched,
            inliers: [0, 0],
            residual_rms: None,
        })
    }

    fn map(&self) -> TrackerMap {
        let whole = self.memory == Memory::Whole;
        let mut points = self.past_points.clone();
        points.extend(self.points.iter().map(|(id, landmark)| (*id, *landmark)));
        let mut lines = self.past_lines.clone();
        lines.extend(self.lines.iter().map(|(id, landmark)| (*id, *landmark)));
        TrackerMap {
            points: points.iter().map(|(id, landmark)| map_point(*id, landmark, whole)).collect(),
            lines: lines.iter().map(|(id, landmark)| map_line(*id, landmark, whole)).collect(),
        }
    }
}

fn map_point(point_id: PointId, landmark: &PointLandmark, whole: bool) -> MapPoint {
    MapPoint {
        estimate: String::new(),
        point_id,
        x: landmark.point.x,
        y: landmark.point.y,
        z: landmark.point.z,
        covariance: whole.then(|| upper_triangle(&landmark.covariance)),
    }
}

fn map_line(line_id: LineId, landmark: &LineLandmark, whole: bool) -> MapLine {
    let (start, end) = (landmark.segment.start, landmark.segment.end);
    MapLine {
        estimate: String::new(),
        line_id,
        start_x: start.x,
        start_y: start.y,
        start_z: start.z,
        end_x: end.x,
        end_y: end.y,
        end_z: end.z,
        covariance: landmark.covariance_of_ends().filter(|_| whole).map(|matrix| upper_triangle(&matrix)),
    }
}
