//! The map of an estimate refined over its poses, which are held.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Point2, Point3};
use open_structure::adjust::{Error, Loss, Problem, SolverOptions, minimise};
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::structure::{Camera, Estimate, FrameId, MeasuredFrame};

use crate::bearing::BearingSpace;
use crate::seen::Seen;

/// Frames that have to see a point for it to be refined.
const LEAST_VIEWS: usize = 3;

/// Moves every point of a map to where its pixels agree best; gives the costs before and after.
///
/// * `estimate` — its points are moved; poses are `world_from_camera`, metres.
/// * `sigma_px` — standard deviation of pixels.
///
/// # Errors
/// Those of the solver.
pub fn refine_points(
    frames: &[MeasuredFrame],
    cameras: &[Camera],
    sigma_px: f64,
    estimate: &mut Estimate,
) -> Result<[f64; 2], Error> {
    let poses: BTreeMap<FrameId, Pose> = estimate
        .trajectory
        .iter()
        .filter_map(|row| Some((row.frame_id, row.world_from_camera().pose().ok()?)))
        .collect();
    let mut views: BTreeMap<_, Vec<(Pose, PinholeCamera, Point2<f64>)>> = BTreeMap::new();
    for frame in frames {
        let camera = cameras.iter().find(|camera| camera.camera_id == frame.camera_id);
        if let Some((pose, camera)) = poses.get(&frame.frame_id).zip(camera) {
            for row in &frame.points {
                let view = (*pose, camera.projection(), Point2::new(row.u, row.v));
                views.entry(row.point_id).or_default().push(view);
            }
        }
    }
    let space = Arc::new(BearingSpace);
    let mut problem = Problem::new();
    let (mut factors, mut placed) = (Vec::new(), Vec::new());
    for (index, row) in estimate.points.iter().enumerate() {
        let Some(views) = views.get(&row.point_id).filter(|views| views.len() >= LEAST_VIEWS) else {
            continue;
        };
        let world_from_anchor = views[0].0;
        let place = world_from_anchor.inverse() * Point3::new(row.x, row.y, row.z);
        let distance = place.coords.norm();
        if !(distance > 0.0 && distance.is_finite()) {
            continue;
        }
        let direction = place.coords / distance;
        let point = problem.add(&space, &[direction.x, direction.y, direction.z, distance.ln()]);
        placed.push((index, point, world_from_anchor));
        factors.extend(views.iter().map(|(world_from_camera, camera, pixel)| Seen {
            point,
            camera_from_anchor: world_from_camera.inverse() * world_from_anchor,
            camera: *camera,
            pixel: *pixel,
            sigma_px,
        }));
    }
    problem.add_factors(factors, Loss::Cauchy(1.0))?;
    let found = minimise(&mut problem, &SolverOptions::default())?;
    for (index, point, world_from_anchor) in placed {
        let numbers = problem.values().of(point);
        let distance = numbers[3].exp();
        let place = world_from_anchor
            * Point3::new(numbers[0] * distance, numbers[1] * distance, numbers[2] * distance);
        let row = &mut estimate.points[index];
        (row.x, row.y, row.z) = (place.x, place.y, place.z);
    }
    Ok([found.initial_cost, found.final_cost])
}
