//! The least-squares problem of observations, and the way back from it.

use super::error::Error;
use super::line_factor::LineFactor;
use super::line_form::{CayleySpace, EndpointsSpace, LineForm};
use super::loss::Loss;
use super::minimise::Step;
use super::observations::Observations;
use super::options::{LineKind, Method, Options};
use super::parametrisation::{LineSpace, PoseSpace, VectorSpace};
use super::point_factor::PointFactor;
use super::pose_factor::{PosePriorFactor, RelativePoseFactor};
use super::problem::{Problem, Variable};
use super::summary::Summary;
use super::whitening::{depth_sight, ends_depth_sight, ends_sight, pixel_sight};
use crate::geometry::{PluckerLine, Segment};
use crate::structure::{Estimate, FactorGraph, Iteration, MapLine, MapPoint, PoseRow, TrajectoryPose};
use nalgebra::{Matrix6, Point3, Vector3, Vector6};
use std::marker::PhantomData;
use std::sync::Arc;

/// A frame whose measurements leave its pose open gets this prior: radians and metres.
const WEAK_PRIOR: [f64; 2] = [1.0, 100.0];

/// Numbers of residual from which on a frame's pose is not open by their count.
const ENOUGH_FOR_A_POSE: usize = 6;

/// A problem, and which of its variables is what.
pub(super) struct Estimation {
    pub(super) problem: Problem,
    pub(super) poses: Vec<Variable>,
    pub(super) points: Vec<Variable>,
    pub(super) lines: Vec<Variable>,
    line_kind: LineKind,
}

impl Estimation {
    /// Poses the problem.
    pub(super) fn new(
        observations: &Observations,
        _graph: &FactorGraph,
        options: &Options,
        summary: &mut Summary,
    ) -> Result<Self, Error> {
        let mut problem = Problem::new();
        let pose_space = Arc::new(PoseSpace);
        let poses: Vec<Variable> = observations
            .frames
            .iter()
            .map(|frame| problem.add(&pose_space, &PoseSpace::numbers_of(&frame.camera_from_world)))
            .collect();
        let point_space = Arc::new(VectorSpace(3));
        let points: Vec<Variable> = observations
            .points
            .iter()
            .map(|point| problem.add(&point_space, point.position.coords.as_slice()))
            .collect();
        let mut estimation = Self { problem, poses, points, lines: Vec::new(), line_kind: options.lines };
        estimation.add_points(observations, options)?;
        match options.lines {
            LineKind::Orthonormal => estimation.add_lines(&Arc::new(LineSpace), observations, options)?,
            LineKind::Endpoints => estimation.add_lines(&Arc::new(EndpointsSpace), observations, options)?,
            LineKind::PluckerCayley => estimation.add_lines(&Arc::new(CayleySpace), observations, options)?,
        }
        estimation.add_relatives(observations, options)?;
        estimation.add_priors(observations, options)?;
        estimation.hold_gauge(observations, options, summary)?;
        summary.residuals = estimation.problem.layout.residuals;
        summary.unknowns = (0..estimation.problem.len())
            .filter(|index| !estimation.problem.held[*index])
            .map(|index| estimation.problem.spaces[estimation.problem.space_of[index] as usize].freedom())
            .sum();
        Ok(estimation)
    }

    fn add_points(&mut self, observations: &Observations, options: &Options) -> Result<(), Error> {
        let (mut pixels, mut depths) = (Vec::new(), Vec::new());
        for view in &observations.point_views {
            let variables = [self.poses[view.frame], self.points[view.point]];
            match view.depth {
                Some(depth) => {
                    let sight = depth_sight(view, depth, &observations.noise);
                    depths.push(PointFactor::<_, 3> { variables, sight });
                }
                None => {
                    let sight = pixel_sight(view, &observations.noise);
                    pixels.push(PointFactor::<_, 2> { variables, sight });
                }
            }
        }
        self.problem.add_factors(pixels, options.loss)?;
        self.problem.add_factors(depths, options.loss)
    }

    fn add_lines<L: LineForm>(
        &mut self,
        space: &Arc<L>,
        observations: &Observations,
        options: &Options,
    ) -> Result<(), Error> {
        for line in &observations.lines {
            let variable = self.problem.add(space, &L::numbers_of(&line.segment, &line.line));
            self.lines.push(variable);
        }
        let (mut ends, mut depths) = (Vec::new(), Vec::new());
        for view in &observations.line_views {
            let variables = [self.poses[view.frame], self.lines[view.line]];
            let form = PhantomData::<L>;
            if view.depths.iter().any(Option::is_some) {
                let pose = &observations.frames[view.frame].camera_from_world;
                let line = &observations.lines[view.line].line;
                let sight = ends_depth_sight(view, &observations.noise, pose, line);
                depths.push(LineFactor::<L, _, 4> { variables, sight, form });
            } else {
                let sight = ends_sight(view, &observations.noise);
                ends.push(LineFactor::<L, _, 2> { variables, sight, form });
            }
        }
        self.problem.add_factors(ends, options.loss)?;
        self.problem.add_factors(depths, options.loss)
    }

    fn add_relatives(&mut self, observations: &Observations, options: &Options) -> Result<(), Error> {
        let factors = observations.relatives.iter().map(|view| {
            let root = view.information.as_ref().map_or_else(Matrix6::identity, |information| {
                let information: Matrix6<f64> = information.fixed_view::<6, 6>(0, 0).into_owned();
                information.cholesky().map_or_else(Matrix6::zeros, |factor| factor.l().transpose())
            });
            RelativePoseFactor {
                variables: [self.poses[view.frame], self.poses[view.other]],
                other_from_frame: view.frame_from_other.inverse(),
                root,
            }
        });
        let factors = factors.collect();
        self.problem.add_factors(factors, options.loss)
    }

    fn add_priors(&mut self, observations: &Observations, options: &Options) -> Result<(), Error> {
        let mut factors = Vec::new();
        for prior in &options.priors {
            let place = observations.frames.iter().position(|frame| frame.frame_id == prior.frame_id);
            let Some(place) = place else { continue };
            let Ok(world_from_camera) = prior.pose.pose() else {
                let found = prior.pose.numbers().into_iter().find(|n| !n.is_finite()).unwrap_or_default();
                return Err(Error::Option { option: "priors", expected: "a pose", found });
            };
            let root = diagonal_root(prior.sigma_rotation_rad, prior.sigma_translation_m);
            factors.push(PosePriorFactor { variables: [self.poses[place]], world_from_camera, root });
        }
        self.problem.add_factors(factors, Loss::None)
    }

    /// Holds what no measurement holds.
    fn hold_gauge(
        &mut self,
        observations: &Observations,
        options: &Options,
        summary: &mut Summary,
    ) -> Result<(), Error> {
        summary.held.clear();
        summary.weak.clear();
        summary.unconstrained.clear();
        let mut numbers = vec![0; observations.frames.len()];
        observations
            .point_views
            .iter()
            .for_each(|view| numbers[view.frame] += 2 + usize::from(view.depth.is_some()));
        observations.line_views.iter().for_each(|view| {
            numbers[view.frame] += 2 + view.depths.iter().flatten().count();
        });
        for view in &observations.relatives {
            numbers[view.frame] += 6;
            numbers[view.other] += 6;
        }
        let components = observations.components();
        let has_prior = |frame: usize| {
            let id = observations.frames[frame].frame_id;
            options.priors.iter().any(|prior| prior.frame_id == id)
        };
        let mut is_anchored = vec![false; components.iter().max().map_or(0, |most| most + 1)];
        for (frame, vertex) in observations.frames.iter().enumerate() {
            is_anchored[components[frame]] |= vertex.fixed || has_prior(frame);
        }
        summary.components = 0;
        let mut weak = Vec::new();
        for (frame, vertex) in observations.frames.iter().enumerate() {
            let id = vertex.frame_id;
            let is_first = components[frame] == frame;
            if numbers[frame] == 0 && !has_prior(frame) {
                summary.unconstrained.push(id);
                self.problem.hold(self.poses[frame]);
                continue;
            }
            summary.components += usize::from(is_first);
            if vertex.fixed || (is_first && !is_anchored[frame]) {
                summary.held.push(id);
                self.problem.hold(self.poses[frame]);
            } else if numbers[frame] < ENOUGH_FOR_A_POSE && !has_prior(frame) {
                summary.weak.push(id);
                let root = diagonal_root(WEAK_PRIOR[0], WEAK_PRIOR[1]);
                let world_from_camera = vertex.camera_from_world.inverse();
                weak.push(PosePriorFactor { variables: [self.poses[frame]], world_from_camera, root });
            }
        }
        self.problem.add_factors(weak, Loss::None)
    }

    /// Writes the problem's values into the observations' vertices.
    pub(super) fn read(&self, observations: &mut Observations) {
        let values = self.problem.values();
        for (frame, variable) in observations.frames.iter_mut().zip(&self.poses) {
            frame.camera_from_world = PoseSpace::pose_of(values.of(*variable));
        }
        for (point, variable) in observations.points.iter_mut().zip(&self.points) {
            let numbers = values.of(*variable);
            point.position = Point3::new(numbers[0], numbers[1], numbers[2]);
        }
        for (line, variable) in observations.lines.iter_mut().zip(&self.lines) {
            let numbers = values.of(*variable);
            let (moment, direction) = match self.line_kind {
                LineKind::Orthonormal => <LineSpace as LineForm>::plucker(numbers),
                LineKind::Endpoints => EndpointsSpace::plucker(numbers),
                LineKind::PluckerCayley => CayleySpace::plucker(numbers),
            };
            if let Some(found) = line_of(moment, direction, &line.line) {
                line.segment = projected(&line.segment, &found);
                line.line = found;
            }
        }
    }

    /// Whether another round would change what is estimated.
    pub(super) fn needs_another(
        &self,
        options: &Options,
        _observations: &Observations,
        round: usize,
    ) -> bool {
        options.method == Method::Structural && round == 0
    }

    /// The estimate, from observations that were read.
    pub(super) fn estimate(
        &self,
        observations: &Observations,
        options: &Options,
        steps: &[Step],
        summary: &mut Summary,
    ) -> Result<Estimate, Error> {
        let name = options.estimate_name().to_owned();
        summary.residual_rms = self.residual_rms();
        let trajectory = observations.frames.iter().map(|frame| {
            TrajectoryPose::new(
                name.clone(),
                frame.frame_id,
                PoseRow::from(&frame.camera_from_world.inverse()),
            )
        });
        let points = observations.points.iter().map(|point| MapPoint {
            estimate: name.clone(),
            point_id: point.point_id,
            x: point.position.x,
            y: point.position.y,
            z: point.position.z,
            covariance: None,
        });
        let lines = observations.lines.iter().map(|line| {
            let Segment { start, end } = line.segment;
            MapLine {
                estimate: name.clone(),
                line_id: line.line_id,
                start_x: start.x,
                start_y: start.y,
                start_z: start.z,
                end_x: end.x,
                end_y: end.y,
                end_z: end.z,
                covariance: None,
            }
        });
        let iterations = (0..).zip(steps).map(|(iteration, step)| Iteration {
            estimate: name.clone(),
            iteration,
            cost: step.cost,
            cost_change: (iteration > 0 && step.decrease.is_finite()).then_some(step.decrease),
            gradient_max: step.gradient_max,
            step_norm: (iteration > 0).then_some(step.step_norm),
            damping: step.damping,
            accepted: step.accepted,
        });
        Ok(Estimate {
            name: name.clone(),
            trajectory: trajectory.collect(),
            points: points.collect(),
            lines: lines.collect(),
            tracking: Vec::new(),
            iterations: iterations.collect(),
        })
    }

    /// Root mean square of all whitened residuals, before the loss.
    fn residual_rms(&self) -> f64 {
        let values = self.problem.values();
        let (mut sum, mut count) = (0.0, 0);
        for batch in &self.problem.batches {
            for factor in 0..batch.len() {
                sum += batch.squared(factor, &values).unwrap_or_default();
                count += batch.residuals();
            }
        }
        if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
    }
}

/// `W` of a pose with the same uncertainty in all axes.
fn diagonal_root(sigma_rotation_rad: f64, sigma_translation_m: f64) -> Matrix6<f64> {
    let (turn, shift) = (1.0 / sigma_rotation_rad, 1.0 / sigma_translation_m);
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
}

/// The line of a moment and a direction of any scale, directed as another is.
pub(super) fn line_of(
    moment: Vector3<f64>,
    direction: Vector3<f64>,
    like: &PluckerLine,
) -> Option<PluckerLine> {
    let length = direction.norm();
    let sign = if direction.dot(&like.direction) < 0.0 { -1.0 } else { 1.0 };
    let direction = direction * (sign / length);
    let moment = moment * (sign / length);
    // Both come from one form, so that they are perpendicular up to rounding.
    let moment = moment - direction * direction.dot(&moment);
    (moment.iter().chain(&direction).all(|number| number.is_finite()))
        .then_some(PluckerLine { moment, direction })
}

/// The piece of a line between the feet of a segment's ends.
pub(super) fn projected(segment: &Segment, line: &PluckerLine) -> Segment {
    Segment { start: line.closest_point_to(segment.start), end: line.closest_point_to(segment.end) }
}
