//! Laws of the whole room, on a small scene.

use super::estimation::Estimation;
use super::grouping::Grouping;
use super::linearisation::Linearisation;
use super::normal_equations::{NormalEquations, dense_hessian};
use super::observations::Observations;
use super::scene::Scene;
use super::*;
use crate::geometry::Pose;
use crate::structure::{Estimate, FactorGraph, FrameId, GraphFactor, registry};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

pub(super) fn options(method: Method) -> Options {
    Options { method, loss: Loss::None, ..Options::default() }
}

pub(super) fn estimation(graph: &FactorGraph, options: &Options) -> Estimation {
    let mut summary = Summary::default();
    let observations = Observations::of(graph, options, &mut summary).unwrap();
    let grouping = match options.parallelism {
        Parallelism::Ignored => Grouping::none(&observations),
        _ => Grouping::given(graph, &observations, &mut summary),
    };
    Estimation::new(&observations, &grouping, options, &mut summary).unwrap()
}

/// Largest difference between Jacobians and central differences, relative to the largest entry.
pub(super) fn jacobian_error(problem: &Problem) -> f64 {
    let (rows, step) = (problem.layout.residuals, 1e-6);
    let mut linear = Linearisation::new(problem);
    problem.linearise(&problem.numbers, &mut linear);
    let jacobians = linear.jacobians;
    let mut analytic = std::collections::BTreeMap::new();
    for layout in &problem.layout.batches {
        for (factor, variables) in layout.variables.chunks_exact(layout.arity).enumerate() {
            for row in 0..layout.rows {
                let mut at = layout.jacobian_start + (factor * layout.rows + row) * layout.columns;
                for variable in variables {
                    for k in 0..problem.freedom(*variable) {
                        let place = (variable.index(), k, layout.residual_start + factor * layout.rows + row);
                        analytic.insert(place, jacobians[at]);
                        at += 1;
                    }
                }
            }
        }
    }
    let largest = analytic.values().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let mut error = 0.0_f64;
    for index in 0..problem.len() {
        let variable = Variable(index as u32);
        let space = &problem.spaces[problem.space_of[index] as usize];
        for k in 0..problem.freedom(variable) {
            let at = |sign: f64| {
                let mut delta = vec![0.0; space.freedom()];
                delta[k] = sign * step;
                let mut numbers = problem.numbers.clone();
                let range = problem.start[index]..problem.start[index + 1];
                space.plus(&problem.numbers[range.clone()], &delta, &mut numbers[range]);
                let mut linear = Linearisation::new(problem);
                assert!(problem.linearise(&numbers, &mut linear).is_finite());
                linear.residuals
            };
            let (after, before) = (at(1.0), at(-1.0));
            for row in 0..rows {
                let difference = (after[row] - before[row]) / (2.0 * step);
                let expected = analytic.get(&(index, k, row)).copied().unwrap_or_default();
                error = error.max((difference - expected).abs() / largest);
            }
        }
    }
    error
}

/// Central differences with a step of 1e-6 lose six digits to rounding and to curvature.
pub(super) const DIFFERENCES: f64 = 1e-6;

fn small() -> Scene {
    Scene { frames: 4, points: 6, lines: 6, sigma_px: 1.0, sigma_m: 0.05, ..Scene::default() }
}

#[test]
fn jacobians_of_points_and_lines_are_their_derivatives() {
    for method in [Method::PointLine, Method::Structural] {
        for lines in [LineKind::Orthonormal, LineKind::Endpoints, LineKind::PluckerCayley] {
            for parallelism in
                [Parallelism::Ignored, Parallelism::Exact, Parallelism::Soft { sigma_rad: 0.1 }]
            {
                let options = Options { lines, parallelism, ..options(method) };
                let error = jacobian_error(&estimation(&small().graph(), &options).problem);
                assert!(error < DIFFERENCES, "{method:?} {lines:?} {parallelism:?}: {error:e}");
            }
        }
    }
}

#[test]
fn jacobians_of_points_in_other_forms_are_their_derivatives() {
    for method in [Method::Point, Method::Structural] {
        for points in [PointForm::InverseDepth, PointForm::Parallax] {
            let options = Options { points, ..options(method) };
            let error = jacobian_error(&estimation(&small().graph(), &options).problem);
            assert!(error < DIFFERENCES, "{method:?} {points:?}: {error:e}");
        }
    }
}

#[test]
fn every_form_of_points_ends_at_the_same_cost() {
    let graph = Scene { sigma_px: 1.0, off: 0.01, ..Scene::default() }.graph();
    for loss in [Loss::None, Loss::Cauchy(1.0)] {
        let costs = [PointForm::Xyz, PointForm::InverseDepth, PointForm::Parallax].map(|points| {
            let options = Options { points, loss, ..options(Method::PointLine) };
            let summary = adjust(&graph, &options).unwrap().summary;
            assert!(summary.ending.has_converged(), "{points:?}: {summary:?}");
            summary.final_cost
        });
        let (least, most) =
            (costs.iter().copied().fold(f64::INFINITY, f64::min), costs.iter().copied().fold(0.0, f64::max));
        // The solver stops at steps that lower the cost by a part in 1e9.
        assert!(most - least < 1e-6 * least, "{loss:?}: {costs:?}");
    }
}

/// A chain of poses with noise, closed to a ring.
fn ring(frames: usize, sigma: f64, off: f64) -> (FactorGraph, Vec<Pose>) {
    let scene = Scene { frames, off, ..Scene::default() };
    let mut graph = scene.graph();
    let truth = scene.poses();
    graph.factors.clear();
    let mut draw = scene::Draw::new(5);
    for frame in 0..frames {
        for ahead in [1, 3] {
            let other = (frame + ahead) % frames;
            let noise = Vector6::from_fn(|_, _| sigma * draw.normal());
            let measured = Pose::exp(&-noise) * truth[frame].inverse() * truth[other];
            let (t, q) = measured.components();
            let weight = if sigma > 0.0 { 1.0 / (sigma * sigma) } else { 1.0 };
            let information =
                (0..6).flat_map(|row| (row..6).map(move |c| if row == c { weight } else { 0.0 }));
            graph.factors.push(GraphFactor {
                graph: graph.name.clone(),
                factor_id: graph.factors.len() as i64,
                kind: registry::RELATIVE_POSE.to_owned(),
                frame_id: Some(FrameId(10 * frame as i64)),
                other_frame_id: Some(FrameId(10 * other as i64)),
                measurement: t.iter().chain(&q).copied().collect(),
                information: Some(information.collect()),
                ..GraphFactor::default()
            });
        }
    }
    (graph, truth)
}

#[test]
fn jacobians_of_poses_are_their_derivatives() {
    let (graph, _) = ring(6, 0.3, 0.2);
    let prior = PosePrior {
        frame_id: FrameId(20),
        pose: graph.poses[3].world_from_camera(),
        sigma_rotation_rad: 0.2,
        sigma_translation_m: 0.4,
    };
    let options = Options { priors: vec![prior], ..options(Method::PoseGraph) };
    let error = jacobian_error(&estimation(&graph, &options).problem);
    assert!(error < DIFFERENCES, "{error:e}");
}

#[test]
fn the_normal_equations_are_solved_whatever_is_eliminated() {
    let eliminations = [Eliminate::Cheapest, Eliminate::Landmarks, Eliminate::Poses, Eliminate::Nothing];
    let factorisations =
        [Factorisation::Cheapest, Factorisation::Dense, Factorisation::Sparse, Factorisation::Iterative];
    // The last two are large enough that like variables are multiplied together.
    let cases = [
        (Method::Point, 5, 30),
        (Method::PointLine, 12, 5),
        (Method::Structural, 6, 20),
        (Method::Point, 20, 40),
        (Method::Structural, 24, 30),
    ];
    for (method, frames, points) in cases {
        let scene = Scene { frames, points, ..small() };
        let problem = estimation(&scene.graph(), &options(method)).problem;
        for (eliminate, factorisation) in
            eliminations.into_iter().flat_map(|e| factorisations.into_iter().map(move |f| (e, f)))
        {
            let solver = SolverOptions { eliminate, factorisation, ..SolverOptions::default() };
            let mut equations = match NormalEquations::new(&problem, &solver) {
                Ok(equations) => equations,
                // Lines of one group share a direction, so that no kind of landmark is free of the others.
                Err(Error::Elimination { .. }) if method == Method::Structural => continue,
                Err(cause) => panic!("{method:?}: {cause}"),
            };
            let taken = &equations.plan.choices[equations.plan.taken];
            assert!(eliminate == Eliminate::Cheapest || taken.eliminate == eliminate, "{taken:?}");
            assert!(factorisation == Factorisation::Cheapest || taken.factorisation == factorisation);
            equations.linearise(&problem);
            let damping = 1e-3;
            let is_iterative = factorisation == Factorisation::Iterative;
            if is_iterative {
                assert!(equations.prepare_exactly(damping));
            } else {
                assert!(equations.factorise(damping));
            }
            let dense = dense_hessian(&problem, &equations);
            let right: Vec<f64> = (0..equations.unknowns()).map(|k| libm::sin(k as f64)).collect();
            let mut step = vec![0.0; right.len()];
            assert!(equations.solve(&right, &mut step));
            let diagonal = DMatrix::from_diagonal(&DVector::from_column_slice(equations.diagonal()));
            let found = (dense + diagonal * damping) * DVector::from_vec(step.clone());
            let error = (&found - DVector::from_column_slice(&right)).amax();
            // Relative to a right side of about one; the condition is up to 1e6.
            assert!(error < 1e-8, "{method:?}, {eliminate:?}, {factorisation:?}: {error:e}");
            assert!(is_iterative || equations.solve_all(&[right])[0] == step);
        }
    }
}

/// Largest error of the camera centres, metres.
fn worst_centre(estimate: &Estimate, truth: &[Pose]) -> f64 {
    let rows = estimate.trajectory.iter().zip(truth);
    rows.map(|(row, pose)| {
        (row.world_from_camera().pose().unwrap().translation() - pose.translation()).norm()
    })
    .fold(0.0, f64::max)
}

#[test]
fn without_noise_every_method_ends_at_the_truth() {
    let scene = Scene { off: 0.02, ..Scene::default() };
    let graph = scene.graph();
    for optimiser in [Optimiser::LevenbergMarquardt, Optimiser::DogLeg] {
        let mut options = options(Method::Structural);
        options.solver.optimiser = optimiser;
        let adjusted = adjust(&graph, &options).unwrap();
        let error = worst_centre(&adjusted.estimate, &scene.poses());
        assert!(adjusted.summary.final_cost < 1e-15, "{optimiser:?}: {:?}", adjusted.summary);
        // Metres: what is left of a cost that vanishes to rounding.
        assert!(error < 1e-9, "{optimiser:?}: {error:e}");
        assert_eq!(adjusted.summary.grouped, 9);
    }
    for method in [Method::Point, Method::PointLine] {
        let adjusted = adjust(&graph, &options(method)).unwrap();
        // Pixels alone leave the scale open, so that only the residuals vanish.
        assert!(adjusted.summary.residual_rms < 1e-9, "{method:?}: {:?}", adjusted.summary);
    }
    let (graph, truth) = ring(12, 0.0, 0.1);
    let adjusted = adjust(&graph, &options(Method::PoseGraph)).unwrap();
    // The solver stops where no entry of the gradient is above 1e-9; a ring of twelve adds up what is left.
    assert!(worst_centre(&adjusted.estimate, &truth) < 1e-8, "{:?}", adjusted.summary);
}

#[test]
fn every_form_of_lines_ends_at_the_same_cost() {
    let graph = Scene { sigma_px: 1.0, off: 0.01, ..Scene::default() }.graph();
    for loss in [Loss::None, Loss::Cauchy(1.0), Loss::Huber(1.0)] {
        let costs = [LineKind::Orthonormal, LineKind::Endpoints, LineKind::PluckerCayley].map(|lines| {
            let options = Options { lines, loss, ..options(Method::PointLine) };
            let summary = adjust(&graph, &options).unwrap().summary;
            assert!(summary.ending.has_converged(), "{lines:?}: {summary:?}");
            summary.final_cost
        });
        let (least, most) =
            (costs.iter().copied().fold(f64::INFINITY, f64::min), costs.iter().copied().fold(0.0, f64::max));
        // The solver stops at steps that lower the cost by a part in 1e9.
        assert!(most - least < 1e-6 * least, "{loss:?}: {costs:?}");
    }
}

#[test]
fn the_estimate_has_the_same_bits_on_any_number_of_threads() {
    let graph = Scene { sigma_px: 1.0, sigma_m: 0.05, off: 0.01, ..Scene::default() }.graph();
    let options = Options { covariance: true, ..Options::of(Method::Structural) };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| adjust(&graph, &options)).unwrap()
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

#[test]
fn covariances_say_how_large_errors_are() {
    // Mean of the squared errors of all free poses in units of their covariance, 6 degrees of freedom each.
    let (runs, frames) = (30, 5);
    for parallelism in [Parallelism::Ignored, Parallelism::Exact] {
        let mut sum = 0.0;
        for seed in 0..runs {
            let scene = Scene { seed, frames, points: 12, sigma_px: 1.0, sigma_m: 0.05, ..Scene::default() };
            let options = Options { covariance: true, parallelism, ..options(Method::Structural) };
            let estimate = adjust(&scene.graph(), &options).unwrap().estimate;
            for (row, truth) in estimate.trajectory.iter().zip(scene.poses()).skip(1) {
                let error = (row.world_from_camera().pose().unwrap() * truth.inverse()).log();
                let numbers = row.covariance.clone().unwrap();
                let mut covariance = Matrix6::zeros();
                let mut next = numbers.iter();
                for a in 0..6 {
                    for b in a..6 {
                        let number = *next.next().unwrap();
                        covariance[(a, b)] = number;
                        covariance[(b, a)] = number;
                    }
                }
                sum += error.dot(&(covariance.cholesky().unwrap().solve(&error)));
            }
        }
        let mean = sum / (runs as f64 * (frames - 1) as f64);
        // Poses of one run are not independent: at least 30 · 6 degrees of freedom, so that the mean of 6 has a
        // standard deviation of at most 6 √(2/180) = 0.63; three of them.
        assert!((mean - 6.0).abs() < 1.9, "{parallelism:?}: {mean}");
    }
}

#[test]
fn the_bound_is_what_estimates_reach() {
    let (runs, mut squared) = (30, 0.0);
    let scene = Scene { frames: 6, points: 15, sigma_px: 1.0, sigma_m: 0.05, ..Scene::default() };
    let options = options(Method::Structural);
    for seed in 0..runs {
        // The same room; only the noise differs.
        let mut graph = scene.graph();
        let mut noise = scene::Draw::new(seed + 77);
        let clean = Scene { sigma_px: 0.0, sigma_m: 0.0, ..scene }.graph();
        for (factor, clean) in graph.factors.iter_mut().zip(&clean.factors) {
            for (k, (number, clean)) in factor.measurement.iter_mut().zip(&clean.measurement).enumerate() {
                *number = clean + if k % 3 == 2 { 0.05 } else { 1.0 } * noise.normal();
            }
        }
        let estimate = adjust(&graph, &options).unwrap().estimate;
        let centres = |poses: Vec<Pose>| poses.iter().map(Pose::translation).collect::<Vec<_>>();
        let found =
            centres(estimate.trajectory.iter().map(|row| row.world_from_camera().pose().unwrap()).collect());
        squared += found.iter().zip(centres(scene.poses())).map(|(a, b)| (a - b).norm_squared()).sum::<f64>();
    }
    let rms = (squared / (runs as f64 * 6.0)).sqrt();
    let expected = bound(&scene.graph(), &options, Alignment::None).unwrap();
    // 30 runs with some 15 degrees of freedom each: 5 % of standard deviation.
    let ratio = rms / expected.translation_rms_m;
    assert!((0.85..1.15).contains(&ratio), "{rms} m, expected {expected:?}");
    // Alignment only takes away.
    let aligned = [Alignment::None, Alignment::Se3, Alignment::Sim3]
        .map(|alignment| bound(&scene.graph(), &options, alignment).unwrap());
    assert!(aligned[0].translation_rms_m >= aligned[1].translation_rms_m);
    assert!(aligned[1].translation_rms_m >= aligned[2].translation_rms_m);
    assert!(aligned[2].translation_rms_m > 0.0 && aligned[2].rotation_rms_rad > 0.0);
}

#[test]
fn a_line_off_its_group_is_released_and_the_others_stay() {
    let scene = Scene { sigma_px: 1.0, sigma_m: 0.05, frames: 12, lines: 12, ..Scene::default() };
    let mut graph = scene.graph();
    // Lines 0, 3, 6, 9 are parallel; 1 is at a right angle to them, and 4 of another group too.
    graph.groups[0].line_ids.push(crate::structure::LineId(1));
    graph.groups[1].line_ids.retain(|line| line.0 != 1);
    let summary = adjust(&graph, &options(Method::Structural)).unwrap().summary;
    assert_eq!(summary.released.iter().map(|line| line.line_id.0).collect::<Vec<_>>(), [1]);
    assert_eq!(summary.grouped, 11);
}

#[test]
fn pixels_alone_end_at_the_scale_at_which_they_began() {
    let scene = Scene { off: 0.03, sigma_px: 0.5, ..Scene::default() };
    let graph = scene.graph();
    let centres = |rows: &mut dyn Iterator<Item = crate::structure::PoseRow>| -> Vec<_> {
        rows.map(|row| row.pose().unwrap().translation()).collect()
    };
    let began = centres(&mut graph.poses.iter().map(|row| row.world_from_camera()));
    for method in [Method::Point, Method::PointLine] {
        let adjusted = adjust(&graph, &options(method)).unwrap();
        let found = centres(&mut adjusted.estimate.trajectory.iter().map(|row| row.world_from_camera()));
        let (mut along, mut square) = (0.0, 0.0);
        for (now, then) in found.iter().zip(&began) {
            along += (now - found[0]).dot(&(then - began[0]));
            square += (now - found[0]).norm_squared();
        }
        assert!((along / square - 1.0).abs() < 1e-12, "{method:?}: {}", along / square);
        // Poses, points and lines were scaled alike, so no residual changed: adjusted again, there is nothing to gain.
        let mut again = graph.clone();
        for (row, pose) in again.poses.iter_mut().zip(&adjusted.estimate.trajectory) {
            *row = crate::structure::GraphPose::new(
                row.graph.clone(),
                row.frame_id,
                row.fixed,
                pose.world_from_camera(),
            );
        }
        for (row, point) in again.points.iter_mut().zip(&adjusted.estimate.points) {
            (row.x, row.y, row.z) = (point.x, point.y, point.z);
        }
        for (row, line) in again.lines.iter_mut().zip(&adjusted.estimate.lines) {
            (row.start_x, row.start_y, row.start_z) = (line.start_x, line.start_y, line.start_z);
            (row.end_x, row.end_y, row.end_z) = (line.end_x, line.end_y, line.end_z);
        }
        let cost = adjusted.summary.final_cost;
        let again = adjust(&again, &options(method)).unwrap().summary;
        // Relative: rounding of poses and segments as they are stored.
        assert!((again.initial_cost - cost).abs() < 1e-9 * cost, "{method:?}: {} {cost}", again.initial_cost);
    }
}

/// Frames 20 to 25 of a ring see three points each, and frame 26 sees nothing.
fn ring_with_a_blind_stretch(seed: u64, with_depth: bool) -> (FactorGraph, Vec<Pose>) {
    let scene = Scene { seed, frames: 60, sigma_px: 1.0, sigma_m: 0.05, with_depth, ..Scene::default() };
    let mut graph = scene.graph();
    graph.factors.retain(|factor| {
        let frame = factor.frame_id.unwrap().0 / 10;
        let is_one_of_three = factor.point_id.is_some_and(|point| point.0 < 3);
        !(20..=26).contains(&frame) || (frame < 26 && is_one_of_three)
    });
    (graph, scene.poses())
}

#[test]
fn motion_carries_frames_that_see_too_little() {
    let (mut carried, mut alone) = (0.0, 0.0);
    for seed in 1..6 {
        let (graph, truth) = ring_with_a_blind_stretch(seed, true);
        let worst = |smooth_motion| {
            let options = Options { smooth_motion, ..options(Method::Structural) };
            let Adjusted { estimate, summary } = adjust(&graph, &options).unwrap();
            let expected: Vec<FrameId> = (20..=26).map(|frame| FrameId(10 * frame)).collect();
            assert_eq!(summary.carried, if smooth_motion { expected } else { Vec::new() });
            assert_eq!(summary.unconstrained.len(), usize::from(!smooth_motion));
            worst_centre(&estimate, &truth)
        };
        carried += worst(true);
        alone += worst(false);
    }
    assert!(carried < 0.5 * alone, "{carried} m with motion, {alone} m without");
}

#[test]
fn motion_says_nothing_where_pixels_leave_the_scale_open() {
    let (graph, _) = ring_with_a_blind_stretch(1, false);
    let Adjusted { summary, .. } = adjust(&graph, &options(Method::Structural)).unwrap();
    assert_eq!(summary.carried, []);
    assert_eq!(summary.relative_factors.used, 0);
}
