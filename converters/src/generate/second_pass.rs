//! Which landmarks a frame sees.

use nalgebra::Point3;
use open_structure::geometry::Segment;

use super::{Error, Options};
use crate::associate::visible_part;
use crate::rgbd::{Raster, RawFrame, RawSequence, Sight};

/// A line that a frame sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeenLine {
    /// Place of the landmark.
    pub(super) line: u32,
    /// The part that is seen: two parameters along the landmark, from 0 to 1.
    pub(super) part: [f64; 2],
}

/// What a frame sees of the landmarks, and what it should see but shows farther away.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    pub(super) points: Vec<u32>,
    pub(super) lines: Vec<SeenLine>,
    pub(super) absent_points: Vec<u32>,
}

/// What a frame is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landmarks<'a> {
    pub(super) points: &'a [Point3<f64>],
    pub(super) lines: &'a [Segment],
}

/// Holds every landmark against the depth map of a frame.
///
/// # Source
/// Open-Structure (Li et al. 2024), section III-A: all observations of each landmark. The test against the depth map is ours.
pub(super) fn find(
    raw: &RawSequence,
    raster: &Raster,
    options: &Options,
    frame: &RawFrame,
    landmarks: Landmarks<'_>,
) -> Result<Seen, Error> {
    let map = raw.depth(frame)?;
    let Landmarks { points, lines } = landmarks;
    let depths_m = raw.camera.depth_min.unwrap_or(0.0)..=raw.camera.depth_max.unwrap_or(f64::INFINITY);
    let camera_from_world = frame.world_from_camera.inverse();
    let focal_px = raster.camera().fx.abs();
    // Where a true pose is off, so is every landmark that it shows.
    let noise = raw.depth_noise.with_constant(raw.pose_sigma_m);
    let mut seen = Seen::default();
    for (place, point) in (0..).zip(points) {
        let in_camera = camera_from_world * *point;
        if !depths_m.contains(&in_camera.z) {
            continue;
        }
        let Some((_, position)) = raster.project(in_camera) else { continue };
        match map.sight(position, in_camera.z, focal_px, &noise, 1) {
            Sight::Seen => seen.points.push(place),
            Sight::Absent => seen.absent_points.push(place),
            Sight::Hidden | Sight::Unknown => (),
        }
    }
    for (place, line) in (0..).zip(lines) {
        let part = visible_part(raster, &map, &noise, &camera_from_world, line, &options.lines);
        seen.lines.extend(part.map(|part| SeenLine { line: place, part }));
    }
    Ok(seen)
}
