//! The relative pose of two frames from what both of them measured.

use nalgebra::{Matrix3, Matrix4, Matrix6, Point2, Point3, Vector3};

use crate::geometry::{
    LineMatch, MeasuredDepth, PinholeCamera, PointMatch, Pose, RansacOptions, RobustLoss, Segment,
    ransac_pose, refine_pose,
};
use crate::structure::{DepthNoise, LineMeasurement, MeasuredFrame, MeasurementNoise, PointMeasurement};

/// Doubt about a residual begins here, sigma.
const DOUBT_SIGMA: f64 = 3.0;
/// Landmarks that have to agree for a relative pose.
const LEAST_MATCHES: usize = 4;
/// Points of a consensus, at least, for a start to be taken from it.
const LEAST_CONSENSUS: usize = 6;

/// A relative pose and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    /// `frame_from_other`, metres.
    pub frame_from_other: Pose,
    /// Information over the tangent `[rotation; translation]`, applied on the left of `frame_from_other`; 1/rad², 1/m².
    pub information: Matrix6<f64>,
    /// Landmarks that both frames measured and that were used.
    pub matches: usize,
}

/// The relative pose of two frames from the points and lines that both measured: depth of `other`, pixels (and depth) of `frame`.
///
/// A landmark is where `other` measured it, with the covariance of that; `frame` measured its image. Landmarks to
/// which `other` gives no depth are not used.
///
/// * `start` — `frame_from_other` to begin with; `None` seeks a consensus first, with `seed`.
///
/// `None` where too few landmarks are shared, or leave the pose open.
#[must_use]
pub fn relative_pose(
    (frame, camera): (&MeasuredFrame, &PinholeCamera),
    (other, other_camera): (&MeasuredFrame, &PinholeCamera),
    noise: &MeasurementNoise,
    start: Option<&Pose>,
    seed: u64,
) -> Option<RelativePose> {
    let mut points = Vec::new();
    for (seen, row) in pairs(&other.points, &frame.points, |row: &PointMeasurement| row.point_id) {
        if let Some((point, covariance)) = place(other_camera, [seen.u, seen.v], seen.depth, noise) {
            let (pixel, depth) = (Point2::new(row.u, row.v), measured(row.depth, noise));
            points.push(PointMatch { point, covariance, pixel, depth });
        }
    }
    let mut lines = Vec::new();
    for (seen, row) in pairs(&other.lines, &frame.lines, |row: &LineMeasurement| row.line_id) {
        let start = place(other_camera, [seen.start_u, seen.start_v], seen.start_depth, noise);
        let end = place(other_camera, [seen.end_u, seen.end_v], seen.end_depth, noise);
        let Some(((start, of_start), (end, of_end))) = start.zip(end) else { continue };
        let segment = Segment { start, end };
        let Some(across) = LineMatch::across(&segment) else { continue };
        let mut covariance = Matrix4::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&(across.transpose() * of_start * across));
        covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&(across.transpose() * of_end * across));
        let ends_px = [Point2::new(row.start_u, row.start_v), Point2::new(row.end_u, row.end_v)];
        let depths = [measured(row.start_depth, noise), measured(row.end_depth, noise)];
        lines.push(LineMatch { segment, covariance, ends_px, depths });
    }
    if points.len() + lines.len() < LEAST_MATCHES {
        return None;
    }
    let start = if let Some(start) = start {
        *start
    } else {
        let rows: Vec<_> = points
            .iter()
            .map(|point| {
                // How far the place moves in the image of a camera beside the first one.
                let spread = point.covariance.trace().sqrt() * camera.fx.abs() / point.point.z.abs();
                (point.point, point.pixel, (noise.sigma_px * noise.sigma_px + spread * spread).sqrt())
            })
            .collect();
        let options = RansacOptions { seed, ..RansacOptions::default() };
        let found = ransac_pose(camera, &rows, &options).ok()?;
        if found.inliers.len() < LEAST_CONSENSUS {
            return None;
        }
        found.camera_from_world
    };
    let loss = RobustLoss::Cauchy { sigma: DOUBT_SIGMA };
    let found = refine_pose(camera, noise.sigma_px, &start, &points, &lines, loss).ok()?;
    (found.matches >= LEAST_MATCHES && found.information.iter().all(|number| number.is_finite())).then_some(
        RelativePose {
            frame_from_other: found.camera_from_world,
            information: found.information,
            matches: found.matches,
        },
    )
}

/// Rows of two frames with the same id; both are sorted by it.
fn pairs<'a, T, I: Ord>(a: &'a [T], b: &'a [T], id: impl Fn(&T) -> I) -> Vec<(&'a T, &'a T)> {
    let mut found = Vec::new();
    let mut rest = b.iter().peekable();
    for row in a {
        while rest.next_if(|other| id(other) < id(row)).is_some() {}
        if let Some(other) = rest.peek().filter(|other| id(other) == id(row)) {
            found.push((row, *other));
        }
    }
    found
}

/// A measured depth as the geometry takes it.
fn measured(depth: Option<f64>, noise: &MeasurementNoise) -> Option<MeasuredDepth> {
    let (depth_m, sigma_m) = noise.depth(depth?)?;
    Some(match noise.depth {
        DepthNoise::Inverse { sigma_per_m } => MeasuredDepth::Inverse { depth_m, sigma_per_m },
        _ => MeasuredDepth::Direct { depth_m, sigma_m },
    })
}

/// Where a camera measured a point, in its space, and the covariance of that, m².
fn place(
    camera: &PinholeCamera,
    [u, v]: [f64; 2],
    depth: Option<f64>,
    noise: &MeasurementNoise,
) -> Option<(Point3<f64>, Matrix3<f64>)> {
    let (depth, sigma_m) = noise.depth(depth?)?;
    let point = camera.back_project(Point2::new(u, v), depth);
    if !point.coords.iter().all(|number| number.is_finite()) {
        return None;
    }
    // Columns: by u, by v, by depth, each times its sigma.
    let by = Matrix3::from_columns(&[
        Vector3::new(depth / camera.fx * noise.sigma_px, 0.0, 0.0),
        Vector3::new(0.0, depth / camera.fy * noise.sigma_px, 0.0),
        point.coords / depth * sigma_m,
    ]);
    Some((point, by * by.transpose()))
}
