//! Tracking against landmarks with covariances: all that were seen, or those of the last frame.

use std::collections::BTreeMap;
use std::mem;

use nalgebra::{Matrix6, Vector6};

use super::alignment::{Alignment, Matches};
use super::hindsight::Hindsight;
use super::line_landmark::{LineLandmark, PendingLine};
use super::motion::Motion;
use super::options::Setting;
use super::point_landmark::{PendingPoint, PointLandmark, View};
use super::sighting::{LineSighting, PointSighting, sightings};
use super::tracker::upper_triangle;
use super::two_view_start::{TwoViewStart, Waiting};
use super::{Error, FrameTrack, TrackState, Tracker, TrackerMap};
use crate::geometry::{LineMatch, PointMatch, Pose};
use crate::structure::{FrameId, LineId, MapLine, MapPoint, MeasuredFrame, PointId};

/// A landmark that so many frames in a row contradict is measured anew.
const MOST_CONTRADICTIONS: u32 = 5;

/// After so many predicted frames in a row nobody knows where the camera is.
const MOST_PREDICTED: u32 = 30;

/// With fewer matches than this, or than this part of what was measured, there is hardly anything known in view: where they do not tell the
/// pose, the map goes on from the predicted one.
const FEW_MATCHES: usize = 3;
const FEW_SHARE: usize = 4;

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
    pub(super) points: BTreeMap<PointId, PointLandmark>,
    pub(super) lines: BTreeMap<LineId, LineLandmark>,
    pending_points: BTreeMap<PointId, PendingPoint>,
    pending_lines: BTreeMap<LineId, PendingLine>,
    /// Landmarks that are no longer tracked against, as last seen.
    past_points: BTreeMap<PointId, PointLandmark>,
    past_lines: BTreeMap<LineId, LineLandmark>,
    /// Covariance of the last pose, over the tangent on the left of `world_from_camera`.
    covariance: Matrix6<f64>,
    /// Predicted frames in a row.
    predicted: u32,
    /// Whether any frame was tracked yet.
    ever_tracked: bool,
    /// Frames that wait for a first map.
    start: TwoViewStart,
    /// What is known by now of frames that waited.
    pub(super) revised: Vec<(FrameId, FrameTrack)>,
    /// Frames to look at again in the end, against the whole map.
    pub(super) hindsight: Hindsight,
}

/// What was measured in a frame, and what is known of it.
pub(super) struct Seen<'a> {
    points: &'a [PointSighting],
    lines: &'a [LineSighting],
    /// Places in `points` and `lines` of what is matched.
    point_places: Vec<usize>,
    line_places: Vec<usize>,
}

impl<'a> Seen<'a> {
    pub(super) fn new(points: &'a [PointSighting], lines: &'a [LineSighting]) -> Self {
        Self { points, lines, point_places: Vec::new(), line_places: Vec::new() }
    }
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
            ever_tracked: false,
            start: TwoViewStart::default(),
            revised: Vec::new(),
            hindsight: Hindsight::default(),
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
        let numbers = alignment.map_or(0, |alignment| alignment.numbers);
        // After a predicted frame, the last one that was tracked still counts.
        if self.memory == Memory::LastFrame && alignment.is_some() {
            // Not `append`, which builds the whole past anew.
            self.past_points.extend(mem::take(&mut self.points));
            self.past_lines.extend(mem::take(&mut self.lines));
            self.pending_points.retain(|id, _| seen.points.binary_search_by_key(id, |s| s.id).is_ok());
            self.pending_lines.retain(|id, _| seen.lines.binary_search_by_key(id, |s| s.id).is_ok());
        }
        for (place, sighting) in seen.points.iter().enumerate() {
            let agreed = agrees(alignment.map(|a| &a.points), &seen.point_places, place);
            if let Some(landmark) = self.points.get_mut(&sighting.id) {
                match agreed.filter(|_| self.memory == Memory::Whole) {
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
            let landmark = PointLandmark::from_depth(view, sighting).or_else(|| {
                self.pending_points.entry(sighting.id).or_default().push(view, sighting, numbers)
            });
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
                match agreed.filter(|_| self.memory == Memory::Whole) {
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
                .or_else(|| self.pending_lines.entry(sighting.id).or_default().push(view, sighting, numbers));
            if let Some(landmark) = landmark {
                self.lines.insert(sighting.id, landmark);
                if self.memory == Memory::Whole {
                    self.pending_lines.remove(&sighting.id);
                }
            }
        }
    }

    /// Whether nothing is known to track against.
    fn is_empty(&self) -> bool {
        self.points.is_empty() && self.lines.is_empty()
    }

    /// Makes the first map of two views, and tracks the frames between them.
    fn begin(&mut self, camera_from_world: Pose, predicted: &Pose, seed: u64) -> FrameTrack {
        let frames = self.start.take();
        self.pending_points.clear();
        self.pending_lines.clear();
        if let (Some(first), Some(last)) = (frames.first(), frames.last()) {
            self.learn(
                &first.at(first.view.camera_from_world),
                &Seen::new(&first.points, &first.lines),
                None,
            );
            self.learn(&last.at(camera_from_world), &Seen::new(&last.points, &last.lines), None);
        }
        let mut track = None;
        let mut near = frames.first().map_or(*predicted, |first| first.view.camera_from_world.inverse());
        self.motion = Motion::default();
        for (place, frame) in frames.iter().enumerate() {
            if place == 0 {
                self.motion.push(frame.stamp_nanos, near);
                continue;
            }
            let last = place + 1 == frames.len();
            let start = if last { camera_from_world.inverse() } else { near };
            track = self.follow(frame, &start, seed);
            match &track {
                Some(track) => {
                    near = track.world_from_camera;
                    if !last {
                        self.revised.push((frame.frame_id, *track));
                    }
                }
                None => self.motion.push(frame.stamp_nanos, near),
            }
        }
        track.unwrap_or_else(|| match frames.last() {
            Some(last) => self.guess(last, &camera_from_world.inverse()),
            None => FrameTrack {
                state: TrackState::Predicted,
                world_from_camera: *predicted,
                covariance: None,
                matched: [0, 0],
                inliers: [0, 0],
                residual_rms: None,
            },
        })
    }

    /// The pose of a frame against what is known, which then takes its measurements; `None` where they do not tell it.
    fn follow(&mut self, frame: &Waiting, predicted: &Pose, seed: u64) -> Option<FrameTrack> {
        let mut seen = Seen::new(&frame.points, &frame.lines);
        let (points, lines) = self.matches(&mut seen);
        let matches = Matches {
            camera: &frame.view.camera,
            sigma_px: frame.view.sigma_px,
            points: &points,
            lines: &lines,
        };
        let found = matches.align(&predicted.inverse(), seed)?;
        let world_from_camera = found.camera_from_world.inverse();
        let adjoint = world_from_camera.adjoint();
        let of_frame = adjoint * found.covariance * adjoint.transpose();
        self.covariance = match self.memory {
            Memory::LastFrame => self.covariance + of_frame,
            Memory::Whole => of_frame,
        };
        let covariance = self.view_covariance(&found.camera_from_world, &self.covariance);
        let view = View { camera_from_world: found.camera_from_world, covariance, ..frame.view };
        self.learn(&view, &seen, Some(&found));
        if self.predicted > 0 {
            self.motion.restart(frame.stamp_nanos, world_from_camera);
        } else {
            self.motion.push(frame.stamp_nanos, world_from_camera);
        }
        self.predicted = 0;
        self.ever_tracked = true;
        let agree = |flags: &[bool]| flags.iter().filter(|agrees| **agrees).count();
        Some(FrameTrack {
            state: TrackState::Tracked,
            world_from_camera,
            covariance: Some(self.covariance),
            matched: [points.len(), lines.len()],
            inliers: [agree(&found.points), agree(&found.lines)],
            residual_rms: Some(found.residual_rms),
        })
    }

    /// A frame whose measurements do not tell its pose.
    fn guess(&mut self, frame: &Waiting, predicted: &Pose) -> FrameTrack {
        let mut seen = Seen::new(&frame.points, &frame.lines);
        let (points, lines) = self.matches(&mut seen);
        let matched = [points.len(), lines.len()];
        self.predicted += 1;
        let last = self.motion.last().unwrap_or(*predicted);
        self.covariance = self.predicted_covariance(&last, predicted);
        self.motion.push(frame.stamp_nanos, *predicted);
        let measured = frame.points.len() + frame.lines.len();
        let few = matched[0] + matched[1] < FEW_MATCHES.max(measured / FEW_SHARE);
        let whole = self.memory == Memory::Whole;
        if few && !self.ever_tracked && measured > FEW_MATCHES {
            // Nothing joins the first frame to this one: the map begins here.
            self.points.clear();
            self.lines.clear();
            let before = if whole { self.hindsight.begun_at.replace(frame.clone()) } else { None };
            self.hindsight.unplaced.extend(before);
        } else if whole && !few {
            self.hindsight.unplaced.push(frame.clone());
        }
        if self.memory == Memory::LastFrame || few {
            let covariance = self.view_covariance(&predicted.inverse(), &self.covariance);
            let view = View { camera_from_world: predicted.inverse(), covariance, ..frame.view };
            self.learn(&view, &seen, None);
        }
        let state = if self.predicted > MOST_PREDICTED { TrackState::Lost } else { TrackState::Predicted };
        FrameTrack {
            state,
            world_from_camera: *predicted,
            covariance: Some(self.covariance),
            matched,
            inliers: [0, 0],
            residual_rms: None,
        }
    }

    /// What a frame's measurements find in the map.
    pub(super) fn matches(&self, seen: &mut Seen<'_>) -> (Vec<PointMatch>, Vec<LineMatch>) {
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        for (place, sighting) in seen.points.iter().enumerate() {
            if let Some(landmark) = self.points.get(&sighting.id) {
                seen.point_places.push(place);
                points.push(landmark.matched(sighting));
            }
        }
        for (place, sighting) in seen.lines.iter().enumerate() {
            if let Some(landmark) = self.lines.get(&sighting.id) {
                seen.line_places.push(place);
                lines.push(landmark.matched(sighting));
            }
        }
        (points, lines)
    }
}

impl LandmarkTracker {
    /// The seed of a frame's random samples.
    pub(super) fn seed_of(&self, frame: FrameId) -> u64 {
        self.setting.seed ^ frame.0.cast_unsigned().wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }

    fn take(&mut self, frame: &MeasuredFrame) -> Result<FrameTrack, Error> {
        let (camera, noise) = *self
            .setting
            .cameras
            .get(&frame.camera_id)
            .ok_or(Error::UnknownCamera { frame: frame.frame_id, camera: frame.camera_id })?;
        let (points, lines) = sightings(frame, &noise);
        let predicted = self.motion.predict(frame.stamp_nanos);
        let pose = predicted.unwrap_or(self.setting.first);
        let at = Waiting {
            frame_id: frame.frame_id,
            stamp_nanos: frame.stamp_nanos,
            view: View {
                camera,
                sigma_px: noise.sigma_px,
                camera_from_world: pose.inverse(),
                covariance: Matrix6::zeros(),
            },
            points,
            lines,
        };
        if predicted.is_none() {
            self.motion.push(frame.stamp_nanos, pose);
            self.learn(&at.view, &Seen::new(&at.points, &at.lines), None);
            if self.memory == Memory::Whole {
                self.hindsight.first = Some(at.clone());
            }
            if self.is_empty() {
                self.start.push(at, 0);
            }
            return Ok(FrameTrack {
                state: TrackState::Gauge,
                world_from_camera: pose,
                covariance: Some(Matrix6::zeros()),
                matched: [0, 0],
                inliers: [0, 0],
                residual_rms: None,
            });
        }
        let seed = self.seed_of(frame.frame_id);
        if self.is_empty()
            && !self.ever_tracked
            && let Some(camera_from_world) = self.start.push(at.clone(), seed)
        {
            return Ok(self.begin(camera_from_world, &pose, seed));
        }
        if let Some(track) = self.follow(&at, &pose, seed) {
            return Ok(track);
        }
        Ok(self.guess(&at, &pose))
    }
}

impl Tracker for LandmarkTracker {
    fn advance(&mut self, frame: &MeasuredFrame) -> Result<FrameTrack, Error> {
        let track = self.take(frame)?;
        self.hindsight.tracks.push((frame.frame_id, track));
        Ok(track)
    }

    fn revised(&mut self) -> Vec<(FrameId, FrameTrack)> {
        self.look_back()
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
    let covariance = whole.then(|| upper_triangle(&landmark.covariance));
    MapPoint { covariance, ..MapPoint::new(String::new(), point_id, &landmark.point) }
}

fn map_line(line_id: LineId, landmark: &LineLandmark, whole: bool) -> MapLine {
    let covariance = landmark.covariance_of_ends().filter(|_| whole).map(|matrix| upper_triangle(&matrix));
    MapLine { covariance, ..MapLine::new(String::new(), line_id, &landmark.segment) }
}
