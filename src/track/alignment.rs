//! The pose of one frame against landmarks, some of which may be wrong.

use nalgebra::{Matrix6, Point3};

use super::fusion::inverse;
use crate::geometry::{
    LineMatch, PinholeCamera, PointMatch, Pose, RansacOptions, Residual, RobustLoss, ransac_pose, refine_pose,
};

/// Chi-square that 99.9 % of good measurements stay under, by how many numbers were measured.
const GATES: [f64; 5] = [0.0, 10.828, 13.816, 16.266, 18.467];

/// Residuals begin to be doubted here, sigma, while it is not known which are wrong.
const DOUBT_SIGMA: f64 = 2.0;

/// With this share of matches in agreement no other pose is sought.
const AGREEMENT: f64 = 0.8;

/// A pose with less than this share of matches in agreement is none.
const LEAST_AGREEMENT: f64 = 0.3;

/// Fewer matches than this in agreement make no pose.
const LEAST_INLIERS: usize = 3;

/// Numbers measured beyond the six of the pose, so that agreement means something.
const LEAST_NUMBERS: usize = 8;

/// A pose is not known when the landmarks could be seen from this far off, relative to their distance.
const MOST_DOUBT: f64 = 0.1;

/// A pose that landmarks agree on.
#[derive(Clone, Debug)]
pub(super) struct Alignment {
    pub(super) camera_from_world: Pose,
    /// Covariance of the tangent of `camera_from_world`.
    pub(super) covariance: Matrix6<f64>,
    /// Whether each point, and each line, agrees.
    pub(super) points: Vec<bool>,
    pub(super) lines: Vec<bool>,
    /// Numbers that were measured of those that agree.
    pub(super) numbers: usize,
    /// Root mean square of the whitened residuals of those that agree.
    pub(super) residual_rms: f64,
}

/// One frame's matches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matches<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) sigma_px: f64,
    pub(super) points: &'a [PointMatch],
    pub(super) lines: &'a [LineMatch],
}

/// Which matches agree with a pose.
#[derive(Clone, Debug, PartialEq)]
struct Verdict {
    points: Vec<bool>,
    lines: Vec<bool>,
    inliers: usize,
    numbers: usize,
    squares: f64,
}

impl Matches<'_> {
    /// The pose on which the matches agree, sought first around `predicted` and, where too few agree, by consensus of samples.
    ///
    /// * `predicted` — `camera_from_world`.
    pub(super) fn align(&self, predicted: &Pose, seed: u64) -> Option<Alignment> {
        let count = self.points.len() + self.lines.len();
        let near = self.settle(predicted);
        let agreed = |found: &Option<(Alignment, usize)>| found.as_ref().map_or(0, |(_, inliers)| *inliers);
        if agreed(&near) as f64 >= AGREEMENT * count as f64 {
            return near.map(|(alignment, _)| alignment);
        }
        let far = self.consensus(predicted, seed).and_then(|start| self.settle(&start));
        // The nearer one where both are as good.
        let best = if agreed(&far) > agreed(&near) { far } else { near };
        best.filter(|(_, inliers)| *inliers as f64 >= LEAST_AGREEMENT * count as f64)
            .map(|(alignment, _)| alignment)
    }

    /// The pose near a start, and how many agree with it.
    fn settle(&self, start: &Pose) -> Option<(Alignment, usize)> {
        let loss = RobustLoss::Cauchy { sigma: DOUBT_SIGMA };
        let rough = refine_pose(self.camera, self.sigma_px, start, self.points, self.lines, loss).ok()?;
        let mut verdict = self.judge(&rough.camera_from_world);
        for _ in 0..4 {
            if verdict.inliers < LEAST_INLIERS || verdict.numbers < LEAST_NUMBERS {
                return None;
            }
            let points = kept(self.points, &verdict.points);
            let lines = kept(self.lines, &verdict.lines);
            let pose = rough.camera_from_world;
            let fine =
                refine_pose(self.camera, self.sigma_px, &pose, &points, &lines, RobustLoss::Squared).ok()?;
            let again = self.judge(&fine.camera_from_world);
            let settled = again.points == verdict.points && again.lines == verdict.lines;
            verdict = again;
            if settled {
                let covariance = inverse(&fine.information)?;
                let pose = fine.camera_from_world;
                let distance = points
                    .iter()
                    .map(|point| (pose * point.point).z)
                    .chain(lines.iter().map(|line| (pose * line.segment.midpoint()).z));
                let mean = distance.map(f64::abs).sum::<f64>() / (points.len() + lines.len()) as f64;
                let doubt = covariance.fixed_view::<3, 3>(3, 3).trace().sqrt() / mean
                    + covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
                if doubt.is_nan() || doubt > MOST_DOUBT {
                    return None;
                }
                let residual_rms = (verdict.squares / verdict.numbers as f64).sqrt();
                let inliers = verdict.inliers;
                let Verdict { points, lines, numbers, .. } = verdict;
                let alignment =
                    Alignment { camera_from_world: pose, covariance, points, lines, numbers, residual_rms };
                return Some((alignment, inliers));
            }
        }
        None
    }

    /// A pose that samples of the points agree on.
    fn consensus(&self, predicted: &Pose, seed: u64) -> Option<Pose> {
        let centre = Point3::from(predicted.inverse().translation());
        let triples: Vec<_> = self
            .points
            .iter()
            .map(|point| {
                // As wide as the landmark's doubt looks from about here.
                let distance = point.depth.map_or((point.point - centre).norm(), |depth| depth.depth_m());
                let wide = point.covariance.trace() / 3.0 * (self.camera.fx / distance).powi(2);
                (point.point, point.pixel, (self.sigma_px * self.sigma_px + wide).sqrt())
            })
            .filter(|(_, _, sigma)| sigma.is_finite())
            .collect();
        let options = RansacOptions { seed, ..RansacOptions::default() };
        ransac_pose(self.camera, &triples, &options).ok().map(|consensus| consensus.camera_from_world)
    }

    fn judge(&self, pose: &Pose) -> Verdict {
        let mut verdict =
            Verdict { points: Vec::new(), lines: Vec::new(), inliers: 0, numbers: 0, squares: 0.0 };
        for point in self.points {
            let residual = point.residual(self.camera, pose, self.sigma_px);
            let square = residual.and_then(|residual| distance(&residual, &point.covariance));
            verdict.points.push(square.is_some());
            verdict.add(square);
        }
        for line in self.lines {
            let residual = line.residual(self.camera, pose, self.sigma_px);
            let square = residual.and_then(|residual| distance(&residual, &line.covariance));
            verdict.lines.push(square.is_some());
            verdict.add(square);
        }
        verdict
    }
}

impl Verdict {
    fn add(&mut self, square: Option<(f64, usize)>) {
        if let Some((square, numbers)) = square {
            self.inliers += 1;
            self.numbers += numbers;
            self.squares += square;
        }
    }
}

fn kept<T: Copy>(matches: &[T], agree: &[bool]) -> Vec<T> {
    matches.iter().zip(agree).filter(|(_, agrees)| **agrees).map(|(found, _)| *found).collect()
}

/// Squared Mahalanobis distance of an error and how many numbers are in it; `None` when it is no good measurement's.
fn distance<const M: usize, const L: usize>(
    residual: &Residual<M, L>,
    covariance: &nalgebra::SMatrix<f64, L, L>,
) -> Option<(f64, usize)> {
    let weight = inverse(&residual.covariance(covariance))?;
    let square = residual.error.dot(&(weight * residual.error));
    (square <= GATES[residual.count.min(4)]).then_some((square, residual.count))
}
