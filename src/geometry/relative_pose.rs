//! The relative pose of two views of the same points, up to scale.

use nalgebra::{Matrix3, Point2, Rotation3, SVector, UnitQuaternion, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::direction::{angle, perpendicular};
use super::five_points::five_points;
use super::least_squares::{Normal, minimise};
use super::{Error, PinholeCamera, Pose, RansacOptions};

/// What is sought here, in errors.
const WHAT: &str = "relative pose of two views";

/// Samples at least: within the noise, the first that all pairs agree on may still be a poor one.
const LEAST_SAMPLES: u32 = 30;

/// Step of the differences that stand for derivatives, radians.
const STEP: f64 = 1e-6;

/// The relative pose on which the most pairs agree.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativePose {
    /// The pose, its translation of length one: two views do not tell how far apart they are.
    pub second_from_first: Pose,
    /// Indices of the pairs that agree, ascending.
    pub inliers: Vec<usize>,
    /// Median angle between the two rays of an inlier, radians; near zero, the translation is noise.
    pub parallax: f64,
    /// Samples drawn.
    pub samples: u32,
}

/// The relative pose of two views from pairs of pixels, some of which may be wrong.
///
/// Samples of five give essential matrices; each gives four poses, of which one has the points in front of both cameras. The pose on which
/// the most pairs agree, by Sampson's distance, is refined over them. Points in one plane are no obstacle.
///
/// * `cameras` — of the first and of the second view; `pairs` — the same point in both, pixels; `sigma_px` — noise of the pixels.
///
/// # Errors
/// [`Error::TooFew`] for less than six pairs, [`Error::Degenerate`] when no pose has six that agree, as where both views are one.
///
/// # Source
/// Nistér 2004; Sampson's distance as in Hartley and Zisserman, *Multiple View Geometry*, section 11.4.3.
pub fn relative_pose(
    cameras: [&PinholeCamera; 2],
    pairs: &[(Point2<f64>, Point2<f64>)],
    sigma_px: f64,
    options: &RansacOptions,
) -> Result<RelativePose, Error> {
    let count = pairs.len();
    if count < 6 {
        return Err(Error::TooFew { what: WHAT, expected: 6, found: count });
    }
    for (a, b) in pairs {
        Error::check_finite(WHAT, a.iter().chain(b.iter()))?;
    }
    let rays: Vec<(Vector3<f64>, Vector3<f64>)> =
        pairs.iter().map(|(a, b)| (cameras[0].normalised(*a), cameras[1].normalised(*b))).collect();
    let sigmas =
        cameras.map(|camera| Vector3::new(sigma_px / camera.fx, sigma_px / camera.fy, 0.0).map(f64::abs));
    let limit = options.threshold_sigma * options.threshold_sigma;
    let mut generator = ChaCha8Rng::seed_from_u64(options.seed);
    let mut best: Option<(f64, Matrix3<f64>)> = None;
    let (mut samples, mut needed) = (0, options.most_samples);
    while samples < needed {
        samples += 1;
        let sample = draw(&mut generator, count);
        for matrix in five_points(&sample.map(|k| rays[k].0), &sample.map(|k| rays[k].1)) {
            let errors = rays.iter().map(|pair| sampson(&matrix, pair, &sigmas).powi(2));
            let (mut score, mut inliers) = (0.0, 0);
            for error in errors {
                score += error.min(limit);
                inliers += usize::from(error <= limit);
            }
            if best.is_some_and(|(least, _)| score >= least) {
                continue;
            }
            // Where views differ little, many matrices fit the pixels; the points must lie in front of the cameras as well.
            let agree = || rays.iter().filter(|pair| sampson(&matrix, pair, &sigmas).powi(2) <= limit);
            let Some(pose) = decomposed(&matrix, agree()) else { continue };
            let seen = agree().filter(|pair| in_front(&pose, pair)).count();
            if 4 * seen < 3 * inliers {
                continue;
            }
            best = Some((score, matrix));
            needed = needed.min(options.samples_for(inliers as f64 / count as f64, 5)).max(LEAST_SAMPLES);
        }
    }
    let open = Error::Degenerate { what: WHAT, reason: "no pairs agree on one" };
    let (_, matrix) = best.ok_or_else(|| open.clone())?;
    let agreeing = |matrix: &Matrix3<f64>| -> Vec<usize> {
        (0..count).filter(|k| sampson(matrix, &rays[*k], &sigmas).powi(2) <= limit).collect()
    };
    let mut inliers = agreeing(&matrix);
    let mut pose = decomposed(&matrix, inliers.iter().map(|k| &rays[*k])).ok_or_else(|| open.clone())?;
    for _ in 0..2 {
        if inliers.len() < 6 {
            return Err(open);
        }
        let used: Vec<_> = inliers.iter().map(|k| rays[*k]).collect();
        pose = refined(&pose, &used, &sigmas).unwrap_or(pose);
        inliers = agreeing(&essential(&pose));
    }
    inliers.retain(|k| in_front(&pose, &rays[*k]));
    if inliers.len() < 6 {
        return Err(open);
    }
    let mut angles: Vec<f64> =
        inliers.iter().map(|k| angle(&(pose.rotation() * rays[*k].0), &rays[*k].1)).collect();
    angles.sort_by(f64::total_cmp);
    Ok(RelativePose { second_from_first: pose, parallax: angles[angles.len() / 2], inliers, samples })
}

/// `[t]ₓ R`.
fn essential(pose: &Pose) -> Matrix3<f64> {
    pose.translation().cross_matrix() * pose.rotation_matrix()
}

/// Five different indices.
fn draw(generator: &mut ChaCha8Rng, count: usize) -> [usize; 5] {
    let mut sample = [usize::MAX; 5];
    for k in 0..5 {
        loop {
            // The high half of the product: off from uniform by less than count/2⁶⁴.
            let index =
                usize::try_from((u128::from(generator.next_u64()) * count as u128) >> 64).unwrap_or(0);
            if !sample[..k].contains(&index) {
                sample[k] = index;
                break;
            }
        }
    }
    sample
}

/// Sampson's distance `bᵀ E a / √(|σ E a|² + |σ Eᵀ b|²)`, signed, in sigma.
fn sampson(matrix: &Matrix3<f64>, (a, b): &(Vector3<f64>, Vector3<f64>), sigmas: &[Vector3<f64>; 2]) -> f64 {
    let (in_second, in_first) = (matrix * a, matrix.tr_mul(b));
    let variance = in_first.component_mul(&sigmas[0]).norm_squared()
        + in_second.component_mul(&sigmas[1]).norm_squared();
    if variance > 0.0 { b.dot(&in_second) / variance.sqrt() } else { f64::INFINITY }
}

/// Whether a pair of rays meets in front of both cameras.
fn in_front(second_from_first: &Pose, (a, b): &(Vector3<f64>, Vector3<f64>)) -> bool {
    // s R a + t = u b in the least squares of s and u.
    let turned = second_from_first.rotation() * a;
    let t = second_from_first.translation();
    let (aa, ab, bb) = (turned.norm_squared(), turned.dot(b), b.norm_squared());
    let determinant = aa * bb - ab * ab;
    let s = (ab * b.dot(&t) - bb * turned.dot(&t)) / determinant;
    let u = (aa * b.dot(&t) - ab * turned.dot(&t)) / determinant;
    s > 0.0 && u > 0.0
}

/// The pose of an essential matrix with the most pairs in front of both cameras.
fn decomposed<'a>(
    matrix: &Matrix3<f64>,
    pairs: impl Iterator<Item = &'a (Vector3<f64>, Vector3<f64>)> + Clone,
) -> Option<Pose> {
    let svd = matrix.try_svd(true, true, f64::EPSILON, 500)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let least = svd.singular_values.imin();
    let axis = u.column(least).into_owned();
    // With u₁, u₂, u₃ and v₁, v₂, v₃ right-handed, R maps v₁ to ±u₂, v₂ to ∓u₁ and v₃ to u₃.
    let (k, l) = ((least + 1) % 3, (least + 2) % 3);
    let columns = |m: &Matrix3<f64>| [m.column(k).into_owned(), m.column(l).into_owned()];
    let ([u1, u2], [v1, v2]) = (columns(&u), columns(&v_t.transpose()));
    let (u3, v3) = (u1.cross(&u2), v1.cross(&v2));
    let mut best: Option<(usize, Pose)> = None;
    for turn in [-1.0, 1.0] {
        let rotation = u2 * turn * v1.transpose() - u1 * turn * v2.transpose() + u3 * v3.transpose();
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        for sign in [-1.0, 1.0] {
            let pose = Pose::new(rotation, axis * sign);
            let count = pairs.clone().filter(|pair| in_front(&pose, pair)).count();
            if best.is_none_or(|(most, _)| count > most) {
                best = Some((count, pose));
            }
        }
    }
    best.map(|(_, pose)| pose)
}

/// The pose with the least squared Sampson distances, its translation kept at length one.
fn refined(start: &Pose, pairs: &[(Vector3<f64>, Vector3<f64>)], sigmas: &[Vector3<f64>; 2]) -> Option<Pose> {
    let moved = |pose: &Pose, step: &SVector<f64, 5>| {
        let direction = pose.translation().normalize();
        let first = perpendicular(direction);
        let shift = first * step[3] + direction.cross(&first) * step[4];
        let turned = Pose::exp(&Vector6::new(step[0], step[1], step[2], 0.0, 0.0, 0.0));
        Pose::new(turned.rotation() * pose.rotation(), (direction + shift).normalize())
    };
    let normal = |pose: &Pose| {
        let matrix = essential(pose);
        let near = [0, 1, 2, 3, 4].map(|k| {
            let step = SVector::<f64, 5>::ith(k, STEP);
            [essential(&moved(pose, &step)), essential(&moved(pose, &-step))]
        });
        let mut normal = Normal::<5>::new();
        for pair in pairs {
            let derivative = SVector::<f64, 5>::from_fn(|k, _| {
                (sampson(&near[k][0], pair, sigmas) - sampson(&near[k][1], pair, sigmas)) / (2.0 * STEP)
            });
            normal.add(sampson(&matrix, pair, sigmas), &derivative);
        }
        Some(normal)
    };
    minimise(*start, normal, moved).map(|(pose, _)| pose)
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{camera, circle, visible_point};
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn error(found: &Pose, truth: &Pose) -> f64 {
        let direction = truth.translation().normalize();
        (found.rotation().inverse() * truth.rotation()).vector().norm()
            + (found.translation() - direction).norm()
    }

    proptest! {
        #[test]
        fn exact_pixels_give_back_the_pose(
            cameras in (camera(), camera()), poses in (circle(), circle()),
            points in prop::collection::vec(visible_point(), 12..30), flat in any::<bool>(),
        ) {
            let truth = poses.1 * poses.0.inverse();
            prop_assume!(truth.translation().norm() > 0.5);
            let spread: Matrix3<f64> = points.iter().map(|p| p.coords * p.coords.transpose()).sum();
            prop_assume!(spread.symmetric_eigenvalues().min() > 0.1 * points.len() as f64);
            let points: Vec<_> = points.iter().map(|p| Point3::new(p.x, p.y, if flat { 0.3 * p.x } else { p.z })).collect();
            // A plane that is seen edge-on is a line.
            let normal = Vector3::new(-0.3, 0.0, 1.0).normalize();
            prop_assume!(!flat || [poses.0, poses.1].iter().all(|p| p.inverse().translation().dot(&normal).abs() > 1.0));
            let pairs: Vec<_> = points
                .iter()
                .map(|p| (cameras.0.project(poses.0 * *p).unwrap(), cameras.1.project(poses.1 * *p).unwrap()))
                .collect();
            let found = relative_pose([&cameras.0, &cameras.1], &pairs, 1.0, &RansacOptions::default()).unwrap();
            // A plane has a second pose in which its points are in front of both cameras.
            if flat {
                prop_assert!(found.inliers.len() >= 6);
            } else {
                prop_assert_eq!(found.inliers.len(), points.len());
                prop_assert!(error(&found.second_from_first, &truth) < 1e-6, "{:e}", error(&found.second_from_first, &truth));
            }
        }
    }

    #[test]
    fn noise_and_a_third_of_wrong_pairs_are_survived() {
        let camera = PinholeCamera::new(500.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
        let mut generator = ChaCha8Rng::seed_from_u64(3);
        let mut uniform = || (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        for run in 0..10 {
            let truth = Pose::exp(&Vector6::new(
                0.1 * uniform(),
                0.2 * uniform(),
                0.1 * uniform(),
                0.4,
                0.2 * uniform(),
                0.3 * uniform(),
            ));
            let mut pairs = Vec::new();
            for k in 0..90 {
                let point = Point3::new(3.0 * uniform(), 2.0 * uniform(), 4.0 + 2.0 * uniform());
                let noise = nalgebra::Vector2::new(uniform(), uniform());
                let (a, b) = (camera.project(point).unwrap(), camera.project(truth * point).unwrap() + noise);
                let wrong = Point2::new(320.0 + 600.0 * uniform(), 240.0 + 400.0 * uniform());
                pairs.push((a, if k % 3 == 0 { wrong } else { b }));
            }
            let options = RansacOptions { seed: run, ..RansacOptions::default() };
            let found = relative_pose([&camera, &camera], &pairs, 0.5, &options).unwrap();
            // 0.4 px of 500 over 60 points at 5°, in a narrow field of view: a few degrees of direction.
            assert!(
                error(&found.second_from_first, &truth) < 0.1,
                "{}",
                error(&found.second_from_first, &truth)
            );
            assert!(found.inliers.len() >= 55 && found.parallax > 0.03);
            assert_eq!(relative_pose([&camera, &camera], &pairs, 0.5, &options).unwrap(), found);
        }
    }

    #[test]
    fn too_few_pairs_and_numbers_that_are_none_are_refused() {
        let camera = PinholeCamera::new(500.0, 500.0, 320.0, 240.0, 640, 480).unwrap();
        let options = RansacOptions { most_samples: 50, ..RansacOptions::default() };
        let at = |x: f64| (Point2::new(x, 1.0), Point2::new(x, 1.0));
        let few = relative_pose([&camera, &camera], &[at(1.0); 5], 1.0, &options);
        assert!(matches!(few, Err(Error::TooFew { expected: 6, found: 5, .. })));
        let mut pairs = [at(1.0); 9];
        pairs[4].1.x = f64::NAN;
        assert!(matches!(
            relative_pose([&camera, &camera], &pairs, 1.0, &options),
            Err(Error::NotFinite { .. })
        ));
        // One point nine times: an answer would be an invention, a hang or a panic a bug.
        let _ = relative_pose([&camera, &camera], &[at(1.0); 9], 1.0, &options);
    }
}
