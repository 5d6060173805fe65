//! Which lines of a structural group agree with it, by their own uncertainty.

use super::estimation::{Estimation, LineHandle};
use super::observations::Observations;
use super::summary::{ReleasedLine, Summary};
use super::uncertainty::Uncertainty;
use crate::structure::{FactorGraph, GroupId, LineId};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Squared length, in sigma, of a difference in two degrees of freedom that chance exceeds once in a thousand times.
const CONTRADICTION: f64 = 13.8155;

/// How far the misfit of a whole group may lie above its mean, in its standard deviations: chance goes farther once in some hundred times.
///
/// Lines that are each a little off stay under [`CONTRADICTION`] one by one, and bend everything together.
const WHOLE_SIGMA: f64 = 2.5;

/// Squared difference from a right angle, in sigma, that chance exceeds once in a thousand times.
const NOT_UPRIGHT: f64 = 10.8276;

/// Directions are taken to be no better known than this, radians: what is left of rounding and of linearisation.
const LEAST_SIGMA_RAD: f64 = 1e-4;

/// Lines of the truth that differ by more than this are not parallel, radians.
const EXACT_RAD: f64 = 1e-3;

/// Most degrees off at which a line may still be tested: farther away, tangents mean nothing.
const FARTHEST_RAD: f64 = 0.35;

/// Lines that share a direction, and directions at right angles.
#[derive(Clone, Debug, Default)]
pub(super) struct Grouping {
    /// Direction of each group that has lines, length one.
    pub(super) directions: Vec<Vector3<f64>>,
    /// For each line of the observations, its group's place among the directions.
    pub(super) of_line: Vec<Option<usize>>,
    /// Pairs of directions that are declared to be perpendicular, and are.
    pub(super) right_angles: Vec<[usize; 2]>,
}

impl Grouping {
    /// Every line by itself.
    pub(super) fn none(observations: &Observations) -> Self {
        Self { of_line: vec![None; observations.lines.len()], ..Self::default() }
    }

    /// Tests every parallel group of a graph against lines that were estimated without it.
    ///
    /// With the directions `y` of a group's lines and their joint covariance `C`, the group is held against the hypothesis of one
    /// direction by generalised least squares. While there is a line whose deletion lowers the squared misfit by more than chance would
    /// (two degrees of freedom, one in a thousand), or the misfit of the whole group is more than chance, the worst line is released. So
    /// lines count by how well they are known, and a common drift, which the covariance holds, releases none.
    ///
    /// Right angles that are declared are held against the angle between directions and its variance in the same way.
    pub(super) fn tested(
        graph: &FactorGraph,
        observations: &Observations,
        estimation: &Estimation,
        summary: &mut Summary,
    ) -> Self {
        let mut found = Self::none(observations);
        summary.released.clear();
        let Ok(uncertainty) = Uncertainty::of(&estimation.problem) else { return found };
        let (mut group_places, mut commons) = (BTreeMap::new(), Vec::new());
        for Candidates { group_id, ids, lines } in candidates(graph, observations) {
            let (kept, common, released) = agreeing(group_id, &lines, observations, estimation, &uncertainty);
            summary.released.extend(released);
            if let Some(place) = found.tie(&kept, common.direction) {
                group_places.insert(group_id, (place, ids));
                commons.push(common);
            }
        }
        found.find_right_angles(graph, &group_places, |a, b| commons[a].is_upright(&commons[b]));
        summary.grouped = found.of_line.iter().flatten().count();
        found
    }

    /// Groups as they are where values are the truth: lines within a thousandth of a radian of their group's direction.
    pub(super) fn given(graph: &FactorGraph, observations: &Observations, summary: &mut Summary) -> Self {
        let mut found = Self::none(observations);
        let mut group_places = BTreeMap::new();
        for Candidates { group_id, ids, lines } in candidates(graph, observations) {
            let direction = |line: usize| observations.lines[line].line.direction;
            let Some(common) = consensus(&lines, direction) else { continue };
            let (kept, off): (Vec<usize>, Vec<usize>) =
                lines.iter().partition(|line| common.cross(&direction(**line)).norm() < EXACT_RAD);
            for line in off {
                summary.released.push(ReleasedLine {
                    line_id: observations.lines[line].line_id,
                    group_id,
                    angle_rad: libm::asin(common.cross(&direction(line)).norm().min(1.0)),
                    chi_squared: f64::INFINITY,
                });
            }
            if let Some(place) = found.tie(&kept, common) {
                group_places.insert(group_id, (place, ids));
            }
        }
        let directions = found.directions.clone();
        let is_upright = |a: usize, b: usize| directions[a].dot(&directions[b]).abs() < EXACT_RAD;
        found.find_right_angles(graph, &group_places, is_upright);
        summary.grouped = found.of_line.iter().flatten().count();
        found
    }

    /// Gives lines one direction and its place among all; `None` for fewer than two, which have nothing to share.
    fn tie(&mut self, lines: &[usize], direction: Vector3<f64>) -> Option<usize> {
        let place = self.directions.len();
        if lines.len() < 2 {
            return None;
        }
        for line in lines {
            self.of_line[*line] = Some(place);
        }
        self.directions.push(direction);
        Some(place)
    }

    /// Right angles that `manhattan` and `atlanta` groups declare, unless the estimated directions contradict them.
    fn find_right_angles(
        &mut self,
        graph: &FactorGraph,
        groups: &BTreeMap<GroupId, (usize, BTreeSet<LineId>)>,
        is_upright: impl Fn(usize, usize) -> bool,
    ) {
        for whole in graph.groups.iter().filter(|group| group.is_made_of_groups()) {
            let ids: BTreeSet<LineId> = whole.line_ids.iter().copied().collect();
            let parts: Vec<usize> =
                groups.values().filter(|(_, lines)| lines.is_subset(&ids)).map(|(place, _)| *place).collect();
            for (at, a) in parts.iter().enumerate() {
                for b in &parts[at + 1..] {
                    // In an `atlanta` group some pairs are perpendicular; which, their directions say.
                    if is_upright(*a, *b) && !self.right_angles.contains(&[*a, *b]) {
                        self.right_angles.push([*a, *b]);
                    }
                }
            }
        }
    }
}

/// A parallel group and those of its lines that are there, by their places.
struct Candidates {
    group_id: GroupId,
    ids: BTreeSet<LineId>,
    lines: Vec<usize>,
}

/// The parallel groups of a graph; a line in two groups is a candidate of the first.
fn candidates(graph: &FactorGraph, observations: &Observations) -> Vec<Candidates> {
    let places: BTreeMap<LineId, usize> =
        observations.lines.iter().enumerate().map(|(at, line)| (line.line_id, at)).collect();
    let mut taken = BTreeSet::new();
    let parallel = graph.groups.iter().filter(|group| !group.is_made_of_groups());
    parallel
        .map(|group| {
            let ids: BTreeSet<LineId> = group.line_ids.iter().copied().collect();
            let present = ids.iter().filter_map(|id| places.get(id).copied());
            let lines = present.filter(|line| taken.insert(*line)).collect();
            Candidates { group_id: group.group_id, ids, lines }
        })
        .collect()
}

/// The direction that lines have in common, length one, and its covariance.
#[derive(Clone, Copy, Debug)]
struct Common {
    direction: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Common {
    /// Whether two directions are at right angles as far as they are known.
    fn is_upright(&self, other: &Self) -> bool {
        let off = self.direction.dot(&other.direction);
        let variance = other.direction.dot(&(self.covariance * other.direction))
            + self.direction.dot(&(other.covariance * self.direction))
            + LEAST_SIGMA_RAD * LEAST_SIGMA_RAD;
        // Farther off, the variance of a tangent means nothing.
        off.abs() < FARTHEST_RAD && off * off <= NOT_UPRIGHT * variance
    }
}

/// Lines of a group that agree, their direction, and those that do not.
fn agreeing(
    group_id: GroupId,
    lines: &[usize],
    observations: &Observations,
    estimation: &Estimation,
    uncertainty: &Uncertainty,
) -> (Vec<usize>, Common, Vec<ReleasedLine>) {
    let direction = |line: usize| observations.lines[line].line.direction;
    let mut released = Vec::new();
    let Some(reference) = consensus(lines, direction) else {
        return (Vec::new(), Common { direction: Vector3::x(), covariance: Matrix3::zeros() }, released);
    };
    let axis = Vector3::ith_axis(reference.iamin()).into_inner();
    let first = (axis - reference * reference.dot(&axis)).normalize();
    let axes = [first, reference.cross(&first)];
    let off = |line: usize| {
        let d = direction(line);
        let d = if d.dot(&reference) < 0.0 { -d } else { d };
        Vector2::new(axes[0].dot(&d), axes[1].dot(&d))
    };
    let mut kept = Vec::new();
    for line in lines {
        let angle = libm::asin(off(*line).norm().min(1.0));
        if angle <= FARTHEST_RAD && matches!(estimation.lines[*line], LineHandle::Free(_)) {
            kept.push(*line);
        } else {
            let line_id = observations.lines[*line].line_id;
            released.push(ReleasedLine { line_id, group_id, angle_rad: angle, chi_squared: f64::INFINITY });
        }
    }
    let all = joint(&kept, &axes, &reference, estimation, uncertainty);
    let mut active: Vec<usize> = (0..kept.len()).collect();
    let (mut mean, mut of_mean) = (Vector2::zeros(), Matrix2::zeros());
    while active.len() >= 2 {
        let size = 2 * active.len();
        let covariance = DMatrix::from_fn(size, size, |row, column| {
            let floor = if row == column { LEAST_SIGMA_RAD * LEAST_SIGMA_RAD } else { 0.0 };
            all[(2 * active[row / 2] + row % 2, 2 * active[column / 2] + column % 2)] + floor
        });
        let Some(weights) = covariance.cholesky().map(|factor| factor.inverse()) else {
            active.clear();
            break;
        };
        let y = DVector::from_fn(size, |row, _| off(kept[active[row / 2]])[row % 2]);
        // P = C⁻¹ − C⁻¹ 1 (1ᵀ C⁻¹ 1)⁻¹ 1ᵀ C⁻¹
        let ones = DMatrix::from_fn(size, 2, |row, column| if row % 2 == column { 1.0 } else { 0.0 });
        let weighted = &weights * &ones;
        let total: Matrix2<f64> = (ones.transpose() * &weighted).fixed_view::<2, 2>(0, 0).into_owned();
        let Some(total) = total.try_inverse() else {
            active.clear();
            break;
        };
        let estimate = total * (weighted.transpose() * &y).fixed_rows::<2>(0);
        (mean, of_mean) = (Vector2::new(estimate[0], estimate[1]), total);
        let projector = &weights - &weighted * total * weighted.transpose();
        let misfit = &projector * &y;
        let worst = (0..active.len())
            .filter_map(|at| {
                let r = misfit.fixed_rows::<2>(2 * at).into_owned();
                let block: Matrix2<f64> = projector.fixed_view::<2, 2>(2 * at, 2 * at).into_owned();
                Some((at, r.dot(&(block.try_inverse()? * r))))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let freedom = (2 * active.len() - 2) as f64;
        let is_plausible = y.dot(&misfit) <= freedom + WHOLE_SIGMA * (2.0 * freedom).sqrt();
        let Some((at, chi_squared)) = worst.filter(|(_, chi)| *chi > CONTRADICTION || !is_plausible) else {
            break;
        };
        let line = kept[active.remove(at)];
        let angle_rad = (off(line) - mean).norm();
        let line_id = observations.lines[line].line_id;
        released.push(ReleasedLine { line_id, group_id, angle_rad, chi_squared });
    }
    if active.len() < 2 {
        active.clear();
    }
    let direction = (reference + axes[0] * mean.x + axes[1] * mean.y).normalize();
    released.sort_by_key(|line| line.line_id);
    let across = Matrix3x2::from_columns(&axes);
    let common = Common { direction, covariance: across * of_mean * across.transpose() };
    (active.into_iter().map(|at| kept[at]).collect(), common, released)
}

/// The direction from which the directions of all lines are least far off in the median; the first of equals.
fn consensus(lines: &[usize], direction: impl Fn(usize) -> Vector3<f64>) -> Option<Vector3<f64>> {
    let spread = |candidate: &Vector3<f64>| {
        let mut angles: Vec<f64> =
            lines.iter().map(|line| candidate.cross(&direction(*line)).norm()).collect();
        angles.sort_by(f64::total_cmp);
        angles[angles.len() / 2]
    };
    let candidates = lines.iter().map(|line| direction(*line));
    candidates.min_by(|a, b| spread(a).total_cmp(&spread(b)))
}

/// Joint covariance of the lines' directions along two axes, two numbers for each line.
fn joint(
    lines: &[usize],
    axes: &[Vector3<f64>; 2],
    reference: &Vector3<f64>,
    estimation: &Estimation,
    uncertainty: &Uncertainty,
) -> DMatrix<f64> {
    let mut functional = DMatrix::zeros(uncertainty.unknowns(), 2 * lines.len());
    for (at, line) in lines.iter().enumerate() {
        let LineHandle::Free(variable) = estimation.lines[*line] else { continue };
        let Some(range) = uncertainty.range(variable) else { continue };
        let (direction, derivative) = estimation.direction_of(variable);
        let sign = if direction.dot(reference) < 0.0 { -1.0 } else { 1.0 };
        for (k, axis) in axes.iter().enumerate() {
            let by_step = derivative.transpose() * axis * sign;
            for (row, unknown) in range.clone().enumerate() {
                functional[(unknown, 2 * at + k)] = by_step[row];
            }
        }
    }
    let solved = uncertainty.times(&functional);
    functional.transpose() * solved
}
