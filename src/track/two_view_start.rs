//! The beginning without depth: two views give the first map, and with it the unit of length.

use nalgebra::Matrix6;

use super::point_landmark::View;
use super::sighting::{LineSighting, PointSighting};
use crate::geometry::{Pose, RansacOptions, relative_pose};
use crate::structure::FrameId;

/// Pairs with the first view that are needed.
const LEAST_PAIRS: usize = 12;

/// Median parallax of the two views, radians.
const LEAST_PARALLAX: f64 = 0.1;

/// Share of the pairs that must agree.
const LEAST_AGREEMENT: f64 = 0.6;

/// Frames that wait for a beginning at most; the first view moves on when there are more.
const MOST_FRAMES: usize = 300;

/// A frame that waits for a beginning.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    pub(super) frame_id: FrameId,
    pub(super) stamp_nanos: i64,
    pub(super) view: View,
    pub(super) points: Vec<PointSighting>,
    pub(super) lines: Vec<LineSighting>,
}

/// Frames without a map.
#[derive(Clone, Debug, Default)]
pub(super) struct TwoViewStart {
    frames: Vec<Waiting>,
}

impl TwoViewStart {
    /// Takes a frame; gives its `camera_from_world` where it and the first view that waits see enough parallax.
    ///
    /// Both views are one unit apart: no measurement without depth tells more.
    pub(super) fn push(&mut self, frame: Waiting, seed: u64) -> Option<Pose> {
        let found = self.relative(&frame, seed);
        self.frames.push(frame);
        // A first view that shares too little with the latest will never be joined to it.
        while self.frames.len() > MOST_FRAMES || self.frames.len() > 1 && self.shared() < LEAST_PAIRS {
            self.frames.remove(0);
        }
        found
    }

    fn relative(&self, frame: &Waiting, seed: u64) -> Option<Pose> {
        let first = self.frames.first()?;
        let pairs: Vec<_> = shared(&first.points, &frame.points).collect();
        if pairs.len() < LEAST_PAIRS {
            return None;
        }
        let cameras = [&first.view.camera, &frame.view.camera];
        let options = RansacOptions { seed, ..RansacOptions::default() };
        let found = relative_pose(cameras, &pairs, frame.view.sigma_px, &options).ok()?;
        let agree = found.inliers.len() as f64 >= LEAST_AGREEMENT * pairs.len() as f64;
        (agree && found.inliers.len() >= LEAST_PAIRS && found.parallax >= LEAST_PARALLAX)
            .then(|| found.second_from_first * first.view.camera_from_world)
    }

    /// Points that the first and the latest frame share.
    fn shared(&self) -> usize {
        match (self.frames.first(), self.frames.last()) {
            (Some(first), Some(last)) => shared(&first.points, &last.points).count(),
            _ => 0,
        }
    }

    /// The frames that waited, the first view first; none wait from here on.
    pub(super) fn take(&mut self) -> Vec<Waiting> {
        std::mem::take(&mut self.frames)
    }
}

impl Waiting {
    /// The frame as seen from a pose that is known.
    pub(super) fn at(&self, camera_from_world: Pose) -> View {
        View { camera_from_world, covariance: Matrix6::zeros(), ..self.view }
    }
}

/// Pixels of the points that two frames share.
fn shared<'a>(
    first: &'a [PointSighting],
    second: &'a [PointSighting],
) -> impl Iterator<Item = (nalgebra::Point2<f64>, nalgebra::Point2<f64>)> + 'a {
    first.iter().filter_map(move |sighting| {
        let place = second.binary_search_by_key(&sighting.id, |other| other.id).ok()?;
        Some((sighting.pixel, second[place].pixel))
    })
}
