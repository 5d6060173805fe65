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

#[cfg(test)]
mod tests {
    use super::super::scene::Draw;
    use super::super::tests::{DIFFERENCES, jacobian_error};
    use super::*;
    use crate::geometry::Pose;
    use nalgebra::{Point3, Vector6};
    use proptest::prelude::*;

    /// The image of a point by the formulas of BAL's page.
    fn project(camera: &[f64; 9], point: &[f64; 3]) -> [f64; 2] {
        let [a, b, c, x, y, z, focal, k1, k2] = *camera;
        let turn = Pose::exp(&Vector6::new(a, b, c, 0.0, 0.0, 0.0)).rotation();
        let seen = Pose::new(turn, [x, y, z].into()) * Point3::from(*point);
        let p = [-seen.x / seen.z, -seen.y / seen.z];
        let squared = p[0] * p[0] + p[1] * p[1];
        p.map(|part| focal * (1.0 + k1 * squared + k2 * squared * squared) * part)
    }

    /// Cameras around points, each of which all cameras see without noise.
    fn exact() -> BalBundle {
        let mut draw = Draw::new(3);
        let points: Vec<[f64; 3]> = (0..40).map(|_| draw.vector(1.0).into()).collect();
        let cameras: Vec<[f64; 9]> = (0..5)
            .map(|at| {
                let (turn, shift) = (draw.vector(0.2), draw.vector(0.3));
                let away = 0.4 * f64::from(at);
                [
                    turn.x,
                    away + turn.y,
                    turn.z,
                    shift.x,
                    shift.y,
                    shift.z - 4.0,
                    500.0 + 9.0 * away,
                    -0.02,
                    0.003,
                ]
            })
            .collect();
        let views = (0..cameras.len()).flat_map(|camera| (0..points.len()).map(move |point| (camera, point)));
        let views = views
            .map(|(camera, point)| BalView {
                camera,
                point,
                pixel: project(&cameras[camera], &points[point]),
            })
            .collect();
        BalBundle { cameras, points, views }
    }

    fn adjusted(bundle: &BalBundle) -> Result<BalAdjusted, Error> {
        adjust_bal(bundle, Loss::None, &SolverOptions::default(), &mut |_| true)
    }

    proptest! {
        #[test]
        fn residuals_are_those_of_the_page_and_jacobians_their_derivatives(
            turn in prop::array::uniform3(-1.0..1.0_f64), [x, y, z] in prop::array::uniform3(-1.0..1.0_f64),
            point in prop::array::uniform3(-1.0..1.0_f64), [k1, k2] in prop::array::uniform2(-0.3..0.3_f64),
            pixel in prop::array::uniform2(-300.0..300.0_f64),
        ) {
            let camera = [turn[0], turn[1], turn[2], x, y, z - 5.0, 600.0, k1, k2];
            let bundle = BalBundle {
                cameras: vec![camera],
                points: vec![point],
                views: vec![BalView { camera: 0, point: 0, pixel }],
            };
            let problem = Posed::of(&bundle, Loss::None, &mut Summary::default()).unwrap().problem;
            let seen = project(&camera, &point);
            let expected = 0.5 * ((seen[0] - pixel[0]).powi(2) + (seen[1] - pixel[1]).powi(2));
            prop_assert!((problem.cost() - expected).abs() < 1e-9 * (1.0 + expected), "{} {expected}", problem.cost());
            prop_assert!(jacobian_error(&problem) < DIFFERENCES);
        }
    }

    #[test]
    fn cameras_with_their_lenses_are_recovered_from_exact_pixels() {
        let truth = exact();
        let mut draw = Draw::new(7);
        let mut start = truth.clone();
        for camera in &mut start.cameras {
            camera.iter_mut().take(6).for_each(|number| *number += 0.02 * draw.uniform());
            camera[6] *= 1.0 + 0.05 * draw.uniform();
            (camera[7], camera[8]) = (0.0, 0.0);
        }
        start.points.iter_mut().flatten().for_each(|number| *number += 0.02 * draw.uniform());
        let found = adjusted(&start).unwrap();
        assert!(found.summary.initial_cost > 1e3 && found.summary.final_cost < 1e-12, "{:?}", found.summary);
        // Gauge apart, intrinsics are what they were.
        for (camera, truth) in found.cameras.iter().zip(&truth.cameras) {
            assert!((camera[6] - truth[6]).abs() < 1e-4 * truth[6], "{camera:?} {truth:?}");
            assert!(
                (camera[7] - truth[7]).abs() + (camera[8] - truth[8]).abs() < 1e-4,
                "{camera:?} {truth:?}"
            );
        }
        let summary = &found.summary;
        assert_eq!((summary.poses.used, summary.points.used, summary.point_factors.used), (5, 40, 200));
        assert_eq!((summary.residuals, summary.unknowns, summary.components), (400, 165, 1));
        assert_eq!(found.steps.len(), summary.iterations + 1);
    }

    #[test]
    fn what_nobody_sees_stays_where_it_is_to_the_last_bit() {
        let mut bundle = exact();
        let (camera, point) = ([0.1, 0.2, 3.0, 1.0, 2.0, 3.0, 400.0, 0.5, 0.25], [7.0, 8.0, 9.0]);
        bundle.cameras.push(camera);
        bundle.points.push(point);
        bundle.points[0][0] += 0.01;
        let found = adjusted(&bundle).unwrap();
        assert_eq!((found.cameras[5], found.points[40]), (camera, point));
        assert_eq!(found.summary.unconstrained, [FrameId(5)]);
        assert_eq!(found.summary.points.excluded.get(&Reason::TooFewViews), Some(&1));
        assert_eq!(found.summary.components, 1);
    }

    #[test]
    fn bundles_that_are_none_are_refused() {
        let mut bundle = exact();
        bundle.views[3].point = 40;
        let expected = "a camera and a point of the bundle";
        assert_eq!(adjusted(&bundle).unwrap_err(), Error::Factor { factor: 3, expected });
        bundle.views.clear();
        assert!(matches!(adjusted(&bundle).unwrap_err(), Error::Nothing { .. }));
        let mut bundle = exact();
        bundle.points[2] = [f64::NAN; 3];
        assert!(matches!(adjusted(&bundle).unwrap_err(), Error::Start { .. }));
    }
}
