//! What a tracker is, and the walk of one over a sequence.

use std::collections::BTreeMap;

use nalgebra::Matrix6;

use super::Error;
use crate::geometry::Pose;
use crate::structure::{
    Estimate, FrameId, MapLine, MapPoint, MeasuredFrame, PoseRow, TrackedFrame, TrajectoryPose, registry,
};

/// How the pose of a frame came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackState {
    /// Given from outside: the first frame.
    Gauge,
    /// From the frame's measurements.
    Tracked,
    /// From the motion before, for the measurements were too few or did not agree.
    Predicted,
    /// Nobody knows: no frame before it was tracked either.
    Lost,
}

impl TrackState {
    /// The registry's word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gauge => registry::GAUGE,
            Self::Tracked => registry::TRACKED,
            Self::Predicted => registry::PREDICTED,
            Self::Lost => registry::LOST,
        }
    }
}

/// What a tracker says of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTrack {
    /// How the pose came about.
    pub state: TrackState,
    /// The pose, metres.
    pub world_from_camera: Pose,
    /// Covariance over the tangent `[rotation; translation]` applied on the left of `world_from_camera`, where it is known.
    ///
    /// That of the built-in trackers is the frame's own: against a map, errors that the whole map has in common, such as drift since the
    /// first frame, are not in it; from frame to frame, it is the sum over all steps, which is too large by what neighbouring steps share.
    pub covariance: Option<Matrix6<f64>>,
    /// Points and lines that were matched to something known.
    pub matched: [usize; 2],
    /// Points and lines among them that agree with the pose.
    pub inliers: [usize; 2],
    /// Root mean square of the inliers' whitened residuals, where there are any.
    pub residual_rms: Option<f64>,
}

/// The landmarks that a tracker knows; names of estimates are left empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackerMap {
    /// Points.
    pub points: Vec<MapPoint>,
    /// Lines.
    pub lines: Vec<MapLine>,
}

/// Something that says where the camera was, one frame after the other.
///
/// The same frames give the same answers, to the bit.
pub trait Tracker {
    /// Takes the next frame.
    ///
    /// A frame with too few measurements is a state, not an error.
    ///
    /// # Errors
    /// [`Error::UnknownCamera`] for a frame whose camera the tracker does not know.
    fn advance(&mut self, frame: &MeasuredFrame) -> Result<FrameTrack, Error>;

    /// What it says by now of earlier frames, where that has changed; asked once, after the last frame and before the map.
    fn revised(&mut self) -> Vec<(FrameId, FrameTrack)> {
        Vec::new()
    }

    /// The landmarks that it knows by now.
    fn map(&self) -> TrackerMap;
}

/// Walks a tracker over the frames of a sequence.
///
/// * `frames` — in the order in which they were taken, as of [`MeasuredFrame::of`].
/// * `name` — name of the estimate.
/// * `progress` — told how many frames of how many are done.
///
/// # Errors
/// Those of [`Tracker::advance`], and [`Error::Repeated`] for a frame that comes twice.
pub fn track(
    frames: &[MeasuredFrame],
    name: &str,
    tracker: &mut dyn Tracker,
    progress: &dyn Fn(u64, u64),
) -> Result<Estimate, Error> {
    let mut tracks = BTreeMap::new();
    for (done, frame) in frames.iter().enumerate() {
        progress(done as u64, frames.len() as u64);
        let track = tracker.advance(frame)?;
        if tracks.insert(frame.frame_id, track).is_some() {
            return Err(Error::Repeated { frame: frame.frame_id });
        }
    }
    for (frame_id, track) in tracker.revised() {
        if let Some(known) = tracks.get_mut(&frame_id) {
            *known = track;
        }
    }
    let mut estimate = Estimate { name: name.to_owned(), ..Estimate::default() };
    for (frame_id, track) in tracks {
        let pose = PoseRow::from(&track.world_from_camera);
        let mut row = TrajectoryPose::new(name.to_owned(), frame_id, pose);
        row.covariance = track.covariance.as_ref().map(upper_triangle);
        estimate.trajectory.push(row);
        let count = |number: usize| i64::try_from(number).unwrap_or(i64::MAX);
        estimate.tracking.push(TrackedFrame {
            estimate: name.to_owned(),
            frame_id,
            state: track.state.name().to_owned(),
            points: count(track.matched[0]),
            lines: count(track.matched[1]),
            point_inliers: count(track.inliers[0]),
            line_inliers: count(track.inliers[1]),
            residual_rms: track.residual_rms,
        });
    }
    let map = tracker.map();
    estimate.points =
        map.points.into_iter().map(|row| MapPoint { estimate: name.to_owned(), ..row }).collect();
    estimate.lines = map.lines.into_iter().map(|row| MapLine { estimate: name.to_owned(), ..row }).collect();
    Ok(estimate)
}

/// The upper triangle of a symmetric matrix, row by row.
pub(super) fn upper_triangle<const N: usize>(matrix: &nalgebra::SMatrix<f64, N, N>) -> Vec<f64> {
    (0..N).flat_map(|row| (row..N).map(move |column| matrix[(row, column)])).collect()
}
