use super::super::strategies::{camera, circle, tangent, visible_point, visible_segment};
use super::super::{MeasuredDepth, RansacOptions, Segment, ransac_pose};
use super::*;
use nalgebra::{Point2, Point3, Vector3};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Close to normal: the sum of twelve uniform numbers less six.
fn normal(generator: &mut ChaCha8Rng) -> f64 {
    let uniform = |generator: &mut ChaCha8Rng| (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (0..12).map(|_| uniform(generator)).sum::<f64>() - 6.0
}

fn point_match(camera: &PinholeCamera, pose: &Pose, point: Point3<f64>, with_depth: bool) -> PointMatch {
    let seen = pose * point;
    let depth = MeasuredDepth::Direct { depth_m: seen.z, sigma_m: 0.05 };
    let pixel = camera.project(seen).unwrap();
    PointMatch { point, covariance: Matrix3::zeros(), pixel, depth: with_depth.then_some(depth) }
}

fn line_match(camera: &PinholeCamera, pose: &Pose, segment: Segment, with_depth: bool) -> LineMatch {
    let ends = [segment.start, segment.end].map(|end| pose * end);
    LineMatch {
        segment,
        covariance: Matrix4::zeros(),
        ends_px: ends.map(|end| camera.project(end).unwrap()),
        depths: ends.map(|end| with_depth.then_some(MeasuredDepth::Direct { depth_m: end.z, sigma_m: 0.05 })),
    }
}

fn error(found: &Pose, pose: &Pose) -> f64 {
    (*found * pose.inverse()).log().norm()
}

proptest! {
    #[test]
    fn exact_measurements_give_back_the_pose(
        camera in camera(), pose in circle(), start in tangent(), with_depth in any::<bool>(),
        points in prop::collection::vec(visible_point(), 8..20),
        segments in prop::collection::vec(visible_segment(), 0..6),
    ) {
        let points: Vec<_> = points.into_iter().map(|point| point_match(&camera, &pose, point, with_depth)).collect();
        let lines: Vec<_> = segments.into_iter().map(|segment| line_match(&camera, &pose, segment, with_depth)).collect();
        let found = refine_pose(&camera, 1.0, &(Pose::exp(&(start * 0.02)) * pose), &points, &lines, RobustLoss::Squared);
        // Radians and metres: 1e-13 px of rounding over the derivatives.
        prop_assert!(error(&found.unwrap().camera_from_world, &pose) < 1e-9);
    }

    #[test]
    fn lines_alone_give_the_pose(
        camera in camera(), pose in circle(), start in tangent(),
        segments in prop::collection::vec(visible_segment(), 6..12),
    ) {
        let lines: Vec<_> = segments.into_iter().map(|segment| line_match(&camera, &pose, segment, true)).collect();
        prop_assume!(lines.iter().all(|line| (line.ends_px[0] - line.ends_px[1]).norm() > 10.0));
        let start = Pose::exp(&(start * 0.005)) * pose;
        let found = refine_pose(&camera, 1.0, &start, &[], &lines, RobustLoss::Squared).unwrap();
        prop_assert!(error(&found.camera_from_world, &pose) < 1e-8, "{:e}", error(&found.camera_from_world, &pose));
    }
}

/// `ξᵀ Λ ξ` over many draws of noise has the mean 6 where the information Λ is right.
#[test]
fn errors_of_noisy_poses_are_as_large_as_the_information_says() {
    let camera = PinholeCamera::new(520.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
    let pose = Pose::exp(&Vector6::new(0.1, -0.3, 0.2, 0.3, -0.1, 5.0));
    let mut generator = ChaCha8Rng::seed_from_u64(7);
    let (mut sum, runs) = (0.0, 400);
    for _ in 0..runs {
        let mut place = || Point3::from(Vector3::from_fn(|_, _| 0.7 * normal(&mut generator)));
        let true_points: Vec<_> = (0..25).map(|_| place()).collect();
        let segments: Vec<_> = (0..6).map(|_| Segment { start: place(), end: place() }).collect();
        let mut points: Vec<_> = true_points.iter().map(|p| point_match(&camera, &pose, *p, true)).collect();
        let mut lines: Vec<_> = segments.iter().map(|s| line_match(&camera, &pose, *s, true)).collect();
        let noisy = |depth: &mut Option<MeasuredDepth>, generator: &mut ChaCha8Rng| {
            if let Some(MeasuredDepth::Direct { depth_m, sigma_m }) = depth {
                *depth_m += *sigma_m * normal(generator);
            }
        };
        for (k, point) in points.iter_mut().enumerate() {
            point.pixel += nalgebra::Vector2::from_fn(|_, _| normal(&mut generator));
            noisy(&mut point.depth, &mut generator);
            if k % 2 == 0 {
                // An uncertain landmark: off by what its covariance says.
                let sigma = Vector3::new(0.02, 0.01, 0.05);
                point.covariance = Matrix3::from_diagonal(&sigma.map(|s| s * s));
                point.point += sigma.map(|s| s * normal(&mut generator));
            }
        }
        for (k, line) in lines.iter_mut().enumerate() {
            for end in 0..2 {
                line.ends_px[end] += nalgebra::Vector2::from_fn(|_, _| normal(&mut generator));
                noisy(&mut line.depths[end], &mut generator);
            }
            if k % 2 == 0 {
                line.covariance = Matrix4::from_diagonal_element(0.02 * 0.02);
                let across = LineMatch::across(&line.segment).unwrap();
                let mut shift = || across * nalgebra::Vector2::from_fn(|_, _| 0.02 * normal(&mut generator));
                line.segment =
                    Segment { start: line.segment.start + shift(), end: line.segment.end + shift() };
            }
        }
        let found = refine_pose(&camera, 1.0, &pose, &points, &lines, RobustLoss::Squared).unwrap();
        let tangent = (found.camera_from_world * pose.inverse()).log();
        sum += tangent.dot(&(found.information * tangent));
    }
    let mean = sum / f64::from(runs);
    // Chi-square of six: the mean of 400 has sigma √(12/400) = 0.17.
    assert!((mean - 6.0).abs() < 0.7, "{mean}");
}

#[test]
fn four_of_ten_points_may_be_wrong() {
    let camera = PinholeCamera::new(520.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    for run in 0..20 {
        let pose =
            Pose::exp(&Vector6::from_fn(|k, _| if k == 5 { 5.0 } else { 0.3 * normal(&mut generator) }));
        let mut points = Vec::new();
        for k in 0..60 {
            let point = Point3::from(Vector3::from_fn(|_, _| 0.5 * normal(&mut generator)));
            let mut found = point_match(&camera, &pose, point, false);
            found.pixel += nalgebra::Vector2::from_fn(|_, _| normal(&mut generator));
            if k % 5 < 2 {
                found.pixel = Point2::new(
                    320.0 + 100.0 * normal(&mut generator),
                    240.0 + 80.0 * normal(&mut generator),
                );
            }
            points.push(found);
        }
        let triples: Vec<_> = points.iter().map(|p| (p.point, p.pixel, 1.0)).collect();
        let options = RansacOptions { seed: run, ..RansacOptions::default() };
        let consensus = ransac_pose(&camera, &triples, &options).unwrap();
        assert_eq!(ransac_pose(&camera, &triples, &options).unwrap(), consensus);
        assert!(consensus.samples < 500, "{}", consensus.samples);
        let inliers: Vec<_> = consensus.inliers.iter().map(|index| points[*index]).collect();
        let found =
            refine_pose(&camera, 1.0, &consensus.camera_from_world, &inliers, &[], RobustLoss::Squared)
                .unwrap();
        // 1 px of 500 at 5 m over six points of ten of 60: a centimetre or two, and less than 0.03 rad.
        assert!(error(&found.camera_from_world, &pose) < 0.1, "{}", error(&found.camera_from_world, &pose));
        assert!(inliers.len() >= 32, "{}", inliers.len());
    }
}

#[test]
fn what_leaves_the_pose_open_is_refused() {
    let camera = PinholeCamera::new(520.0, 480.0, 320.0, 240.0, 640, 480).unwrap();
    let pose = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 5.0));
    let at = |x: f64, y: f64, z: f64| point_match(&camera, &pose, Point3::new(x, y, z), false);
    let refine = |points: &[PointMatch]| refine_pose(&camera, 1.0, &pose, points, &[], RobustLoss::Squared);
    assert!(matches!(refine(&[]), Err(Error::TooFew { found: 0, .. })));
    assert!(matches!(refine(&[at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0)]), Err(Error::TooFew { found: 4, .. })));
    // Behind the camera.
    let behind = PointMatch { point: Point3::new(0.0, 0.0, -9.0), ..at(0.0, 0.0, 0.0) };
    assert!(matches!(refine(&[behind; 9]), Err(Error::TooFew { found: 0, .. })));
    // Points on a line may turn about it.
    let line: Vec<_> = (0..9).map(|k| at(f64::from(k) * 0.1, 0.3, 0.1)).collect();
    assert!(matches!(refine(&line), Err(Error::Degenerate { .. })), "{:?}", refine(&line));
    let hostile = PointMatch { pixel: Point2::new(f64::NAN, 0.0), ..at(0.0, 0.0, 0.0) };
    assert!(refine(&[hostile; 9]).is_err());
    assert!(refine_pose(&camera, 0.0, &pose, &[], &[], RobustLoss::Squared).is_err());
}
