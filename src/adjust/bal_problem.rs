//! Bundle adjustment of cameras with intrinsics of their own: problems of Bundle Adjustment in the Large.

use super::bal_camera::BalCameraSpace;
use super::bal_factor::BalFactor;
use super::error::Error;
use super::estimation::residual_rms;
use super::loss::Loss;
use super::minimise::{SolverOptions, Step, minimise_watched};
use super::observations::root;
use super::parametrisation::VectorSpace;
use super::problem::{Problem, Variable};
use super::summary::{Reason, Summary};
use crate::structure::FrameId;
use std::sync::Arc;

/// A point seen in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BalView {
    /// Place of the camera.
    pub camera: usize,
    /// Place of the point.
    pub point: usize,
    /// Pixel, x to the right and y up from the middle of the image.
    pub pixel: [f64; 2],
}

/// Cameras, points and who sees what.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BalBundle {
    /// Cameras: rotation vector (rad), translation, focal length (px), radial coefficients k1 and k2.
    pub cameras: Vec<[f64; 9]>,
    /// Points in the world.
    pub points: Vec<[f64; 3]>,
    /// Observations.
    pub views: Vec<BalView>,
}

/// Cameras and points after an adjustment, and how it went.
#[derive(Clone, Debug, PartialEq)]
pub struct BalAdjusted {
    /// Cameras, in the order of the bundle.
    pub cameras: Vec<[f64; 9]>,
    /// Points, in the order of the bundle.
    pub points: Vec<[f64; 3]>,
    /// Every step that was tried; the first entry is the start.
    pub steps: Vec<Step>,
    /// What was used, what was left out, and how it ended; frames are named by the places of their cameras.
    pub summary: Summary,
}

/// Adjusts cameras with their intrinsics, and points: `min ½ Σ ρ(|r|²)`.
///
/// `r = f (1 + k1 |m|² + k2 |m|⁴) m − u`, `m = −(P.x, P.y)/P.z`, `P = R X + t`, pixels; all nine numbers of every camera are free, and nothing
/// holds the gauge but the damping. Cameras and points that nobody sees stay where they are.
///
/// * `loss` — robust loss, in pixels; the references of the collection have none.
/// * `watch` — is told each step, and ends the adjustment by giving `false`.
///
/// # Errors
/// [`Error::Nothing`] without observations, [`Error::Factor`] for an observation of a camera or point that is not there, and those of
/// [`minimise`](super::minimise()).
///
/// # Source
/// Agarwal et al. 2010, *Bundle Adjustment in the Large*.
pub fn adjust_bal(
    bundle: &BalBundle,
    loss: Loss,
    solver: &SolverOptions,
    watch: &mut dyn FnMut(&Step) -> bool,
) -> Result<BalAdjusted, Error> {
    let mut summary = Summary::default();
    let mut posed = Posed::of(bundle, loss, &mut summary)?;
    let minimum = minimise_watched(&mut posed.problem, solver, watch)?;
    summary.initial_cost = minimum.initial_cost;
    summary.final_cost = minimum.final_cost;
    summary.ending = minimum.ending;
    summary.plan = minimum.plan;
    summary.iterations = minimum.steps.len().saturating_sub(1);
    summary.residual_rms = residual_rms(&posed.problem);
    let values = posed.problem.values();
    let cameras = posed.cameras.iter().zip(&bundle.cameras);
    let cameras = cameras.map(|(variable, before)| {
        if posed.problem.is_held(*variable) {
            *before
        } else {
            BalCameraSpace::camera_of(values.of(*variable))
        }
    });
    let points = posed.points.iter().map(|variable| {
        let numbers = values.of(*variable);
        [numbers[0], numbers[1], numbers[2]]
    });
    Ok(BalAdjusted { cameras: cameras.collect(), points: points.collect(), steps: minimum.steps, summary })
}

/// A bundle as a problem, and which of its variables is what.
struct Posed {
    problem: Problem,
    cameras: Vec<Variable>,
    points: Vec<Variable>,
}

impl Posed {
    fn of(bundle: &BalBundle, loss: Loss, summary: &mut Summary) -> Result<Self, Error> {
        if bundle.views.is_empty() {
            return Err(Error::Nothing { graph: "bal".to_owned(), expected: "observations" });
        }
        let mut problem = Problem::new();
        let (camera_space, point_space) = (Arc::new(BalCameraSpace), Arc::new(VectorSpace(3)));
        let cameras = bundle.cameras.iter();
        let cameras: Vec<Variable> =
            cameras.map(|camera| problem.add(&camera_space, &BalCameraSpace::numbers_of(camera))).collect();
        let points: Vec<Variable> =
            bundle.points.iter().map(|point| problem.add(&point_space, point)).collect();
        let mut factors = Vec::with_capacity(bundle.views.len());
        let mut seen = vec![false; problem.len()];
        for (factor, view) in bundle.views.iter().enumerate() {
            let found = cameras.get(view.camera).zip(points.get(view.point));
            let expected = "a camera and a point of the bundle";
            let (camera, point) = found.ok_or(Error::Factor { factor, expected })?;
            (seen[camera.index()], seen[point.index()]) = (true, true);
            factors.push(BalFactor { variables: [*camera, *point], pixel: view.pixel });
        }
        summary.point_factors.used = factors.len();
        summary.residuals = 2 * factors.len();
        problem.add_factors(factors, loss)?;
        for (place, camera) in cameras.iter().enumerate() {
            if seen[camera.index()] {
                summary.poses.used += 1;
            } else {
                problem.hold(*camera);
                summary.unconstrained.push(FrameId(i64::try_from(place).unwrap_or(i64::MAX)));
            }
        }
        for point in &points {
            if seen[point.index()] {
                summary.points.used += 1;
            } else {
                problem.hold(*point);
                summary.points.exclude(Reason::TooFewViews);
            }
        }
        summary.unknowns = 9 * summary.poses.used + 3 * summary.points.used;
        summary.components = parts(bundle);
        Ok(Self { problem, cameras, points })
    }
}

/// Parts of a bundle that no observation ties to each other.
fn parts(bundle: &BalBundle) -> usize {
    let cameras = bundle.cameras.len();
    let mut parent: Vec<usize> = (0..cameras + bundle.points.len()).collect();
    let mut is_seen = vec![false; parent.len()];
    for view in &bundle.views {
        let (camera, point) = (view.camera, cameras + view.point);
        (is_seen[camera], is_seen[point]) = (true, true);
        let (a, b) = (root(&mut parent, camera), root(&mut parent, point));
        parent[a.max(b)] = a.min(b);
    }
    (0..parent.len()).filter(|at| is_seen[*at] && parent[*at] == *at).count()
}
