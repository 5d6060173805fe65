//! Normal equations by blocks, and their solution by elimination.

use super::elimination::{Elimination, Place};
use super::error::Error;
use super::iterative_schur::{Exactness, IterativeSchur};
use super::linearisation::Linearisation;
use super::minimise::SolverOptions;
use super::panels::Products;
use super::parametrisation::MOST_FREEDOM;
use super::parts::{AllTrue, Spares, for_each_part, starts};
use super::plan::{Factorisation, Plan};
use super::problem::Problem;
use super::reduced_system::ReducedSystem;
use super::schur::Schur;
use super::small_blocks::{
    add_tie_times, add_tie_transposed_times, dot, invert, pull, sum_diagonal, with_size,
};
use super::tie_sums::TieSums;
use faer::dyn_stack::MemBuffer;
#[cfg(test)]
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Variables whose blocks are summed by one task.
const CHUNK: usize = 16;

/// Least and largest entry of the diagonal by which damping is scaled.
const SCALES: [f64; 2] = [1e-6, 1e32];

/// How exact conjugate gradients are: ten times less, and steps end at other minima than exact ones now and then.
const TOLERANCE: f64 = 0.01;

/// Near the end a factorisation serves for so many solutions.
const NEAR_SHARE: usize = 3;

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
    /// `H_ee⁻¹`, row by row, kept for covariances.
    inverses: Vec<f64>,
    column_starts: Vec<usize>,
    /// Room for tasks that make the reduced system, and for solving with it.
    spares: Spares,
    products: Products,
    sums: TieSums,
    room: MemBuffer,
    /// Conjugate gradients, as long as they are thought to cost less.
    iterative: Option<IterativeSchur>,
    /// How exactly these are to solve.
    exactness: Exactness,
    /// Damping of what was eliminated.
    damping: f64,
    /// Whether the reduced system is factorised.
    is_factorised: bool,
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
        let (step_start, block_start) = (starts(sizes()), starts(sizes().map(|size| size * size)));
        let unknowns = step_start[step_start.len() - 1];
        let ties = structure.edge_start[structure.edge_start.len() - 1];
        let blocks = block_start[block_start.len() - 1];
        let inverses = blocks - block_start[structure.reduced.len()];
        let column_starts = system.column_starts();
        let iterates = plan.choice().iterations > 0;
        let iterative = iterates.then(|| IterativeSchur::new(&structure, &system.start));
        Ok(Self {
            linear: Linearisation::new(problem),
            gradient: vec![0.0; unknowns],
            diagonal: vec![0.0; unknowns],
            blocks: vec![0.0; blocks],
            block_start,
            ties: vec![0.0; ties],
            inverses: vec![0.0; inverses],
            step_start,
            column_starts,
            spares: Spares::default(),
            products: Products::default(),
            sums: TieSums::new(&structure, system.rows()),
            room: system.room(1),
            iterative,
            exactness: Exactness { tolerance: TOLERANCE, most: 0 },
            damping: 0.0,
            is_factorised: false,
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
        let Self { structure, linear, step_start, block_start, gradient, blocks, ties, diagonal, .. } = self;
        let Linearisation { residuals, jacobians, .. } = &*linear;
        let variables = step_start.len() - 1;
        let start = |at: usize| [step_start[at], block_start[at], step_start[at]];
        let arrays = [&mut gradient[..], &mut blocks[..], &mut diagonal[..]];
        for_each_part(0..variables, CHUNK, arrays, &start, &|range, [gradient, blocks, diagonal]| {
            let [first, first_block, _] = start(range.start);
            for variable in range {
                let steps = step_start[variable] - first..step_start[variable + 1] - first;
                let size = steps.len();
                let gradient = &mut gradient[steps.clone()];
                let block = &mut blocks[block_start[variable] - first_block..][..size * size];
                let incidences = structure.incidences_of(variable);
                with_size!(size, sum_diagonal(incidences, residuals, jacobians, gradient, block));
                for (k, entry) in diagonal[steps].iter_mut().enumerate() {
                    *entry = block[k * size + k].clamp(SCALES[0], SCALES[1]);
                }
            }
        });
        let start = |at: usize| [structure.first_tie(at)];
        for_each_part(0..structure.eliminated.len(), CHUNK, [ties], &start, &|range, [ties]| {
            ties.fill(0.0);
            let begin = structure.first_tie(range.start);
            for at in range {
                for pair in structure.pairs_of_eliminated.of(at) {
                    let edge = pair.other as usize;
                    let other = structure.reduced_sizes[structure.edges.items[edge] as usize];
                    let tie = &mut ties[structure.edge_start[edge] - begin..];
                    pair.add_product(jacobians, structure.eliminated_sizes[at], other, tie);
                }
            }
        });
    }

    /// Largest entry of the gradient.
    pub(super) fn gradient_max(&self) -> f64 {
        self.gradient.iter().fold(0.0, |largest, entry| f64::max(largest, entry.abs()))
    }

    /// Factorises `H + damping · diag H`; `false` where that is not positive.
    pub(super) fn factorise(&mut self, damping: f64) -> bool {
        self.damping = damping;
        self.is_factorised = true;
        self.eliminate() && self.factorise_reduced()
    }

    /// Makes ready for steps: as [`NormalEquations::factorise`], or for conjugate gradients where these are thought to cost less.
    ///
    /// * `is_near` — the end is near, and steps are to be better than what is good enough before.
    pub(super) fn prepare(&mut self, damping: f64, is_near: bool) -> bool {
        let Some(mut iterative) = self.iterative.take() else { return self.factorise(damping) };
        self.damping = damping;
        self.is_factorised = false;
        let share = if is_near { NEAR_SHARE } else { 1 };
        self.exactness =
            Exactness { tolerance: TOLERANCE, most: self.plan.choice().iterations.div_ceil(share) };
        let is_positive = self.eliminate() && iterative.prepare(&self.schur());
        self.iterative = Some(iterative);
        is_positive
    }

    /// As [`NormalEquations::prepare`], for conjugate gradients that go on as long as anything is gained.
    #[cfg(test)]
    pub(super) fn prepare_exactly(&mut self, damping: f64) -> bool {
        let is_positive = self.prepare(damping, false);
        self.exactness = Exactness { tolerance: 0.0, most: 20 * self.unknowns() };
        is_positive
    }

    fn factorise_reduced(&mut self) -> bool {
        self.reduce();
        self.system.factorise()
    }

    fn schur(&self) -> Schur<'_> {
        Schur {
            structure: &self.structure,
            start: &self.system.start,
            jacobians: &self.linear.jacobians,
            ties: &self.ties,
            inverses: &self.inverses,
            blocks: &self.blocks,
            block_start: &self.block_start,
            diagonal: &self.diagonal,
            damping: self.damping,
        }
    }

    /// `H_ee⁻¹` for each eliminated variable.
    fn eliminate(&mut self) -> bool {
        let Self { structure, step_start, block_start, inverses, blocks, diagonal, damping, .. } = self;
        let reduced = structure.reduced.len();
        let (all, damping) = (AllTrue::new(), *damping);
        let start = |at: usize| [block_start[reduced + at] - block_start[reduced]];
        for_each_part(0..structure.eliminated.len(), CHUNK, [inverses], &start, &|range, [inverses]| {
            let [first] = start(range.start);
            for at in range {
                let variable = reduced + at;
                let size = structure.eliminated_sizes[at];
                let diagonal = &diagonal[step_start[variable]..step_start[variable + 1]];
                let inverse = &mut inverses[start(at)[0] - first..][..size * size];
                inverse.copy_from_slice(&blocks[block_start[variable]..block_start[variable + 1]]);
                all.and(with_size!(size, invert(diagonal, damping, inverse)));
            }
        });
        all.get()
    }

    /// `S = H_rr − Σ W H_ee⁻¹ Wᵀ`: every block column is one task.
    fn reduce(&mut self) {
        let mut values = std::mem::take(&mut self.system.values);
        let (schur, system) = (self.schur(), &self.system);
        let start = |column: usize| [self.column_starts[column]];
        for_each_part(0..self.structure.reduced.len(), 1, [&mut values], &start, &|range, [values]| {
            self.spares.lend(|local| schur.sum_column(system, range.start, local, values));
        });
        let mut products = std::mem::take(&mut self.products);
        self.structure.panels.subtract(
            &self.schur(),
            &self.system,
            &mut products,
            &mut values,
            &self.column_starts,
        );
        self.products = products;
        self.system.values = values;
    }

    /// Solves for a step: `(H + damping diag H) δ = right`; needs [`NormalEquations::factorise`] or [`NormalEquations::prepare`].
    ///
    /// Where conjugate gradients take too long, the system is factorised after all, now and for all steps that follow; `false` where it
    /// cannot be.
    ///
    /// * `right`, `step` — unknowns in the order of the step.
    pub(super) fn solve(&mut self, right: &[f64], step: &mut [f64]) -> bool {
        let rows = self.system.rows();
        let mut sums = std::mem::take(&mut self.sums);
        self.reduce_right(right, &mut sums, step);
        if !self.is_factorised
            && let Some(mut iterative) = self.iterative.take()
        {
            let is_solved = iterative.solve(&self.schur(), &mut sums, self.exactness, &mut step[..rows]);
            if is_solved || self.plan.choice().factorisation == Factorisation::Iterative {
                self.iterative = Some(iterative);
            } else {
                self.is_factorised = true;
                if !self.factorise_reduced() {
                    return false;
                }
                self.reduce_right(right, &mut sums, step);
            }
        }
        self.sums = sums;
        if self.is_factorised {
            self.system.solve(&mut step[..rows], &mut self.room);
        }
        self.substitute(step);
        true
    }

    /// As [`NormalEquations::solve`], for several right sides at once.
    pub(super) fn solve_all(&self, rights: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let rows = self.system.rows();
        let mut steps: Vec<Vec<f64>> = rights.iter().map(|right| vec![0.0; right.len()]).collect();
        let mut sides = Vec::with_capacity(rows * rights.len());
        let mut sums = TieSums::new(&self.structure, rows);
        for (right, step) in rights.iter().zip(&mut steps) {
            self.reduce_right(right, &mut sums, step);
            sides.extend_from_slice(&step[..rows]);
        }
        self.system.solve(&mut sides, &mut self.system.room(rights.len()));
        for (index, step) in steps.iter_mut().enumerate() {
            step[..rows].copy_from_slice(&sides[index * rows..(index + 1) * rows]);
            self.substitute(step);
        }
        steps
    }

    /// The right side of the reduced system, and `H_ee⁻¹` times that of the eliminated variables.
    fn reduce_right(&self, right: &[f64], sums: &mut TieSums, step: &mut [f64]) {
        let structure = &self.structure;
        let rows = self.system.rows();
        let (reduced_step, eliminated_step) = step.split_at_mut(rows);
        let (reduced_right, eliminated_right) = right.split_at(rows);
        let eliminated = 0..structure.eliminated.len();
        let start = |at: usize| [self.eliminated_start(at)];
        for_each_part(eliminated, CHUNK, [&mut *eliminated_step], &start, &|range, [part]| {
            let first = self.eliminated_start(range.start);
            for at in range {
                let (begin, size) = (self.eliminated_start(at), structure.eliminated_sizes[at]);
                let sides = &eliminated_right[begin..begin + size];
                for (target, line) in
                    part[begin - first..].iter_mut().zip(self.inverse(at).chunks_exact(size))
                {
                    *target = dot(line, sides);
                }
            }
        });
        let eliminated_step = &*eliminated_step;
        sums.collect(&|at, sum| {
            let solved = &eliminated_step[self.eliminated_start(at)..][..structure.eliminated_sizes[at]];
            for edge in structure.edges.start[at]..structure.edges.start[at + 1] {
                let block = structure.edges.items[edge] as usize;
                let target = &mut sum[self.system.start[block]..self.system.start[block + 1]];
                add_tie_transposed_times(&self.ties[structure.numbers_of(edge)], solved, target);
            }
        });
        for (row, (target, side)) in reduced_step.iter_mut().zip(reduced_right).enumerate() {
            *target = side - sums.total(row);
        }
    }

    /// Steps of the eliminated variables from those of the reduced ones.
    fn substitute(&self, step: &mut [f64]) {
        let structure = &self.structure;
        let (reduced_step, eliminated_step) = step.split_at_mut(self.system.rows());
        let reduced_step = &*reduced_step;
        let start = |at: usize| [self.eliminated_start(at)];
        for_each_part(0..structure.eliminated.len(), CHUNK, [eliminated_step], &start, &|range, [part]| {
            let first = self.eliminated_start(range.start);
            for at in range {
                let size = structure.eliminated_sizes[at];
                let mut tied = [0.0; MOST_FREEDOM];
                let tied = &mut tied[..size];
                for edge in structure.edges.start[at]..structure.edges.start[at + 1] {
                    let block = structure.edges.items[edge] as usize;
                    let moved = &reduced_step[self.system.start[block]..self.system.start[block + 1]];
                    add_tie_times(&self.ties[structure.numbers_of(edge)], moved, tied);
                }
                let target = &mut part[self.eliminated_start(at) - first..][..size];
                for (target, line) in target.iter_mut().zip(self.inverse(at).chunks_exact(size)) {
                    *target -= dot(line, tied);
                }
            }
        });
    }

    /// Where the step of an eliminated variable begins among those of all.
    fn eliminated_start(&self, at: usize) -> usize {
        self.step_start[self.structure.reduced.len() + at] - self.system.rows()
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
        let start = |variable: usize| [self.step_start[variable]];
        for_each_part(0..self.step_start.len() - 1, CHUNK, [into], &start, &|range, [part]| {
            let first = self.step_start[range.start];
            for variable in range {
                let incidences = self.structure.incidences_of(variable);
                let steps = self.step_start[variable] - first..self.step_start[variable + 1] - first;
                let target = &mut part[steps];
                with_size!(target.len(), pull(incidences, y, &self.linear.jacobians, target));
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
