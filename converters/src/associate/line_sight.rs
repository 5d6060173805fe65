//! Which part of a line a frame sees.

use nalgebra::Point3;
use open_structure::geometry::{Pose, Segment};

use super::line_options::{LineOptions, focal_px};
use crate::rgbd::{DepthMap, DepthNoise, Raster, Sight};

/// Pixels around a place in which its depth may be found, for lines lie on edges.
const REACH: i64 = 2;
/// How far within the image a view stays, pixels, so that rounding does not carry it out.
const MARGIN_PX: f64 = 1e-6;
/// Most places along a view.
const MOST: f64 = 20_000.0;

/// The part of a landmark that a frame sees: two parameters along it, 0 at its start and 1 at its end.
///
/// The landmark is cut to what is in front of the camera and within the image, and the depth map is asked at places along its
/// image. The longest piece counts along which it is hidden nowhere for more than a short gap; it begins and ends where the map
/// shows it. The observation is then the exact projection of the landmark at both parameters.
///
/// * `segment` — the landmark, world, metres.
///
/// `None` where the view is too short, or too little of it is shown by the depth map.
#[must_use]
pub fn visible_part(
    raster: &Raster,
    depth: &DepthMap,
    noise: &DepthNoise,
    camera_from_world: &Pose,
    segment: &Segment,
    options: &LineOptions,
) -> Option<[f64; 2]> {
    let [start, end] = [segment.start, segment.end].map(|end| camera_from_world * end);
    let [from, to] = within_image(raster, start, end, options.nearest_m)?;
    let at = |parameter: f64| start + (end - start) * parameter;
    let image = |parameter: f64| raster.camera().project(at(parameter));
    let (near, far) = (at(from).z, at(to).z);
    let length = (image(to)? - image(from)?).norm();
    if length < options.sight_length_px {
        return None;
    }
    let steps = (length / options.sight_step_px.max(0.1)).ceil().clamp(1.0, MOST);
    // Evenly in the image: a place's inverse depth is linear there.
    let parameter = |step: usize| {
        let part = step as f64 / steps;
        from + (to - from) * (part * near / (part * near + (1.0 - part) * far))
    };
    let focal_px = focal_px(raster);
    let seen = |step: usize| {
        let point = at(parameter(step));
        let Some((_, position)) = raster.project(point) else { return false };
        depth.sight(position, point.z, focal_px, noise, REACH) == Sight::Seen
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most MOST")]
    let shown: Vec<usize> = (0..=steps as usize).filter(|step| seen(*step)).collect();
    let step_px = length / steps;
    let (first, last) = longest_run(&shown, options.sight_gap_px / step_px, options.sight_part)?;
    if ((last - first) as f64) * step_px < options.sight_length_px {
        return None;
    }
    // The parameter of the last step is exact, so that a landmark seen whole has 0 and 1.
    let exact = |step: usize| if step as f64 >= steps { to } else { parameter(step) };
    Some([exact(first), exact(last)])
}

/// The longest run of steps between which no gap is too wide and of which enough are there.
fn longest_run(shown: &[usize], gap: f64, part: f64) -> Option<(usize, usize)> {
    let runs = shown.chunk_by(|before, after| (after - before - 1) as f64 <= gap);
    let ends = runs.filter_map(|run| {
        let (first, last) = (*run.first()?, *run.last()?);
        (run.len() as f64 >= part * (last - first + 1) as f64).then_some((first, last))
    });
    // Of equally long runs, the first.
    ends.reduce(|best, run| if run.1 - run.0 > best.1 - best.0 { run } else { best })
}

/// The part of a segment in the camera that lies beyond a depth and within the image, as parameters along it.
fn within_image(raster: &Raster, start: Point3<f64>, end: Point3<f64>, nearest_m: f64) -> Option<[f64; 2]> {
    let camera = raster.camera();
    let [low_u, high_u, low_v, high_v] = raster.bounds();
    // Signed distances from five planes, positive inside; linear along the segment.
    let planes = |p: Point3<f64>| {
        let (u, v) = (camera.fx * p.x + camera.cx * p.z, camera.fy * p.y + camera.cy * p.z);
        [
            p.z - nearest_m.max(1e-6),
            u - (low_u + MARGIN_PX) * p.z,
            (high_u - MARGIN_PX) * p.z - u,
            v - (low_v + MARGIN_PX) * p.z,
            (high_v - MARGIN_PX) * p.z - v,
        ]
    };
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (a, b) in planes(start).into_iter().zip(planes(end)) {
        if !(a >= 0.0 || b >= 0.0) {
            return None;
        }
        if a < 0.0 {
            from = from.max(a / (a - b));
        } else if b < 0.0 {
            to = to.min(a / (a - b));
        }
    }
    (from < to).then_some([from, to])
}
