//! Normal equations by blocks, and their solution by elimination.

use super::elimination::{Elimination, Incidence, Pair, Place};
use super::error::Error;
use super::linearisation::Linearisation;
use super::minimise::SolverOptions;
use super::parametrisation::MOST_FREEDOM;
use super::plan::Plan;
use super::problem::Problem;
use super::reduced_system::ReducedSystem;
#[cfg(test)]
use nalgebra::DMatrix;
use nalgebra::{SMatrix, SVector, linalg::Cholesky};
use rayon::prelude::*;

/// Variables whose blocks are summed by one task.
const CHUNK: usize = 16;

/// Least and largest entry of the diagonal by which damping is scaled.
const SCALES: [f64; 2] = [1e-6, 1e32];

/// `H δ = −g` for a problem, with `H = JᵀJ` and `g = Jᵀr` of weighted residuals.
pub(super) struct NormalEquations {
    pub(super) structure: Elimination,
    pub(super) system: ReducedSystem,
    /// How it was chosen.
    pub(super) plan: Plan,
    /// First number of each variable's step among all: reduced blocks first, then eliminated ones.
    step_start: Vec<usize>,
    pub(super) linear: Linearisation,
    gradient: Vec<f64>,
    diagonal: Vec<f64>,
    /// Diagonal blocks, row by row: of reduced blocks, then of eliminated ones.
    blocks: Vec<f64>,
    block_start: Vec<usize>,
    /// `W`: a row for each number of the eliminated variable, a column for each of the reduced one.
    ties: Vec<f64>,
    /// `H_ee⁻¹ W`, in the same places.
    solved_ties: Vec<f64>,
    /// `H_ee⁻¹`, row by row, kept for covariances.
    inverses: Vec<f64>,
    column_starts: Vec<usize>,
}

impl NormalEquations {
    /// Room for the normal equations of a problem.
    pub(super) fn new(problem: &Problem, options: &SolverOptions) -> Result<Self, Error> {
        let sizes = 1..=MOST_FREEDOM;
        if let Some(found) = problem.spaces.iter().map(|s| s.freedom()).find(|size| !sizes.contains(size)) {
            return Err(Error::Freedom { most: MOST_FREEDOM, found });
        }
        let (structure, system, plan) = Elimination::new(problem, options)?;
        let sizes = || structure.reduced_sizes.iter().chain(&structure.eliminated_sizes).copied();
        let (mut step_start, mut block_start) = (vec![0], vec![0]);
        for size in sizes() {
            step_start.push(step_start[step_start.len() - 1] + size);
            block_start.push(block_start[block_start.len() - 1] + size * size);
        }
        let unknowns = step_start[step_start.len() - 1];
        let ties = structure.edge_start[structure.edge_start.len() - 1];
        let blocks = block_start[block_start.len() - 1];
        let inverses = blocks - block_start[structure.reduced.len()];
        let column_starts = system.column_starts();
        Ok(Self {
            linear: Linearisation::new(problem),
            gradient: vec![0.0; unknowns],
            diagonal: vec![0.0; unknowns],
            blocks: vec![0.0; blocks],
            block_start,
            ties: vec![0.0; ties],
            solved_ties: vec![0.0; ties],
            inverses: vec![0.0; inverses],
            step_start,
            column_starts,
            structure,
            system,
            plan,
        })
    }

    /// Degrees of freedom of all variables that are not held.
    pub(super) fn unknowns(&self) -> usize {
        self.gradient.len()
    }

    /// Evaluates all factors at the problem's values; gives the cost.
    pub(super) fn linearise(&mut self, problem: &Problem) -> f64 {
        let cost = problem.linearise(&problem.numbers, &mut self.linear);
        if cost.is_finite() {
            self.sum();
        }
        cost
    }

    /// Goes on with what was linearised elsewhere; what was held before is given back in its place.
    pub(super) fn take(&mut self, linear: &mut Linearisation) {
        std::mem::swap(&mut self.linear, linear);
        self.sum();
    }

    /// Sums diagonal blocks, gradient and ties; every sum is made by one task, in the order of the factors.
    fn sum(&mut self) {
        let reduced = self.structure.reduced.len();
        let variables = reduced + self.structure.eliminated.len();
        let Linearisation { residuals, jacobians, .. } = &self.linear;
        let structure = &self.structure;
        let (step_start, block_start) = (&self.step_start, &self.block_start);
        let bounds = chunk_bounds(variables);
        let gradients = split(&mut self.gradient, bounds.iter().map(|at| step_start[*at]));
        let blocks = split(&mut self.blocks, bounds.iter().map(|at| block_start[*at]));
        gradients.into_par_iter().zip(blocks).enumerate().for_each(|(chunk, (gradient, blocks))| {
            let first = bounds[chunk];
            gradient.fill(0.0);
            blocks.fill(0.0);
            for variable in first..bounds[chunk + 1] {
                let incidences = structure.incidences_of(variable);
                let size = step_start[variable + 1] - step_start[variable];
                let gradient = &mut gradient[step_start[variable] - step_start[first]..][..size];
                let block = &mut blocks[block_start[variable] - block_start[first]..][..size * size];
                match size {
                    6 => sum_diagonal::<6>(incidences, residuals, jacobians, gradient, block),
                    4 => sum_diagonal::<4>(incidences, residuals, jacobians, gradient, block),
                    3 => sum_diagonal::<3>(incidences, residuals, jacobians, gradient, block),
                    2 => sum_diagonal::<2>(incidences, residuals, jacobians, gradient, block),
                    5 => sum_diagonal::<5>(incidences, residuals, jacobians, gradient, block),
                    9 => sum_diagonal::<9>(incidences, residuals, jacobians, gradient, block),
                    8 => sum_diagonal::<8>(incidences, residuals, jacobians, gradient, block),
                    7 => sum_diagonal::<7>(incidences, residuals, jacobians, gradient, block),
                    _ => sum_diagonal::<1>(incidences, residuals, jacobians, gradient, block),
                }
            }
        });
        let eliminated = structure.eliminated.len();
        let bounds = chunk_bounds(eliminated);
        let first_number = |at: usize| structure.edge_start[structure.edges.start[at]];
        let ties = split(&mut self.ties, bounds.iter().map(|at| first_number(*at)));
        ties.into_par_iter().enumerate().for_each(|(chunk, ties)| {
            ties.fill(0.0);
            let begin = first_number(bounds[chunk]);
            for at in bounds[chunk]..bounds[chunk + 1] {
                for pair in structure.pairs_of_eliminated.of(at) {
                    let edge = pair.other as usize;
                    let block = structure.edges.items[edge] as usize;
                    let (size, other) = (structure.eliminated_sizes[at], structure.reduced_sizes[block]);
                    let tie = &mut ties[structure.edge_start[edge] - begin..][..size * other];
                    match (size, other) {
                        (3, 6) => add_product::<3, 6>(pair, jacobians, tie),
                        (6, 3) => add_product::<6, 3>(pair, jacobians, tie),
                        (4, 6) => add_product::<4, 6>(pair, jacobians, tie),
                        (6, 4) => add_product::<6, 4>(pair, jacobians, tie),
                        (3, 9) => add_product::<3, 9>(pair, jacobians, tie),
                        _ => add_any_product(pair, jacobians, size, other, tie),
                    }
                }
            }
        });
        for variable in 0..variables {
            let size = step_start[variable + 1] - step_start[variable];
            for k in 0..size {
                self.diagonal[step_start[variable] + k] =
                    self.blocks[block_start[variable] + k * size + k].clamp(SCALES[0], SCALES[1]);
            }
        }
    }

    /// Largest entry of the gradient.
    pub(super) fn gradient_max(&self) -> f64 {
        self.gradient.iter().fold(0.0, |largest, entry| f64::max(largest, entry.abs()))
    }

    /// Factorises `H + damping · diag H`; `false` where that is not positive.
    pub(super) fn factorise(&mut self, damping: f64) -> bool {
        self.eliminate(damping) && {
            self.reduce(damping);
            self.system.factorise()
        }
    }

    /// `H_ee⁻¹` for each eliminated variable, and its products.
    fn eliminate(&mut self, damping: f64) -> bool {
        let structure = &self.structure;
        let reduced = structure.reduced.len();
        let eliminated = structure.eliminated.len();
        let bounds = chunk_bounds(eliminated);
        let (step_start, block_start) = (&self.step_start, &self.block_start);
        let first_number = |at: usize| structure.edge_start[structure.edges.start[at]];
        let first_block = block_start[reduced];
        let solved_ties = split(&mut self.solved_ties, bounds.iter().map(|at| first_number(*at)));
        let inverses =
            split(&mut self.inverses, bounds.iter().map(|at| block_start[reduced + at] - first_block));
        let (blocks, ties, diagonal) = (&self.blocks, &self.ties, &self.diagonal);
        solved_ties
            .into_par_iter()
            .zip(inverses)
            .enumerate()
            .map(|(chunk, (solved_ties, inverses))| {
                let first = bounds[chunk];
                let begin = first_number(first);
                for at in first..bounds[chunk + 1] {
                    let variable = reduced + at;
                    let size = structure.eliminated_sizes[at];
                    let steps = step_start[variable]..step_start[variable + 1];
                    let block = &blocks[block_start[variable]..block_start[variable + 1]];
                    let inverse =
                        &mut inverses[block_start[variable] - block_start[reduced + first]..][..size * size];
                    let diagonal = &diagonal[steps];
                    let positive = match size {
                        6 => invert::<6>(block, diagonal, damping, inverse),
                        4 => invert::<4>(block, diagonal, damping, inverse),
                        3 => invert::<3>(block, diagonal, damping, inverse),
                        2 => invert::<2>(block, diagonal, damping, inverse),
                        5 => invert::<5>(block, diagonal, damping, inverse),
                        9 => invert::<9>(block, diagonal, damping, inverse),
                        8 => invert::<8>(block, diagonal, damping, inverse),
                        7 => invert::<7>(block, diagonal, damping, inverse),
                        _ => invert::<1>(block, diagonal, damping, inverse),
                    };
                    if !positive {
                        return false;
                    }
                    for edge in structure.edges.start[at]..structure.edges.start[at + 1] {
                        let numbers = structure.edge_start[edge]..structure.edge_start[edge + 1];
                        let columns = numbers.len() / size;
                        let solved = &mut solved_ties[numbers.start - begin..numbers.end - begin];
                        match (size, columns) {
                            (3, 6) => multiply_fixed::<3, 6>(inverse, &ties[numbers], solved),
                            (6, 3) => multiply_fixed::<6, 3>(inverse, &ties[numbers], solved),
                            (3, 9) => multiply_fixed::<3, 9>(inverse, &ties[numbers], solved),
                            _ => multiply(inverse, &ties[numbers], size, columns, solved),
                        }
                    }
                }
                true
            })
            .reduce(|| true, |a, b| a && b)
    }

    /// `S = H_rr − Σ W H_ee⁻¹ Wᵀ`: every block column is one task.
    fn reduce(&mut self, damping: f64) {
        let (structure, jacobians) = (&self.structure, &self.linear.jacobians);
        let (blocks, block_start) = (&self.blocks, &self.block_start);
        let (ties, solved_ties, diagonal) = (&self.ties, &self.solved_ties, &self.diagonal);
        let mut values = std::mem::take(&mut self.system.values);
        let system = &self.system;
        let columns = split(&mut values, self.column_starts.iter().copied());
        columns.into_par_iter().enumerate().for_each_init(Vec::new, |local, (column, values)| {
            values.fill(0.0);
            let places = system.places(column, local);
            let size = structure.reduced_sizes[column];
            let block = &blocks[block_start[column]..block_start[column + 1]];
            for c in 0..size {
                let at = places.at(column, c);
                for r in c..size {
                    values[at + r] = block[r * size + c];
                }
                values[at + c] += damping * diagonal[system.start[column] + c];
            }
            for pair in structure.pairs_of_reduced.of(column) {
                let row = pair.other as usize;
                let other = structure.reduced_sizes[row];
                let Incidence { jacobian, rows, columns, column: mine, .. } = pair.incidence;
                for c in 0..size {
                    let target = &mut values[places.at(row, c)..][..other];
                    for k in 0..rows as usize {
                        let line = &jacobians[jacobian + k * columns as usize..];
                        let factor = line[mine as usize + c];
                        for (target, entry) in target.iter_mut().zip(&line[pair.other_column as usize..]) {
                            *target += factor * entry;
                        }
                    }
                }
            }
            for (at, edge) in structure.edges_of_reduced.of(column) {
                let (at, edge) = (*at as usize, *edge as usize);
                if structure.panels.has[at] {
                    continue;
                }
                let inner = structure.eliminated_sizes[at];
                let solved = &solved_ties[structure.edge_start[edge]..structure.edge_start[edge + 1]];
                for other in edge..structure.edges.start[at + 1] {
                    let row = structure.edges.items[other] as usize;
                    let tie = &ties[structure.edge_start[other]..structure.edge_start[other + 1]];
                    let rows = structure.reduced_sizes[row];
                    match (inner, rows, size) {
                        (3, 6, 6) => {
                            subtract::<3, 6, 6>(tie, solved, values, row == column, |c| places.at(row, c));
                        }
                        (6, 3, 3) => {
                            subtract::<6, 3, 3>(tie, solved, values, row == column, |c| places.at(row, c));
                        }
                        (3, 9, 9) => {
                            subtract::<3, 9, 9>(tie, solved, values, row == column, |c| places.at(row, c));
                        }
                        (2, 6, 6) => {
                            subtract::<2, 6, 6>(tie, solved, values, row == column, |c| places.at(row, c));
                        }
                        (4, 6, 6) => {
                            subtract::<4, 6, 6>(tie, solved, values, row == column, |c| places.at(row, c));
                        }
                        _ => {
                            let shape = [inner, rows, size];
                            subtract_any(shape, tie, solved, values, row == column, |c| places.at(row, c));
                        }
                    }
                }
            }
        });
        let Elimination { panels, edges, edge_start, .. } = &mut self.structure;
        let parts = [&self.ties[..], &self.solved_ties[..]];
        panels.subtract(edges, edge_start, parts, &self.system, &mut values, &self.column_starts);
        self.system.values = values;
    }

    /// Solves for a step: `(H + damping diag H) δ = right`; needs [`NormalEquations::factorise`].
    ///
    /// * `right`, `step` — unknowns in the order of the step.
    pub(super) fn solve(&self, right: &[f64], step: &mut [f64]) {
        self.reduce_right(right, step);
        let (reduced, _) = step.split_at_mut(self.system.rows());
        self.system.solve(reduced);
        self.substitute(step);
    }

    /// As [`NormalEquations::solve`], for several right sides at once.
    pub(super) fn solve_all(&self, rights: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let rows = self.system.rows();
        let mut steps: Vec<Vec<f64>> = rights.iter().map(|right| vec![0.0; right.len()]).collect();
        let mut sides = Vec::with_capacity(rows * rights.len());
        for (right, step) in rights.iter().zip(&mut steps) {
            self.reduce_right(right, step);
            sides.extend_from_slice(&step[..rows]);
        }
        self.system.solve(&mut sides);
        for (index, step) in steps.iter_mut().enumerate() {
            step[..rows].copy_from_slice(&sides[index * rows..(index + 1) * rows]);
            self.substitute(step);
        }
        steps
    }

    /// The right side of the reduced system, and `H_ee⁻¹` times that of the eliminated variables.
    fn reduce_right(&self, right: &[f64], step: &mut [f64]) {
        let structure = &self.structure;
        let rows = self.system.rows();
        let reduced = structure.reduced.len();
        let (reduced_step, eliminated_step) = step.split_at_mut(rows);
        let (reduced_right, eliminated_right) = right.split_at(rows);
        let bounds = chunk_bounds(structure.eliminated.len());
        let start = |at: usize| self.step_start[reduced + at] - rows;
        let parts = split(eliminated_step, bounds.iter().map(|at| start(*at)));
        parts.into_par_iter().enumerate().for_each(|(chunk, part)| {
            let first = bounds[chunk];
            for at in first..bounds[chunk + 1] {
                let (begin, size) = (start(at), structure.eliminated_sizes[at]);
                let target = &mut part[begin - start(first)..][..size];
                multiply(self.inverse(at), &eliminated_right[begin..begin + size], size, 1, target);
            }
        });
        let eliminated_step = &*eliminated_step;
        let targets = split(reduced_step, self.system.start.iter().copied());
        targets.into_par_iter().enumerate().with_min_len(CHUNK).for_each(|(column, target)| {
            target.copy_from_slice(&reduced_right[self.system.start[column]..self.system.start[column + 1]]);
            for (at, edge) in structure.edges_of_reduced.of(column) {
                let (at, edge) = (*at as usize, *edge as usize);
                let begin = self.step_start[reduced + at] - rows;
                let tie = &self.ties[structure.edge_start[edge]..structure.edge_start[edge + 1]];
                let size = target.len();
                for (k, solved) in
                    eliminated_step[begin..begin + structure.eliminated_sizes[at]].iter().enumerate()
                {
                    for (target, entry) in target.iter_mut().zip(&tie[k * size..(k + 1) * size]) {
                        *target -= entry * solved;
                    }
                }
            }
        });
    }

    /// Steps of the eliminated variables from those of the reduced ones.
    fn substitute(&self, step: &mut [f64]) {
        let structure = &self.structure;
        let rows = self.system.rows();
        let reduced = structure.reduced.len();
        let (reduced_step, eliminated_step) = step.split_at_mut(rows);
        let reduced_step = &*reduced_step;
        let bounds = chunk_bounds(structure.eliminated.len());
        let start = |at: usize| self.step_start[reduced + at] - rows;
        let parts = split(eliminated_step, bounds.iter().map(|at| start(*at)));
        let substitute = |first: usize, at: usize, part: &mut [f64]| {
            let size = structure.eliminated_sizes[at];
            let begin = start(at) - start(first);
            for edge in structure.edges.start[at]..structure.edges.start[at + 1] {
                let column = structure.edges.items[edge] as usize;
                let moved = &reduced_step[self.system.start[column]..self.system.start[column + 1]];
                let solved = &self.solved_ties[structure.edge_start[edge]..structure.edge_start[edge + 1]];
                for k in 0..size {
                    let line = &solved[k * moved.len()..(k + 1) * moved.len()];
                    let sum: f64 = line.iter().zip(moved).map(|(entry, moved)| entry * moved).sum();
                    part[begin + k] -= sum;
                }
            }
        };
        parts.into_par_iter().enumerate().for_each(|(chunk, part)| {
            (bounds[chunk]..bounds[chunk + 1]).for_each(|at| substitute(bounds[chunk], at, part));
        });
    }

    /// `H_ee⁻¹` of an eliminated variable, row by row, as [`NormalEquations::factorise`] left it.
    pub(super) fn inverse(&self, at: usize) -> &[f64] {
        let reduced = self.structure.reduced.len();
        let first = self.block_start[reduced];
        &self.inverses[self.block_start[reduced + at] - first..self.block_start[reduced + at + 1] - first]
    }

    /// The gradient `Jᵀr`.
    pub(super) fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// The diagonal of `H`, kept away from zero.
    pub(super) fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Where the step of a variable stands; `None` for one that is held.
    pub(super) fn step_of(&self, variable: usize) -> Option<std::ops::Range<usize>> {
        let place = match self.structure.places[variable] {
            Place::Held => return None,
            Place::Reduced(at) => at,
            Place::Eliminated(at) => self.structure.reduced.len() + at,
        };
        Some(self.step_start[place]..self.step_start[place + 1])
    }

    /// `Jᵀ y` for a number `y` of each number of a residual.
    pub(super) fn pull(&self, y: &[f64], into: &mut [f64]) {
        let structure = &self.structure;
        let reduced = structure.reduced.len();
        let variables = reduced + structure.eliminated.len();
        let bounds = chunk_bounds(variables);
        let parts = split(into, bounds.iter().map(|at| self.step_start[*at]));
        parts.into_par_iter().enumerate().for_each(|(chunk, part)| {
            part.fill(0.0);
            let first = bounds[chunk];
            for variable in first..bounds[chunk + 1] {
                let incidences = structure.incidences_of(variable);
                let range = self.step_start[variable]..self.step_start[variable + 1];
                let size = range.len();
                let target = &mut part[range.start - self.step_start[first]..][..size];
                match size {
                    6 => pull_fixed::<6>(incidences, y, &self.linear.jacobians, target),
                    4 => pull_fixed::<4>(incidences, y, &self.linear.jacobians, target),
                    3 => pull_fixed::<3>(incidences, y, &self.linear.jacobians, target),
                    2 => pull_fixed::<2>(incidences, y, &self.linear.jacobians, target),
                    5 => pull_fixed::<5>(incidences, y, &self.linear.jacobians, target),
                    7 => pull_fixed::<7>(incidences, y, &self.linear.jacobians, target),
                    8 => pull_fixed::<8>(incidences, y, &self.linear.jacobians, target),
                    9 => pull_fixed::<9>(incidences, y, &self.linear.jacobians, target),
                    _ => pull_fixed::<1>(incidences, y, &self.linear.jacobians, target),
                }
            }
        });
    }

    /// `|J v|²` for a step `v`.
    pub(super) fn squared_change(&self, problem: &Problem, step: &[f64]) -> f64 {
        let mut sum = 0.0;
        for layout in &problem.layout.batches {
            let count = layout.variables.len() / layout.arity.max(1);
            let parts: Vec<f64> = (0..count.div_ceil(256))
                .into_par_iter()
                .map(|chunk| {
                    let mut sum = 0.0;
                    for factor in chunk * 256..((chunk + 1) * 256).min(count) {
                        let variables = &layout.variables[factor * layout.arity..(factor + 1) * layout.arity];
                        for row in 0..layout.rows {
                            let begin = layout.jacobian_start + (factor * layout.rows + row) * layout.columns;
                            let mut column = begin;
                            let mut change = 0.0;
                            for variable in variables {
                                let size = problem.freedom(*variable);
                                if let Some(range) = self.step_of(variable.index()) {
                                    let line = &self.linear.jacobians[column..column + size];
                                    change += line.iter().zip(&step[range]).map(|(j, s)| j * s).sum::<f64>();
                                }
                                column += size;
                            }
                            sum += change * change;
                        }
                    }
                    sum
                })
                .collect();
            sum += parts.iter().sum::<f64>();
        }
        sum
    }
}

/// Cuts numbers at places, the first of which is 0 and the last their end.
fn split(mut numbers: &mut [f64], bounds: impl IntoIterator<Item = usize>) -> Vec<&mut [f64]> {
    let mut bounds = bounds.into_iter();
    let mut before = bounds.next().unwrap_or(0);
    let mut parts = Vec::new();
    for bound in bounds {
        let (part, rest) = numbers.split_at_mut(bound - before);
        parts.push(part);
        numbers = rest;
        before = bound;
    }
    parts
}

/// `Σ JᵀJ` and `Σ Jᵀr` of one variable.
fn sum_diagonal<const N: usize>(
    incidences: &[Incidence],
    residuals: &[f64],
    jacobians: &[f64],
    gradient: &mut [f64],
    block: &mut [f64],
) {
    let (mut sum, mut side) = ([[0.0; N]; N], [0.0; N]);
    for incidence in incidences {
        let Incidence { jacobian, residual, rows, columns, column } = *incidence;
        for k in 0..rows as usize {
            let from = jacobian + k * columns as usize + column as usize;
            let line: &[f64; N] = jacobians[from..].first_chunk().unwrap_or(&[0.0; N]);
            let r = residuals[residual + k];
            for a in 0..N {
                side[a] += line[a] * r;
                for b in 0..N {
                    sum[a][b] += line[a] * line[b];
                }
            }
        }
    }
    gradient.copy_from_slice(&side);
    block.copy_from_slice(sum.as_flattened());
}

/// Where the chunks of some variables begin, and where the last one ends.
fn chunk_bounds(variables: usize) -> Vec<usize> {
    (0..variables).step_by(CHUNK).chain([variables]).collect()
}

/// `Jᵀ y` of one variable.
fn pull_fixed<const N: usize>(incidences: &[Incidence], y: &[f64], jacobians: &[f64], target: &mut [f64]) {
    let mut sum = [0.0; N];
    for Incidence { jacobian, residual, rows, columns, column } in incidences {
        for k in 0..*rows as usize {
            let from = jacobian + k * *columns as usize + *column as usize;
            let line: &[f64; N] = jacobians[from..].first_chunk().unwrap_or(&[0.0; N]);
            let factor = y[residual + k];
            sum.iter_mut().zip(line).for_each(|(sum, entry)| *sum += entry * factor);
        }
    }
    target.copy_from_slice(&sum);
}

/// Adds `J_eᵀ J_r` of one factor.
fn add_product<const E: usize, const R: usize>(pair: &Pair, jacobians: &[f64], tie: &mut [f64]) {
    let Incidence { jacobian, rows, columns, column, .. } = pair.incidence;
    for k in 0..rows as usize {
        let line = &jacobians[jacobian + k * columns as usize..][..columns as usize];
        let mine: &[f64; E] = line[column as usize..].first_chunk().unwrap_or(&[0.0; E]);
        let other: &[f64; R] = line[pair.other_column as usize..].first_chunk().unwrap_or(&[0.0; R]);
        for a in 0..E {
            for b in 0..R {
                tie[a * R + b] += mine[a] * other[b];
            }
        }
    }
}

fn add_any_product(pair: &Pair, jacobians: &[f64], size: usize, other: usize, tie: &mut [f64]) {
    let Incidence { jacobian, rows, columns, column, .. } = pair.incidence;
    for k in 0..rows as usize {
        let line = &jacobians[jacobian + k * columns as usize..][..columns as usize];
        for a in 0..size {
            let factor = line[column as usize + a];
            let entries = &line[pair.other_column as usize..][..other];
            for (target, entry) in tie[a * other..(a + 1) * other].iter_mut().zip(entries) {
                *target += factor * entry;
            }
        }
    }
}

/// The inverse of a damped block; `false` where it is not positive.
fn invert<const N: usize>(block: &[f64], diagonal: &[f64], damping: f64, inverse: &mut [f64]) -> bool {
    let mut matrix = SMatrix::<f64, N, N>::from_row_slice(block);
    for k in 0..N {
        matrix[(k, k)] += damping * diagonal[k];
    }
    let Some(factor) = Cholesky::new(matrix) else { return false };
    for column in 0..N {
        let mut solution = SVector::<f64, N>::zeros();
        solution[column] = 1.0;
        factor.solve_mut(&mut solution);
        // Symmetric: a column is a row.
        inverse[column * N..(column + 1) * N].copy_from_slice(solution.as_slice());
    }
    inverse.iter().all(|entry| entry.is_finite())
}

/// A square matrix times one with some columns, row by row.
fn multiply(matrix: &[f64], right: &[f64], size: usize, columns: usize, product: &mut [f64]) {
    for a in 0..size {
        for b in 0..columns {
            product[a * columns + b] = (0..size).map(|k| matrix[a * size + k] * right[k * columns + b]).sum();
        }
    }
}

fn multiply_fixed<const E: usize, const R: usize>(matrix: &[f64], right: &[f64], product: &mut [f64]) {
    for a in 0..E {
        let mut line = [0.0; R];
        for k in 0..E {
            let factor = matrix[a * E + k];
            for b in 0..R {
                line[b] += factor * right[k * R + b];
            }
        }
        product[a * R..(a + 1) * R].copy_from_slice(&line);
    }
}

/// Takes `Wᵀ Y` off the block of a row, `Y` of the column.
#[inline]
fn subtract<const E: usize, const R: usize, const C: usize>(
    tie: &[f64],
    solved: &[f64],
    values: &mut [f64],
    diagonal: bool,
    place: impl Fn(usize) -> usize,
) {
    let mut product = [[0.0; R]; C];
    for k in 0..E {
        let line: &[f64; R] = tie[k * R..].first_chunk().unwrap_or(&[0.0; R]);
        let mine: &[f64; C] = solved[k * C..].first_chunk().unwrap_or(&[0.0; C]);
        for c in 0..C {
            for r in 0..R {
                product[c][r] += mine[c] * line[r];
            }
        }
    }
    for (c, product) in product.iter().enumerate() {
        let from = if diagonal { c } else { 0 };
        let begin = place(c);
        for (target, entry) in values[begin + from..begin + R].iter_mut().zip(&product[from..]) {
            *target -= entry;
        }
    }
}

fn subtract_any(
    [inner, rows, columns]: [usize; 3],
    tie: &[f64],
    solved: &[f64],
    values: &mut [f64],
    diagonal: bool,
    place: impl Fn(usize) -> usize,
) {
    for c in 0..columns {
        let begin = place(c);
        let from = if diagonal { c } else { 0 };
        for k in 0..inner {
            let factor = solved[k * columns + c];
            for r in from..rows {
                values[begin + r] -= factor * tie[k * rows + r];
            }
        }
    }
}

/// A dense copy of `H`, for tests of what is done without one.
#[cfg(test)]
pub(super) fn dense_hessian(problem: &Problem, equations: &NormalEquations) -> DMatrix<f64> {
    let unknowns = equations.unknowns();
    let mut dense = DMatrix::zeros(problem.layout.residuals, unknowns);
    for layout in &problem.layout.batches {
        for (factor, variables) in layout.variables.chunks_exact(layout.arity).enumerate() {
            for row in 0..layout.rows {
                let mut column = layout.jacobian_start + (factor * layout.rows + row) * layout.columns;
                for variable in variables {
                    let size = problem.freedom(*variable);
                    if let Some(range) = equations.step_of(variable.index()) {
                        for (k, at) in range.enumerate() {
                            dense[(layout.residual_start + factor * layout.rows + row, at)] =
                                equations.linear.jacobians[column + k];
                        }
                    }
                    column += size;
                }
            }
        }
    }
    dense.transpose() * dense
}
