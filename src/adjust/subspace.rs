//! How far to go along a step and those before it: the true loss of linearised residuals, over a few directions.

use super::loss::{Loss, LossSum};
use super::normal_equations::NormalEquations;
use super::problem::Problem;
use super::small_blocks::dot;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Directions: the new step and the last ones that were taken.
const MOST: usize = 3;

/// Newton steps within the subspace at most.
const MOST_STEPS: usize = 8;

/// A Newton step that promises less than this part of what was gained is not worth a look at all residuals.
const LEAST_GAIN: f64 = 0.05;

/// Rounds at most, and the part of all that was gained below which another is not made.
const MOST_ROUNDS: usize = 4;
const LEAST_ROUND: f64 = 0.1;

/// Factors that one task sums.
const CHUNK: usize = 512;

/// A step of reweighted least squares stops short: the weights it holds fixed would fall on the way, and along directions that the
/// measurements tie together loosely it closes only a tenth of the distance. Here the step and the last two that were taken span a
/// subspace, in which `½ Σ ρ(|r + J δ|²) + ½ λ δᵀ D δ` is minimised with the loss as it is; from there again, with what the same
/// factorisation makes of the slope that is left: conjugate gradients with the normal equations for their metric. It takes products
/// with `J` and solutions, no further factorisation.
pub(super) struct Subspace {
    /// For each batch.
    batches: Vec<Shape>,
    /// Where the step of each variable stands; none for those that are held.
    step_of: Vec<Option<u32>>,
    /// Steps that were taken, the last one first.
    taken: Vec<Vec<f64>>,
    /// Directions of the search, the first ones of which are in use.
    directions: [Vec<f64>; MOST],
    /// `J v` of each number of a residual for each direction, without weights.
    changes: Vec<[f64; MOST]>,
    /// `r + J δ`, without weights.
    residuals: Vec<f64>,
    /// `δ`.
    total: Vec<f64>,
    /// By how much each number of a residual pulls, for the Jacobian as it is weighted.
    pulls: Vec<f64>,
    /// The slope at `δ`, downwards.
    slope: Vec<f64>,
}

/// How the factors of a batch lie.
struct Shape {
    loss: Loss,
    /// Degrees of freedom of each variable of a factor.
    freedoms: Vec<usize>,
}

/// `λ Vᵀ D δ` and `λ Vᵀ D V` of the directions.
struct Metric {
    pull: Vector3<f64>,
    matrix: Matrix3<f64>,
}

impl Metric {
    /// What damping adds at a place.
    fn at(&self, place: &Vector3<f64>) -> f64 {
        self.pull.dot(place) + 0.5 * place.dot(&(self.matrix * place))
    }
}

/// Value, slope and curvature over the subspace.
#[derive(Clone, Copy)]
struct Model {
    cost: f64,
    gradient: Vector3<f64>,
    hessian: Matrix3<f64>,
    /// Curvature with the weights held, above that of the loss everywhere.
    majorant: Matrix3<f64>,
}

impl Subspace {
    /// For a problem with a robust loss; `None` where all are least squares, whose steps are right as they are.
    pub(super) fn new(problem: &Problem, equations: &NormalEquations) -> Option<Self> {
        if problem.batches.iter().all(|batch| batch.loss() == Loss::None) {
            return None;
        }
        let shapes = problem.batches.iter().zip(&problem.layout.batches).map(|(batch, layout)| {
            let first = &layout.variables[..layout.arity];
            Shape { loss: batch.loss(), freedoms: first.iter().map(|v| problem.freedom(*v)).collect() }
        });
        let place = |variable| equations.step_of(variable).and_then(|range| u32::try_from(range.start).ok());
        let unknowns = equations.unknowns();
        Some(Self {
            batches: shapes.collect(),
            step_of: (0..problem.len()).map(place).collect(),
            taken: Vec::with_capacity(MOST),
            directions: std::array::from_fn(|_| vec![0.0; unknowns]),
            changes: vec![[0.0; MOST]; problem.layout.residuals],
            residuals: vec![0.0; problem.layout.residuals],
            pulls: vec![0.0; problem.layout.residuals],
            total: vec![0.0; unknowns],
            slope: vec![0.0; unknowns],
        })
    }

    /// Replaces a step by the best that is found from it; gives the decrease of the cost that it promises, `None` where there is none.
    ///
    /// * `damping` — λ, by which the step was found; `cost` — where it begins.
    pub(super) fn search(
        &mut self,
        problem: &Problem,
        equations: &mut NormalEquations,
        damping: f64,
        cost: f64,
        step: &mut [f64],
    ) -> Option<f64> {
        self.begin(problem, equations);
        self.directions[0].copy_from_slice(step);
        for (direction, taken) in self.directions[1..].iter_mut().zip(&self.taken) {
            direction.copy_from_slice(taken);
        }
        let mut count = 1 + self.taken.len();
        self.change(problem, equations, count);
        self.total.fill(0.0);
        let (mut cost, mut gained) = (cost, 0.0);
        for round in 1.. {
            let (place, gain) = self.best(problem, equations, damping, count, &mut cost);
            gained += gain;
            // What was found is the second direction of the next round, the second one its third.
            let [new, last, before] = &mut self.directions;
            for at in 0..step.len() {
                let moved = place.x * new[at] + place.y * last[at] + place.z * before[at];
                self.total[at] += moved;
                before[at] = last[at];
                last[at] = moved;
            }
            let [x, y, z] = [place.x, place.y, place.z];
            self.residuals.par_iter_mut().zip(&mut self.changes).with_min_len(CHUNK).for_each(
                |(residual, change)| {
                    let moved = x * change[0] + y * change[1] + z * change[2];
                    *residual += moved;
                    *change = [0.0, moved, change[1]];
                },
            );
            if round == MOST_ROUNDS || gain.is_nan() || gain <= LEAST_ROUND * gained {
                break;
            }
            self.slope(problem, equations);
            for ((slope, total), d) in self.slope.iter_mut().zip(&self.total).zip(equations.diagonal()) {
                *slope -= damping * d * total;
            }
            if !equations.solve(&self.slope, &mut self.directions[0]) {
                break;
            }
            self.change(problem, equations, 1);
            count = (count + 1).min(MOST);
        }
        step.copy_from_slice(&self.total);
        (gained.is_finite() && gained > 0.0).then_some(gained)
    }

    /// The best place of the subspace, and how far it lowers the cost and what damping adds.
    ///
    /// * `cost` — where it begins without what damping adds, and then at the best place.
    fn best(
        &self,
        problem: &Problem,
        equations: &NormalEquations,
        damping: f64,
        count: usize,
        cost: &mut f64,
    ) -> (Vector3<f64>, f64) {
        let diagonal = equations.diagonal();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            damping * a.iter().zip(b).zip(diagonal).map(|((a, b), d)| a * b * d).sum::<f64>()
        };
        let mut metric = Metric { pull: Vector3::zeros(), matrix: Matrix3::zeros() };
        for row in 0..count {
            metric.pull[row] = product(&self.directions[row], &self.total);
            for column in 0..=row {
                let product = product(&self.directions[row], &self.directions[column]);
                metric.matrix[(row, column)] = product;
                metric.matrix[(column, row)] = product;
            }
        }
        let start = *cost;
        // With the weights held the whole of the first direction lowers the cost; what is found is no worse.
        let mut place = Vector3::x();
        let mut here = self.model(problem, equations, &metric, &place);
        if here.cost.is_nan() || here.cost > start {
            place = Vector3::zeros();
            here = self.model(problem, equations, &metric, &place);
        }
        for _ in 0..MOST_STEPS {
            let Some(mut shift) = here.shift(count) else { break };
            if -0.5 * here.gradient.dot(&shift) <= LEAST_GAIN * (start - here.cost) {
                break;
            }
            let mut there = self.model(problem, equations, &metric, &(place + shift));
            if there.cost.is_nan() || there.cost > here.cost {
                // With the weights held the cost falls for certain.
                let Some(short) = here.descent(count) else { break };
                shift = short;
                there = self.model(problem, equations, &metric, &(place + shift));
                if there.cost.is_nan() || there.cost > here.cost {
                    break;
                }
            }
            place += shift;
            here = there;
        }
        *cost = here.cost - metric.at(&place);
        (place, start - here.cost)
    }

    /// A step that was taken is a direction of the next search.
    pub(super) fn remember(&mut self, step: &[f64]) {
        let mut oldest =
            if self.taken.len() == MOST - 1 { self.taken.pop() } else { None }.unwrap_or_default();
        oldest.clear();
        oldest.extend_from_slice(step);
        self.taken.insert(0, oldest);
    }

    /// After a step that was not taken the directions before it count no more.
    pub(super) fn forget(&mut self) {
        self.taken.clear();
    }

    /// Residuals without weights, where the step begins.
    fn begin(&mut self, problem: &Problem, equations: &NormalEquations) {
        let linear = &equations.linear;
        for layout in &problem.layout.batches {
            let factors = layout.factors();
            for factor in 0..factors {
                let root = linear.roots[layout.factor_start + factor];
                let first = layout.residual_start + factor * layout.rows;
                for row in first..first + layout.rows {
                    self.residuals[row] = if root > 0.0 { linear.residuals[row] / root } else { 0.0 };
                }
            }
        }
    }

    /// `J v` of the first directions.
    fn change(&mut self, problem: &Problem, equations: &NormalEquations, count: usize) {
        let Self { batches, step_of, directions, changes, .. } = self;
        let (linear, directions) = (&equations.linear, &directions[..count]);
        let mut changes = &mut changes[..];
        for (shape, layout) in batches.iter().zip(&problem.layout.batches) {
            let factors = layout.factors();
            let (mine, rest) = changes.split_at_mut(factors * layout.rows);
            changes = rest;
            mine.par_chunks_mut(CHUNK * layout.rows).enumerate().for_each(|(chunk, changes)| {
                for (index, lines) in changes.chunks_exact_mut(layout.rows).enumerate() {
                    let factor = chunk * CHUNK + index;
                    lines.iter_mut().for_each(|line| line[..count].fill(0.0));
                    let root = linear.roots[layout.factor_start + factor];
                    if root == 0.0 {
                        continue;
                    }
                    let variables = &layout.variables[factor * layout.arity..][..layout.arity];
                    let size = layout.rows * layout.columns;
                    let jacobian = &linear.jacobians[layout.jacobian_start + factor * size..][..size];
                    let mut column = 0;
                    for (variable, freedom) in variables.iter().zip(&shape.freedoms) {
                        if let Some(begin) = step_of[variable.index()] {
                            for (place, direction) in directions.iter().enumerate() {
                                let moved = &direction[begin as usize..begin as usize + freedom];
                                for (line, entries) in
                                    lines.iter_mut().zip(jacobian.chunks_exact(layout.columns))
                                {
                                    line[place] += dot(moved, &entries[column..column + freedom]);
                                }
                            }
                        }
                        column += freedom;
                    }
                    let scale = 1.0 / root;
                    lines.iter_mut().flat_map(|line| &mut line[..count]).for_each(|change| *change *= scale);
                }
            });
        }
    }

    /// `−Jᵀ ρ' (r + J δ)`.
    fn slope(&mut self, problem: &Problem, equations: &NormalEquations) {
        let Self { batches, residuals, pulls, slope, .. } = self;
        let linear = &equations.linear;
        let mut pulls_left = &mut pulls[..];
        for (shape, layout) in batches.iter().zip(&problem.layout.batches) {
            let (mine, rest) = pulls_left.split_at_mut(layout.factors() * layout.rows);
            pulls_left = rest;
            mine.par_chunks_mut(CHUNK * layout.rows).enumerate().for_each(|(chunk, pulls)| {
                for (index, pulls) in pulls.chunks_exact_mut(layout.rows).enumerate() {
                    let factor = chunk * CHUNK + index;
                    let root = linear.roots[layout.factor_start + factor];
                    let rows = &residuals[layout.residual_start + factor * layout.rows..][..layout.rows];
                    let weight = shape.loss.weight(rows.iter().map(|r| r * r).sum());
                    let scale = if root > 0.0 { -weight / root } else { 0.0 };
                    pulls.iter_mut().zip(rows).for_each(|(pull, residual)| *pull = scale * residual);
                }
            });
        }
        equations.pull(pulls, slope);
    }

    /// The cost around a place of the subspace.
    fn model(
        &self,
        problem: &Problem,
        equations: &NormalEquations,
        metric: &Metric,
        place: &Vector3<f64>,
    ) -> Model {
        let pull = metric.matrix * place;
        let mut model = Model {
            cost: metric.at(place),
            gradient: metric.pull + pull,
            hessian: metric.matrix,
            majorant: metric.matrix,
        };
        for (shape, layout) in self.batches.iter().zip(&problem.layout.batches) {
            let factors = layout.factors();
            let parts: Vec<Model> = (0..factors.div_ceil(CHUNK))
                .into_par_iter()
                .map(|chunk| {
                    let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(factors);
                    self.sum(range, shape.loss, layout, equations, place)
                })
                .collect();
            for part in parts {
                model.cost += part.cost;
                model.gradient += part.gradient;
                model.hessian += part.hessian;
                model.majorant += part.majorant;
            }
        }
        model
    }

    /// What some factors of a batch add.
    fn sum(
        &self,
        factors: std::ops::Range<usize>,
        loss: Loss,
        layout: &super::problem::BatchLayout,
        equations: &NormalEquations,
        place: &Vector3<f64>,
    ) -> Model {
        let linear = &equations.linear;
        let mut sum = LossSum::new(loss);
        let place = [place.x, place.y, place.z];
        let mut gradient = [0.0; MOST];
        // Lower triangles, row by row: with the weights held, and what the loss bends down.
        let (mut held, mut bent) = ([0.0; 6], [0.0; 6]);
        for factor in factors {
            if linear.roots[layout.factor_start + factor] == 0.0 {
                continue;
            }
            let rows = layout.residual_start + factor * layout.rows
                ..layout.residual_start + (factor + 1) * layout.rows;
            let (mut squared, mut slope, mut product) = (0.0, [0.0; MOST], [0.0; 6]);
            for (residual, c) in self.residuals[rows.clone()].iter().zip(&self.changes[rows]) {
                let residual = residual + c[0] * place[0] + c[1] * place[1] + c[2] * place[2];
                squared += residual * residual;
                for k in 0..MOST {
                    slope[k] += c[k] * residual;
                }
                let products = [c[0] * c[0], c[1] * c[0], c[1] * c[1], c[2] * c[0], c[2] * c[1], c[2] * c[2]];
                product.iter_mut().zip(products).for_each(|(product, more)| *product += more);
            }
            let weight = sum.add(squared);
            // ρ' JᵀJ + 2 ρ'' Jᵀr rᵀJ
            let bend = loss.bend(squared, weight);
            let s = slope;
            let slopes = [s[0] * s[0], s[1] * s[0], s[1] * s[1], s[2] * s[0], s[2] * s[1], s[2] * s[2]];
            for k in 0..6 {
                held[k] += weight * product[k];
                bent[k] += bend * slopes[k];
            }
            for k in 0..MOST {
                gradient[k] += weight * slope[k];
            }
        }
        let square = |t: &[f64; 6]| Matrix3::new(t[0], t[1], t[3], t[1], t[2], t[4], t[3], t[4], t[5]);
        let majorant = square(&held);
        Model {
            cost: 0.5 * sum.total(),
            gradient: Vector3::from(gradient),
            hessian: majorant + square(&bent),
            majorant,
        }
    }
}

impl Model {
    /// Newton's step over the first directions; with the weights held where the cost bends down.
    fn shift(&self, count: usize) -> Option<Vector3<f64>> {
        solve(&self.hessian, &self.gradient, count).or_else(|| self.descent(count))
    }

    /// The step with the weights held.
    fn descent(&self, count: usize) -> Option<Vector3<f64>> {
        solve(&self.majorant, &self.gradient, count)
    }
}

/// `−H⁻¹ g` over the first directions; `None` where that is no descent.
fn solve(hessian: &Matrix3<f64>, gradient: &Vector3<f64>, count: usize) -> Option<Vector3<f64>> {
    let (mut hessian, mut gradient) = (*hessian, *gradient);
    // Directions are as long as they are: their own curvature makes them alike. Parallel ones are told apart by a little more.
    let scale = hessian.diagonal().map(|entry| if entry > 0.0 { 1.0 / entry.sqrt() } else { 0.0 });
    for row in 0..MOST {
        if row >= count || scale[row] == 0.0 {
            hessian.row_mut(row).fill(0.0);
            hessian.column_mut(row).fill(0.0);
            hessian[(row, row)] = 1.0;
            gradient[row] = 0.0;
        }
    }
    let unit = |at: usize| if at < count && scale[at] > 0.0 { scale[at] } else { 1.0 };
    let scaled = Matrix3::from_fn(|row, column| {
        unit(row) * hessian[(row, column)] * unit(column) + if row == column { 1e-9 } else { 0.0 }
    });
    let right = Vector3::from_fn(|row, _| -unit(row) * gradient[row]);
    let found = scaled.cholesky()?.solve(&right);
    let shift = Vector3::from_fn(|row, _| unit(row) * found[row]);
    (shift.iter().all(|entry| entry.is_finite()) && shift.dot(&gradient) < 0.0).then_some(shift)
}

#[cfg(test)]
mod tests {
    use super::super::factor::Factor;
    use super::super::minimise::SolverOptions;
    use super::super::parametrisation::VectorSpace;
    use super::super::problem::{Values, Variable};
    use super::*;
    use proptest::prelude::*;
    use std::sync::Arc;

    /// A weighted sum of two variables of the plane was measured.
    struct Sum {
        of: [Variable; 2],
        weights: [f64; 4],
        measured: f64,
    }

    impl Factor for Sum {
        const RESIDUALS: usize = 1;
        type Variables = [Variable; 2];

        fn variables(&self) -> [Variable; 2] {
            self.of
        }

        fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
            let numbers = values.of(self.of[0]).iter().chain(values.of(self.of[1]));
            residual[0] = numbers.zip(&self.weights).map(|(n, w)| n * w).sum::<f64>() - self.measured;
            if let Some(jacobian) = jacobian {
                jacobian.copy_from_slice(&self.weights);
            }
            true
        }
    }

    /// Four variables in a ring, each pair of neighbours measured several times, with outliers.
    fn ring(numbers: &[f64], loss: Loss) -> Problem {
        let mut problem = Problem::new();
        let plane = Arc::new(VectorSpace(2));
        let variables: Vec<_> = (0..4).map(|_| problem.add(&plane, &[0.0, 0.0])).collect();
        let factors = numbers
            .chunks_exact(5)
            .enumerate()
            .map(|(at, n)| Sum {
                of: [variables[at % 4], variables[(at + 1) % 4]],
                weights: [n[0], n[1], n[2], n[3]],
                measured: 4.0 * n[4],
            })
            .collect();
        problem.add_factors(factors, loss).unwrap();
        problem
    }

    proptest! {
        #[test]
        fn a_lengthened_step_keeps_what_it_promises_and_is_no_worse(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 200),
            kind in 0..4_usize,
        ) {
            let loss = [Loss::Cauchy(1.0), Loss::Huber(1.0), Loss::Tukey(9.0), Loss::GemanMcClure(2.0)][kind];
            let damping = 1e-4;
            let problem = ring(&numbers, loss);
            let mut equations = NormalEquations::new(&problem, &SolverOptions::default()).unwrap();
            let cost = equations.linearise(&problem);
            prop_assert!(equations.factorise(damping));
            let right: Vec<f64> = equations.gradient().iter().map(|g| -g).collect();
            let mut step = vec![0.0; right.len()];
            equations.solve(&right, &mut step);
            // Where the problem is linear, so is the cost of a step, but for what damping adds.
            let objective = |equations: &NormalEquations, step: &[f64]| {
                let mut moved = problem.numbers.clone();
                for variable in 0..problem.len() {
                    let range = problem.start[variable]..problem.start[variable + 1];
                    let steps = &step[equations.step_of(variable).unwrap()];
                    moved[range].iter_mut().zip(steps).for_each(|(number, step)| *number += step);
                }
                let damped = step.iter().zip(equations.diagonal()).map(|(s, d)| s * s * d).sum::<f64>();
                problem.cost_at(&moved) + 0.5 * damping * damped
            };
            let plain = objective(&equations, &step);
            let mut subspace = Subspace::new(&problem, &equations).unwrap();
            let mut longer = step.clone();
            let promise = subspace.search(&problem, &mut equations, damping, cost, &mut longer).unwrap();
            let found = objective(&equations, &longer);
            prop_assert!((cost - promise - found).abs() <= 1e-9 * cost, "{cost} - {promise} is not {found}");
            prop_assert!(found <= plain + 1e-9 * cost, "{found} is over {plain}");
        }
    }

    #[test]
    fn least_squares_need_no_search() {
        let numbers: Vec<f64> = (0..200).map(|at| f64::from(at % 7) - 3.0).collect();
        let problem = ring(&numbers, Loss::None);
        let equations = NormalEquations::new(&problem, &SolverOptions::default()).unwrap();
        assert!(Subspace::new(&problem, &equations).is_none());
    }
}
