//! Measurements as geometry takes them.

use nalgebra::Point2;

use crate::geometry::MeasuredDepth;
use crate::structure::{
    DepthNoise, LineId, LineMeasurement, MeasuredFrame, MeasurementNoise, PointId, PointMeasurement,
};

/// A measured point.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointSighting {
    pub(super) id: PointId,
    pub(super) pixel: Point2<f64>,
    pub(super) depth: Option<MeasuredDepth>,
}

/// A measured segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineSighting {
    pub(super) id: LineId,
    pub(super) ends_px: [Point2<f64>; 2],
    pub(super) depths: [Option<MeasuredDepth>; 2],
}

/// No image is this wide, pixels, and no scene this deep, metres: such numbers are no measurements, and their squares overflow.
const LARGEST: f64 = 1e6;

/// A measured depth with its noise; `None` where it is absent, not used, or no depth.
fn depth(noise: &MeasurementNoise, measured: Option<f64>) -> Option<MeasuredDepth> {
    let (depth_m, sigma_m) = noise.depth(measured?)?;
    if depth_m > LARGEST {
        return None;
    }
    match noise.depth {
        DepthNoise::Inverse { sigma_per_m } => Some(MeasuredDepth::Inverse { depth_m, sigma_per_m }),
        _ => Some(MeasuredDepth::Direct { depth_m, sigma_m }),
    }
}

fn pixel(u: f64, v: f64) -> Option<Point2<f64>> {
    (u.abs() < LARGEST && v.abs() < LARGEST).then(|| Point2::new(u, v))
}

fn point_sighting(noise: &MeasurementNoise, row: &PointMeasurement) -> Option<PointSighting> {
    Some(PointSighting { id: row.point_id, pixel: pixel(row.u, row.v)?, depth: depth(noise, row.depth) })
}

fn line_sighting(noise: &MeasurementNoise, row: &LineMeasurement) -> Option<LineSighting> {
    let ends_px = [pixel(row.start_u, row.start_v)?, pixel(row.end_u, row.end_v)?];
    let depths = [row.start_depth, row.end_depth].map(|measured| depth(noise, measured));
    // Shorter than its noise, a segment has no direction.
    let length = (ends_px[1] - ends_px[0]).norm();
    (length > 3.0 * noise.sigma_px).then_some(LineSighting { id: row.line_id, ends_px, depths })
}

/// All usable measurements of a frame, each landmark once (its first), by ascending id.
pub(super) fn sightings(
    frame: &MeasuredFrame,
    noise: &MeasurementNoise,
) -> (Vec<PointSighting>, Vec<LineSighting>) {
    let mut points: Vec<_> = frame.points.iter().filter_map(|row| point_sighting(noise, row)).collect();
    let mut lines: Vec<_> = frame.lines.iter().filter_map(|row| line_sighting(noise, row)).collect();
    points.sort_by_key(|sighting| sighting.id);
    lines.sort_by_key(|sighting| sighting.id);
    points.dedup_by_key(|sighting| sighting.id);
    lines.dedup_by_key(|sighting| sighting.id);
    (points, lines)
}
