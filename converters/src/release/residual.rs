//! How far rows lie from where landmarks appear: robust figures of noise.

use super::poses::Poses;
use nalgebra::{Point2, Point3};
use open_structure::geometry::{LineView, PinholeCamera, PluckerLine, line_residual, triangulate_point};
use open_structure::structure::{LineId, LineMeasurement, PointId, PointMeasurement};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A median absolute deviation times this is the sigma of a Gaussian.
const SIGMA_PER_MEDIAN: f64 = 1.482_602_218_505_602;

/// Rows that a figure of point noise is taken from; its statistical error is then one percent.
const SAMPLED_ROWS: usize = 10_000;

/// The spread of some residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Robust sigma: 1.4826 times the median absolute value, in the residuals' unit.
    pub sigma: f64,
    /// Residuals.
    pub count: usize,
}

impl Spread {
    /// The spread of residuals about zero; `None` without any.
    pub(super) fn of(residuals: Vec<f64>) -> Option<Self> {
        let count = residuals.len();
        let mut sizes: Vec<f64> = residuals.into_iter().map(f64::abs).collect();
        sizes.sort_by(f64::total_cmp);
        Some(Self { sigma: SIGMA_PER_MEDIAN * sizes.get(count / 2)?, count })
    }
}

/// Rows by landmark, in the order of frames.
pub(super) fn by_point(rows: &[PointMeasurement]) -> BTreeMap<PointId, Vec<&PointMeasurement>> {
    let mut map: BTreeMap<PointId, Vec<&PointMeasurement>> = BTreeMap::new();
    for row in rows {
        map.entry(row.point_id).or_default().push(row);
    }
    map
}

/// Rows by landmark, in the order of frames.
pub(super) fn by_line(rows: &[LineMeasurement]) -> BTreeMap<LineId, Vec<&LineMeasurement>> {
    let mut map: BTreeMap<LineId, Vec<&LineMeasurement>> = BTreeMap::new();
    for row in rows {
        map.entry(row.line_id).or_default().push(row);
    }
    map
}

/// The noise of point rows by themselves: residuals against the point they triangulate to through the true poses.
///
/// Each residual is enlarged by `√(2n / (2n − 3))`, for the point was fitted to its own n rows. Landmarks are sampled
/// evenly where there are many rows.
pub(super) fn point_noise(
    rows: &[PointMeasurement],
    poses: &Poses,
    camera: &PinholeCamera,
) -> Option<Spread> {
    let tracks: Vec<Vec<&PointMeasurement>> = by_point(rows).into_values().collect();
    let stride = rows.len().div_ceil(SAMPLED_ROWS).max(1);
    let residuals: Vec<Vec<f64>> = tracks
        .par_iter()
        .step_by(stride)
        .map(|track| {
            let views: Vec<_> = track
                .iter()
                .filter_map(|row| {
                    Some((*camera, poses.get(&row.frame_id)?.camera_from_world, Point2::new(row.u, row.v)))
                })
                .collect();
            if views.len() < 3 {
                return Vec::new();
            }
            let Some(found) = triangulate_point(&views) else { return Vec::new() };
            let n = views.len() as f64;
            let enlarged = (2.0 * n / (2.0 * n - 3.0)).sqrt();
            views
                .iter()
                .filter_map(|(_, pose, pixel)| Some(camera.project(pose * found.point)? - pixel))
                .flat_map(|difference| [difference.x * enlarged, difference.y * enlarged])
                .collect()
        })
        .collect();
    Spread::of(residuals.concat())
}

/// The distance of point rows from the images of landmarks through the true poses, u and v apart.
pub(super) fn point_misses(
    rows: &[PointMeasurement],
    poses: &Poses,
    camera: &PinholeCamera,
    landmarks: &BTreeMap<PointId, Point3<f64>>,
) -> Option<Spread> {
    let residuals = rows
        .iter()
        .filter_map(|row| {
            let point = poses.get(&row.frame_id)?.camera_from_world * *landmarks.get(&row.point_id)?;
            Some(camera.project(point).map_or([f64::INFINITY; 2], |found| [found.x - row.u, found.y - row.v]))
        })
        .flatten();
    Spread::of(residuals.collect())
}

/// The views of a line; those of frames without a pose are left out.
pub(super) fn line_views(track: &[&LineMeasurement], poses: &Poses, camera: &PinholeCamera) -> Vec<LineView> {
    track
        .iter()
        .filter_map(|row| {
            let ends = [Point2::new(row.start_u, row.start_v), Point2::new(row.end_u, row.end_v)];
            Some((*camera, poses.get(&row.frame_id)?.camera_from_world, ends))
        })
        .collect()
}

/// Signed distances of all ends from the image of a line, pixels; views without an image, or of length zero, give none.
pub(super) fn line_distances(views: &[LineView], line: &PluckerLine) -> Vec<f64> {
    views
        .iter()
        .filter(|(_, _, [start, end])| start != end)
        .filter_map(|(camera, pose, ends)| line_residual(camera, pose, line, *ends).ok())
        .flat_map(|residual| [residual.x, residual.y])
        .collect()
}

/// A depth of a line's end against the line's own depth at that pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DepthMiss {
    /// The row's depth less the line's, metres.
    pub(super) difference: f64,
    /// How far the line's depth moves when the pixel moves by one along its image, metres.
    pub(super) per_pixel: f64,
}

/// The depths of a line's ends against a line; ends that look along it (at under 0.1 rad) say nothing and are left out.
pub(super) fn line_depths(
    track: &[&LineMeasurement],
    poses: &Poses,
    camera: &PinholeCamera,
    line: &PluckerLine,
) -> Vec<DepthMiss> {
    let mut misses = Vec::new();
    for row in track {
        let Some(pose) = poses.get(&row.frame_id) else { continue };
        let in_camera = line.transformed(&pose.camera_from_world);
        for (u, v, depth) in
            [(row.start_u, row.start_v, row.start_depth), (row.end_u, row.end_v, row.end_depth)]
        {
            let Some(depth) = depth else { continue };
            if let Some((point, sine)) = meeting(&in_camera, camera, Point2::new(u, v))
                && sine > 0.1
            {
                let per_pixel = point.z / camera.fx.abs() * (1.0 - sine * sine).max(0.0).sqrt() / sine;
                misses.push(DepthMiss { difference: depth - point.z, per_pixel });
            }
        }
    }
    misses
}

/// Where the ray of a pixel meets a line (both in the camera), and the sine of the angle between them.
pub(super) fn meeting(
    line_in_camera: &PluckerLine,
    camera: &PinholeCamera,
    pixel: Point2<f64>,
) -> Option<(Point3<f64>, f64)> {
    let direction = camera.ray(pixel);
    let ray = PluckerLine { moment: nalgebra::Vector3::zeros(), direction };
    let point = line_in_camera.closest_point_to_line(&ray)?;
    (point.z > 0.0).then(|| (point, line_in_camera.direction.cross(&direction).norm()))
}
