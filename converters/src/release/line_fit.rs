//! The line that a landmark's own rows determine: unrefined lines, and lines that were never published.

use super::poses::Poses;
use super::residual::{DepthMiss, line_depths, line_distances, line_views, meeting};
use nalgebra::{Point2, Vector3};
use open_structure::geometry::{PinholeCamera, PluckerLine, Segment, triangulate_line};
use open_structure::structure::{LineId, LineMeasurement};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A line fitted to the rows of one landmark through the true poses.
#[derive(Clone, Debug)]
pub(super) struct FittedLine {
    /// The endless line.
    pub(super) line: PluckerLine,
    /// The piece of it that the rows show, metres in `world`.
    pub(super) segment: Segment,
    /// Distances of all ends from its image, enlarged for the four numbers that were fitted, pixels.
    pub(super) distances_px: Vec<f64>,
}

/// Why there is no fitted line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Unfit {
    /// Fewer than two views with a pose and a length, or all of one plane.
    NoParallax,
    /// The line lies elsewhere than its rows' depths say.
    DepthsDisagree,
}

impl Unfit {
    /// In words.
    pub(super) fn reason(self) -> &'static str {
        match self {
            Self::NoParallax => "line cannot be fitted to its rows: fewer than two views or no parallax",
            Self::DepthsDisagree => "line fitted to its rows disagrees with their depths",
        }
    }
}

/// Lines by id, or why there is none.
pub(super) type Fits = BTreeMap<LineId, Result<FittedLine, Unfit>>;

/// Fits a line to the rows of every landmark.
pub(super) fn fit_lines(
    tracks: &BTreeMap<LineId, Vec<&LineMeasurement>>,
    poses: &Poses,
    camera: &PinholeCamera,
) -> Fits {
    let tracks: Vec<_> = tracks.iter().collect();
    tracks
        .par_iter()
        .map(|(id, track)| (**id, fit_line(track, poses, camera)))
        .collect::<Vec<_>>()
        .into_iter()
        .collect()
}

fn fit_line(track: &[&LineMeasurement], poses: &Poses, camera: &PinholeCamera) -> Result<FittedLine, Unfit> {
    let views = line_views(track, poses, camera);
    let found = triangulate_line(&views).ok_or(Unfit::NoParallax)?;
    let line = found.line;
    let depths = line_depths(track, poses, camera, &line);
    if disagree(&depths, track) {
        return Err(Unfit::DepthsDisagree);
    }
    let mut distances_px = line_distances(&views, &line);
    let n = distances_px.len() as f64;
    // Four numbers were fitted; two views are met exactly, and say nothing about noise.
    if n > 4.0 {
        let enlarged = (n / (n - 4.0)).sqrt();
        for distance in &mut distances_px {
            *distance *= enlarged;
        }
    } else {
        distances_px.clear();
    }
    let exact = distances_px.iter().all(|distance| distance.abs() < 0.2);
    let segment = shown_segment(track, poses, camera, &line, exact).ok_or(Unfit::NoParallax)?;
    Ok(FittedLine { line, segment, distances_px })
}

/// Whether half of the depths are farther off than noise can take them.
fn disagree(misses: &[DepthMiss], track: &[&LineMeasurement]) -> bool {
    let mut sizes: Vec<f64> = misses.iter().map(|miss| miss.difference.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let mut depths: Vec<f64> =
        track.iter().flat_map(|row| [row.start_depth, row.end_depth]).flatten().collect();
    depths.sort_by(f64::total_cmp);
    match (sizes.get(sizes.len() / 2), depths.get(depths.len() / 2)) {
        // Three sigmas of the release's depth noise, and what a pixel of noise makes of a far line.
        (Some(difference), Some(depth)) => *difference > 0.15 + 0.1 * depth,
        _ => false,
    }
}

/// The piece of a line between the outermost places where rows end.
///
/// * `exact` — rows are without noise: the piece covers every end. Otherwise the outermost 2 % on either side, which are
///   noise, are cut off.
fn shown_segment(
    track: &[&LineMeasurement],
    poses: &Poses,
    camera: &PinholeCamera,
    line: &PluckerLine,
    exact: bool,
) -> Option<Segment> {
    let origin = line.closest_point_to_origin();
    let mut places: Vec<(f64, f64)> = Vec::new();
    for row in track {
        let Some(pose) = poses.get(&row.frame_id) else { continue };
        let in_camera = line.transformed(&pose.camera_from_world);
        let world_from_camera = pose.camera_from_world.inverse();
        for (u, v) in [(row.start_u, row.start_v), (row.end_u, row.end_v)] {
            if let Some((point, sine)) = meeting(&in_camera, camera, Point2::new(u, v)) {
                let along: Vector3<f64> = world_from_camera * point - origin;
                places.push((along.dot(&line.direction), sine));
            }
        }
    }
    // A ray along the line meets it anywhere; such ends count only where there are no others.
    let clear = places.iter().filter(|(_, sine)| *sine > 0.1).count() >= 2;
    let mut places: Vec<f64> =
        places.into_iter().filter(|(_, sine)| !clear || *sine > 0.1).map(|(place, _)| place).collect();
    places.sort_by(f64::total_cmp);
    let cut = if exact { 0 } else { places.len() / 50 };
    let (first, last) = (places.get(cut)?, places.get(places.len() - 1 - cut)?);
    let segment = Segment { start: origin + line.direction * *first, end: origin + line.direction * *last };
    (segment.length() > 0.0 && segment.length().is_finite()).then_some(segment)
}

/// The segment with the two ends in the order of a direction.
pub(super) fn directed(segment: Segment, direction: &Vector3<f64>) -> Segment {
    if (segment.end - segment.start).dot(direction) < 0.0 {
        Segment { start: segment.end, end: segment.start }
    } else {
        segment
    }
}
