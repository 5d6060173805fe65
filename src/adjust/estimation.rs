//! The least-squares problem of observations, and the way back from it.

use super::covariances::Covariances;
use super::error::Error;
use super::grouping::Grouping;
use super::line_factor::LineFactor;
use super::line_form::{CayleySpace, EndpointsSpace, LineForm};
use super::loss::Loss;
use super::minimise::Step;
use super::observations::Observations;
use super::options::{LineKind, Method, Options, Parallelism};
use super::parametrisation::{DirectionSpace, LineSpace, Parametrisation, PoseSpace, VectorSpace};
use super::planar_pose::{PLANE, PlanarPoseFactor, PlanarPoseSpace};
use super::point_handle::PointHandle;
use super::pose_factor::{PosePriorFactor, ScaleFactor};
use super::problem::{Problem, Variable};
use super::relative_pose_factor::RelativePoseFactor;
use super::scale_gauge::ONE_PLACE_M;
use super::shared_line::{ParallelFactor, RightAngleFactor, SharedLineFactor, shared_plucker};
use super::summary::Summary;
use super::whitening::{ends_depth_sight, ends_sight, root};
use crate::geometry::{PluckerLine, Segment};
use crate::structure::{Estimate, Iteration, MapLine, MapPoint, PoseRow, TrajectoryPose};
use nalgebra::{DMatrix, Matrix3, Matrix3x4, Matrix6, Point2, Point3, SMatrix, Vector3, Vector6};
use std::marker::PhantomData;
use std::sync::Arc;

/// A frame whose measurements leave its pose open, or just determine it, gets a prior about where it began: radians and metres.
///
/// In the paper's adjustments it does no more than keep the equations solvable. In a structural one it says that trackers know where
/// such a frame is from its neighbours: three points have no redundancy, and noise moves such a frame by half a metre.
fn weak_prior(method: Method) -> [f64; 2] {
    if method == Method::Structural { [0.1, 0.2] } else { [1.0, 100.0] }
}

/// How far from a right angle directions may be that are perpendicular, radians: as good as never.
const RIGHT_ANGLE_RAD: f64 = 1e-5;

/// Numbers of residual that make a frame's pose redundant: four points in pixels, or three with depth.
const ENOUGH_FOR_A_POSE: usize = 8;

/// A problem, and which of its variables is what.
pub(super) struct Estimation {
    pub(super) problem: Problem,
    pub(super) poses: Vec<Variable>,
    pub(super) points: Vec<PointHandle>,
    pub(super) lines: Vec<LineHandle>,
    line_kind: LineKind,
}

/// The variables of a line.
#[derive(Clone, Copy, Debug)]
pub(super) enum LineHandle {
    /// One with four degrees of freedom.
    Free(Variable),
    /// A direction that it shares, and two degrees of freedom of its own about a place near it.
    Shared { direction: Variable, offset: Variable, origin: Vector3<f64> },
}

impl Estimation {
    /// Poses the problem.
    pub(super) fn new(
        observations: &Observations,
        grouping: &Grouping,
        options: &Options,
        summary: &mut Summary,
    ) -> Result<Self, Error> {
        let mut problem = Problem::new();
        let poses = if observations.planar {
            add_poses(&mut problem, PlanarPoseSpace, observations)
        } else {
            add_poses(&mut problem, PoseSpace, observations)
        };
        let mut estimation =
            Self { problem, poses, points: Vec::new(), lines: Vec::new(), line_kind: options.lines };
        estimation.add_points(observations, options)?;
        match options.lines {
            LineKind::Orthonormal => {
                estimation.add_lines(&Arc::new(LineSpace), observations, grouping, options)?;
            }
            LineKind::Endpoints => {
                estimation.add_lines(&Arc::new(EndpointsSpace), observations, grouping, options)?;
            }
            LineKind::PluckerCayley => {
                estimation.add_lines(&Arc::new(CayleySpace), observations, grouping, options)?;
            }
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

    fn add_lines<L: LineForm>(
        &mut self,
        space: &Arc<L>,
        observations: &Observations,
        grouping: &Grouping,
        options: &Options,
    ) -> Result<(), Error> {
        let directions: Vec<Variable> = {
            let space = Arc::new(DirectionSpace);
            let directions = grouping.directions.iter();
            directions.map(|d| self.problem.add(&space, &DirectionSpace::numbers_of(d))).collect()
        };
        let exact = options.parallelism == Parallelism::Exact;
        let offset_space = Arc::new(VectorSpace(2));
        for (line, group) in observations.lines.iter().zip(&grouping.of_line) {
            let handle = match group {
                Some(group) if exact => {
                    let origin = line.line.closest_point_to(line.segment.midpoint()).coords;
                    let offset = self.problem.add(&offset_space, &[0.0; 2]);
                    LineHandle::Shared { direction: directions[*group], offset, origin }
                }
                _ => LineHandle::Free(self.problem.add(space, &L::numbers_of(&line.segment, &line.line))),
            };
            self.lines.push(handle);
        }
        let (mut ends, mut depths, mut shared_ends, mut shared_depths) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for view in &observations.line_views {
            let pose = self.poses[view.frame];
            let form = PhantomData::<L>;
            let sight = if view.depths.iter().any(Option::is_some) {
                let pose = &observations.frames[view.frame].camera_from_world;
                let line = &observations.lines[view.line].line;
                Ok(ends_depth_sight(view, &observations.noise, pose, line))
            } else {
                Err(ends_sight(view, &observations.noise))
            };
            match (self.lines[view.line], sight) {
                (LineHandle::Free(line), Ok(sight)) => {
                    depths.push(LineFactor::<L, _, 4> { variables: [pose, line], sight, form });
                }
                (LineHandle::Free(line), Err(sight)) => {
                    ends.push(LineFactor::<L, _, 2> { variables: [pose, line], sight, form });
                }
                (LineHandle::Shared { direction, offset, origin }, Ok(sight)) => {
                    let variables = [pose, direction, offset];
                    shared_depths.push(SharedLineFactor::<_, 4> { variables, origin, sight });
                }
                (LineHandle::Shared { direction, offset, origin }, Err(sight)) => {
                    let variables = [pose, direction, offset];
                    shared_ends.push(SharedLineFactor::<_, 2> { variables, origin, sight });
                }
            }
        }
        self.problem.add_factors(ends, options.loss)?;
        self.problem.add_factors(depths, options.loss)?;
        self.problem.add_factors(shared_ends, options.loss)?;
        self.problem.add_factors(shared_depths, options.loss)?;
        if let Parallelism::Soft { sigma_rad } = options.parallelism {
            let tied =
                self.lines.iter().zip(&grouping.of_line).filter_map(|(line, group)| match (line, group) {
                    (LineHandle::Free(line), Some(group)) => {
                        let variables = [*line, directions[*group]];
                        Some(ParallelFactor { variables, sigma_rad, form: PhantomData::<L> })
                    }
                    _ => None,
                });
            let tied = tied.collect();
            self.problem.add_factors(tied, options.loss)?;
        }
        let right_angles = grouping.right_angles.iter().map(|[a, b]| RightAngleFactor {
            variables: [directions[*a], directions[*b]],
            sigma_rad: RIGHT_ANGLE_RAD,
        });
        self.problem.add_factors(right_angles.collect(), Loss::None)
    }

    fn add_relatives(&mut self, observations: &Observations, options: &Options) -> Result<(), Error> {
        let (mut planar, mut spatial) = (Vec::new(), Vec::new());
        for view in &observations.relatives {
            let variables = [self.poses[view.frame], self.poses[view.other]];
            if observations.planar {
                let information = view.information.as_ref();
                let information = information.map_or_else(
                    || DMatrix::identity(3, 3),
                    |all| DMatrix::from_fn(3, 3, |row, column| all[(PLANE[row], PLANE[column])]),
                );
                let root = root(&information)
                    .map_or_else(Matrix3::zeros, |root| root.fixed_view::<3, 3>(0, 0).into_owned());
                planar.push(PlanarPoseFactor::new(variables, &view.frame_from_other, &root));
            } else {
                let root = view.information.as_ref().map_or_else(Matrix6::identity, |information| {
                    let root = root(information);
                    root.map_or_else(Matrix6::zeros, |root| root.fixed_view::<6, 6>(0, 0).into_owned())
                });
                spatial.push(RelativePoseFactor::new(variables, &view.frame_from_other, &root));
            }
        }
        self.problem.add_factors(planar, options.loss)?;
        self.problem.add_factors(spatial, options.loss)
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
            numbers[view.frame] += ENOUGH_FOR_A_POSE;
            numbers[view.other] += ENOUGH_FOR_A_POSE;
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
                let [turn, shift] = weak_prior(options.method);
                let root = diagonal_root(turn, shift);
                let world_from_camera = vertex.camera_from_world.inverse();
                weak.push(PosePriorFactor { variables: [self.poses[frame]], world_from_camera, root });
            }
        }
        self.problem.add_factors(weak, Loss::None)
    }

    /// The held frame of every part of the graph in which pixels alone leave the scale open, by the first frame of the part.
    pub(super) fn free_scales(&self, observations: &Observations) -> Vec<Option<usize>> {
        let components = observations.components();
        let mut has_scale = vec![false; components.len()];
        for view in &observations.point_views {
            has_scale[components[view.frame]] |= view.depth.is_some();
        }
        for view in &observations.line_views {
            has_scale[components[view.frame]] |= view.depths.iter().any(Option::is_some);
        }
        observations.relatives.iter().for_each(|view| has_scale[components[view.frame]] = true);
        let mut held: Vec<Option<usize>> = vec![None; components.len()];
        for frame in (0..components.len()).filter(|frame| self.problem.is_held(self.poses[*frame])) {
            let (part, centre) = (components[frame], observations.centre(frame));
            match held[part] {
                None => held[part] = Some(frame),
                // Two places that are held say how far they are apart.
                Some(first) => {
                    has_scale[part] |= (observations.centre(first) - centre).norm() > ONE_PLACE_M;
                }
            }
        }
        held.into_iter().zip(has_scale).map(|(held, known)| held.filter(|_| !known)).collect()
    }

    /// Fixes the scale of every part of the graph in which pixels alone leave it open; whether there was any.
    ///
    /// By the distance of the centre that lies farthest from a held one. Uncertainties are then those at this scale.
    pub(super) fn hold_scale(&mut self, observations: &Observations) -> Result<bool, Error> {
        let components = observations.components();
        let mut factors = Vec::new();
        for (part, held) in self.free_scales(observations).into_iter().enumerate() {
            let Some(from) = held.map(|held| observations.centre(held)) else { continue };
            let distance = |frame: &usize| (observations.centre(*frame) - from).norm();
            let frames = (0..components.len()).filter(|frame| components[*frame] == part);
            let farthest = frames.max_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some(farthest) = farthest.filter(|frame| distance(frame) > ONE_PLACE_M) {
                let distance_m = distance(&farthest);
                let variables = [self.poses[farthest]];
                factors.push(ScaleFactor { variables, from, distance_m, sigma_m: 1e-3 * distance_m });
            }
        }
        let open = !factors.is_empty();
        self.problem.add_factors(factors, Loss::None)?;
        Ok(open)
    }

    /// Writes the problem's values into the observations' vertices.
    pub(super) fn read(&self, observations: &mut Observations) {
        let values = self.problem.values();
        for (frame, variable) in observations.frames.iter_mut().zip(&self.poses) {
            frame.camera_from_world = PoseSpace::pose_of(values.of(*variable));
        }
        for (point, handle) in observations.points.iter_mut().zip(&self.points) {
            point.position = Point3::from(handle.place(&values));
        }
        for (line, handle) in observations.lines.iter_mut().zip(&self.lines) {
            let (moment, direction) = match handle {
                LineHandle::Free(variable) => {
                    let numbers = values.of(*variable);
                    match self.line_kind {
                        LineKind::Orthonormal => <LineSpace as LineForm>::plucker(numbers),
                        LineKind::Endpoints => EndpointsSpace::plucker(numbers),
                        LineKind::PluckerCayley => CayleySpace::plucker(numbers),
                    }
                }
                LineHandle::Shared { direction, offset, origin } => {
                    let (moment, direction, _) =
                        shared_plucker(values.of(*direction), values.of(*offset), origin);
                    (moment, direction)
                }
            };
            if let Some(found) = line_of(moment, direction, &line.line) {
                line.segment = projected(&line.segment, &found);
                line.line = found;
            }
        }
    }

    /// Moment and direction of a free line, of some common scale, and their derivative by a step.
    pub(super) fn free_line(&self, variable: Variable) -> (Vector3<f64>, Vector3<f64>, SMatrix<f64, 6, 4>) {
        let values = self.problem.values();
        let numbers = values.of(variable);
        let ((moment, direction), derivative) = match self.line_kind {
            LineKind::Orthonormal => {
                (<LineSpace as LineForm>::plucker(numbers), LineSpace::derivative(numbers))
            }
            LineKind::Endpoints => (EndpointsSpace::plucker(numbers), EndpointsSpace::derivative(numbers)),
            LineKind::PluckerCayley => (CayleySpace::plucker(numbers), CayleySpace::derivative(numbers)),
        };
        (moment, direction, derivative)
    }

    /// The direction of a free line, length one, and its derivative by a step.
    pub(super) fn direction_of(&self, variable: Variable) -> (Vector3<f64>, Matrix3x4<f64>) {
        let (_, direction, derivative) = self.free_line(variable);
        let length = direction.norm();
        let direction = direction / length;
        let by_step = derivative.fixed_view::<3, 4>(3, 0) / length;
        (direction, by_step - direction * (direction.transpose() * by_step))
    }

    /// The estimate, from observations that were read.
    pub(super) fn estimate(
        &mut self,
        observations: &Observations,
        options: &Options,
        steps: &[Step],
        summary: &mut Summary,
    ) -> Result<Estimate, Error> {
        let name = options.estimate_name().to_owned();
        summary.residual_rms = residual_rms(&self.problem);
        let mut covariances = if options.covariance {
            self.hold_scale(observations)?;
            // The estimate is worth keeping also where something is left open.
            self.covariances(observations).or_else(|cause| match cause {
                Error::Singular => {
                    summary.no_covariance = Some(cause);
                    Ok(Covariances::default())
                }
                cause => Err(cause),
            })?
        } else {
            Covariances::default()
        };
        let mut of_pose = covariances.poses.drain(..);
        let trajectory = observations.frames.iter().map(|frame| {
            let pose = PoseRow::from(&frame.camera_from_world.inverse());
            let row = TrajectoryPose::new(name.clone(), frame.frame_id, pose);
            TrajectoryPose { covariance: of_pose.next(), ..row }
        });
        let mut of_point = covariances.points.drain(..);
        let points = observations.points.iter().map(|point| {
            let row = MapPoint::new(name.clone(), point.point_id, &point.position);
            MapPoint { covariance: of_point.next(), ..row }
        });
        let mut of_line = covariances.lines.drain(..);
        let lines = observations.lines.iter().map(|line| {
            let row = MapLine::new(name.clone(), line.line_id, &line.segment);
            MapLine { covariance: of_line.next(), ..row }
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
}

/// Root mean square of all whitened residuals of a problem, before the loss.
pub(super) fn residual_rms(problem: &Problem) -> f64 {
    let values = problem.values();
    let (mut sum, mut count) = (0.0, 0);
    for batch in &problem.batches {
        for factor in 0..batch.len() {
            sum += batch.squared(factor, &values).unwrap_or_default();
            count += batch.residuals();
        }
    }
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

/// Adds the poses of all frames, in one space.
fn add_poses<P: Parametrisation + 'static>(
    problem: &mut Problem,
    space: P,
    observations: &Observations,
) -> Vec<Variable> {
    let space = Arc::new(space);
    let frames = observations.frames.iter();
    frames.map(|frame| problem.add(&space, &PoseSpace::numbers_of(&frame.camera_from_world))).collect()
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

/// Puts the ends of every line where its measured ends lie: the hull of their feet, but for a few farthest ones.
///
/// The foot of a measured end is the point of the line nearest to its viewing ray.
pub(super) fn recover_ends(observations: &mut Observations) {
    let mut places: Vec<Vec<f64>> = vec![Vec::new(); observations.lines.len()];
    for view in &observations.line_views {
        let line = &observations.lines[view.line].line;
        let world_from_camera = observations.frames[view.frame].camera_from_world.inverse();
        let origin = line.closest_point_to_origin();
        for end in view.ends {
            let centre = Point3::from(world_from_camera.translation());
            let ray = world_from_camera.transform_vector(&view.camera.ray(Point2::from(end)));
            let foot = PluckerLine::through(centre, centre + ray).ok();
            if let Some(foot) = foot.and_then(|ray| line.closest_point_to_line(&ray)) {
                places[view.line].push((foot - origin).dot(&line.direction));
            }
        }
    }
    for (line, places) in observations.lines.iter_mut().zip(&mut places) {
        places.retain(|place| place.is_finite());
        if places.len() < 4 {
            continue;
        }
        places.sort_by(f64::total_cmp);
        // Noise moves the farthest of many measured ends outwards.
        let cut = places.len() / 50;
        let (low, high) = (places[cut], places[places.len() - 1 - cut]);
        if high > low {
            let origin = line.line.closest_point_to_origin();
            let (start, end) = (origin + line.line.direction * low, origin + line.line.direction * high);
            line.segment = Segment { start, end };
        }
    }
}
