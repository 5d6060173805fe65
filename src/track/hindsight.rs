//! Hindsight: what the finished map says of frames that could not be placed when they came.

use nalgebra::Matrix6;

use super::alignment::Matches;
use super::landmark_tracker::LandmarkTracker;
use super::two_view_start::Waiting;
use super::{FrameTrack, TrackState};
use crate::geometry::Pose;
use crate::structure::FrameId;

/// Frames to look at again, once all have been seen.
#[derive(Debug, Default)]
pub(super) struct Hindsight {
    /// Frames that gave nothing to the map.
    pub(super) unplaced: Vec<Waiting>,
    /// The first frame, whose pose is given.
    pub(super) first: Option<Waiting>,
    /// The frame with which the map was begun anew, for nothing joined it to the first: where it stands is a guess.
    pub(super) begun_at: Option<Waiting>,
    /// What was said of each frame.
    pub(super) tracks: Vec<(FrameId, FrameTrack)>,
}

impl LandmarkTracker {
    /// Places frames in the finished map that could not be placed before; gives those of which something else is known now.
    ///
    /// A map that was begun anew stands wherever motion was thought to lead. Where the first frame sees it after all, everything moves
    /// together so that the given pose of that frame holds.
    pub(super) fn look_back(&mut self) -> Vec<(FrameId, FrameTrack)> {
        let Hindsight { unplaced, first, begun_at, mut tracks } = std::mem::take(&mut self.hindsight);
        let mut revised = std::mem::take(&mut self.revised);
        for frame in &unplaced {
            if let Some(track) = self.place(frame) {
                revised.push((frame.frame_id, track));
            }
        }
        let joined = begun_at.zip(first).and_then(|(begun, first)| Some((self.place(&first)?, first, begun)));
        let Some((found, first, begun)) = joined else { return revised };
        revised.extend(self.place(&begun).map(|track| (begun.frame_id, track)));
        for (frame_id, track) in revised {
            if let Some(known) = tracks.iter_mut().find(|(id, _)| *id == frame_id) {
                known.1 = track;
            }
        }
        let shift = first.view.camera_from_world.inverse() * found.world_from_camera.inverse();
        self.points.values_mut().for_each(|landmark| landmark.shift(&shift));
        self.lines.values_mut().for_each(|landmark| landmark.shift(&shift));
        let adjoint = shift.adjoint();
        for (_, track) in tracks.iter_mut().filter(|(id, _)| *id != first.frame_id) {
            track.world_from_camera = shift * track.world_from_camera;
            let moved = |covariance: Matrix6<f64>| adjoint * covariance * adjoint.transpose();
            track.covariance = track.covariance.map(moved);
        }
        tracks
    }

    /// The pose of a frame against the map, which takes nothing from it.
    fn place(&self, frame: &Waiting) -> Option<FrameTrack> {
        let mut seen = super::landmark_tracker::Seen::new(&frame.points, &frame.lines);
        let (points, lines) = self.matches(&mut seen);
        let (camera, sigma_px) = (&frame.view.camera, frame.view.sigma_px);
        let matches = Matches { camera, sigma_px, points: &points, lines: &lines };
        let found = matches.align(&frame.view.camera_from_world, self.seed_of(frame.frame_id))?;
        let world_from_camera: Pose = found.camera_from_world.inverse();
        let adjoint = world_from_camera.adjoint();
        let agree = |flags: &[bool]| flags.iter().filter(|agrees| **agrees).count();
        Some(FrameTrack {
            state: TrackState::Tracked,
            world_from_camera,
            covariance: Some(adjoint * found.covariance * adjoint.transpose()),
            matched: [points.len(), lines.len()],
            inliers: [agree(&found.points), agree(&found.lines)],
            residual_rms: Some(found.residual_rms),
        })
    }
}
