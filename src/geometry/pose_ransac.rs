//! The pose of a camera from points of which many may be wrong.

use super::{Error, PinholeCamera, Pose, p3p};
use nalgebra::{Point2, Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What is sought here, in errors.
const WHAT: &str = "pose from points with outliers";

/// How long and how strictly a consensus is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RansacOptions {
    /// Seed of the samples.
    pub seed: u64,
    /// Probability that a sample without outlier is drawn.
    pub confidence: f64,
    /// Samples at most.
    pub most_samples: u32,
    /// Points that miss their pixel by more are outliers, sigma.
    pub threshold_sigma: f64,
}

impl Default for RansacOptions {
    fn default() -> Self {
        Self { seed: 0, confidence: 0.9999, most_samples: 2000, threshold_sigma: 3.5 }
    }
}

impl RansacOptions {
    /// Samples of a size until one has no outlier, with the confidence asked for.
    ///
    /// * `share` — of inliers.
    pub(super) fn samples_for(&self, share: f64, size: i32) -> u32 {
        let failure = 1.0 - share.powi(size);
        if failure <= 0.0 {
            return 1;
        }
        let needed = libm::log(1.0 - self.confidence) / libm::log(failure);
        if needed.is_nan() || needed >= f64::from(self.most_samples) {
            return self.most_samples;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between one and most_samples"
        )]
        let needed = needed.ceil().max(1.0) as u32;
        needed
    }
}

/// The pose on which the most points agree.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseConsensus {
    /// The pose of a sample, or better one; not refined over all inliers.
    pub camera_from_world: Pose,
    /// Indices of the points that agree, ascending.
    pub inliers: Vec<usize>,
    /// Samples drawn.
    pub samples: u32,
}

/// The pose on which the most points agree, among those of samples of three.
///
/// Samples are drawn until one without outlier has been drawn with the probability asked for, given the share of inliers seen so far. A
/// pose is scored by its truncated squared errors (MSAC).
///
/// * `points` — point in the world (metres), pixel, and the standard deviation of the pixel that both together have, pixels.
///
/// # Errors
/// [`Error::TooFew`] for less than four points, and [`Error::Degenerate`] when no pose has four that agree.
///
/// # Source
/// Fischler and Bolles 1981; the score of Torr and Zisserman 2000.
pub fn ransac_pose(
    camera: &PinholeCamera,
    points: &[(Point3<f64>, Point2<f64>, f64)],
    options: &RansacOptions,
) -> Result<PoseConsensus, Error> {
    let count = points.len();
    if count < 4 {
        return Err(Error::TooFew { what: WHAT, expected: 4, found: count });
    }
    let mut generator = ChaCha8Rng::seed_from_u64(options.seed);
    let rays: Vec<Vector3<f64>> = points.iter().map(|(_, pixel, _)| camera.ray(*pixel)).collect();
    let limit = options.threshold_sigma * options.threshold_sigma;
    let mut best: Option<(f64, Pose, usize)> = None;
    let (mut samples, mut needed) = (0, options.most_samples);
    while samples < needed {
        samples += 1;
        let sample = draw(&mut generator, count);
        for pose in p3p(&sample.map(|index| points[index].0), &sample.map(|index| rays[index])) {
            let least = best.map_or(f64::INFINITY, |(score, ..)| score);
            let Some((score, inliers)) = score(camera, points, &pose, limit, least) else { continue };
            best = Some((score, pose, inliers));
            needed = needed.min(options.samples_for(inliers as f64 / count as f64, 3));
        }
    }
    let (_, pose, _) = best
        .filter(|(_, _, inliers)| *inliers >= 4)
        .ok_or(Error::Degenerate { what: WHAT, reason: "no four points agree on one" })?;
    let inliers = (0..count).filter(|index| squared_error(camera, &points[*index], &pose) <= limit).collect();
    Ok(PoseConsensus { camera_from_world: pose, inliers, samples })
}

/// Three different indices.
fn draw(generator: &mut ChaCha8Rng, count: usize) -> [usize; 3] {
    let mut index = |below: usize| {
        // The high half of the product: off from uniform by less than count/2⁶⁴.
        usize::try_from((u128::from(generator.next_u64()) * below as u128) >> 64).unwrap_or(0)
    };
    let first = index(count);
    let mut second = index(count - 1);
    second += usize::from(second >= first);
    let mut third = index(count - 2);
    let (low, high) = (first.min(second), first.max(second));
    third += usize::from(third >= low);
    third += usize::from(third >= high);
    [first, second, third]
}

/// Squared error in squared sigma; infinite behind the camera.
fn squared_error(
    camera: &PinholeCamera,
    (point, pixel, sigma): &(Point3<f64>, Point2<f64>, f64),
    pose: &Pose,
) -> f64 {
    camera
        .project(pose * *point)
        .map_or(f64::INFINITY, |found| (found - pixel).norm_squared() / (sigma * sigma))
}

/// Sum of truncated errors and number of inliers; `None` when it is not less than `least`.
fn score(
    camera: &PinholeCamera,
    points: &[(Point3<f64>, Point2<f64>, f64)],
    pose: &Pose,
    limit: f64,
    least: f64,
) -> Option<(f64, usize)> {
    let (mut sum, mut inliers) = (0.0, 0);
    for point in points {
        let error = squared_error(camera, point, pose);
        if error <= limit {
            inliers += 1;
            sum += error;
        } else {
            sum += limit;
        }
        if sum >= least {
            return None;
        }
    }
    Some((sum, inliers))
}
