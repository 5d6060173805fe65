//! Covariances: parts of the inverse information, without all of it.

use super::error::Error;
use super::minimise::SolverOptions;
use super::normal_equations::NormalEquations;
use super::problem::{Problem, Variable};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Columns that are solved for together.
const COLUMNS: usize = 48;

/// Factorised information of a problem where its variables are.
pub(super) struct Uncertainty {
    equations: NormalEquations,
}

impl Uncertainty {
    /// Factorises the information.
    ///
    /// # Errors
    /// [`Error::Start`] without a cost, [`Error::Singular`] where something is left open.
    pub(super) fn of(problem: &Problem) -> Result<Self, Error> {
        let mut equations = NormalEquations::new(problem, &SolverOptions::default())?;
        let cost = equations.linearise(problem);
        if !cost.is_finite() {
            return Err(Error::Start { found: cost });
        }
        if equations.unknowns() > 0 && !equations.factorise(0.0) {
            return Err(Error::Singular);
        }
        Ok(Self { equations })
    }

    /// Unknowns of all variables.
    pub(super) fn unknowns(&self) -> usize {
        self.equations.unknowns()
    }

    /// Where the unknowns of a variable stand; `None` for one that is held.
    pub(super) fn range(&self, variable: Variable) -> Option<std::ops::Range<usize>> {
        self.equations.step_of(variable.index())
    }

    /// `Σ B` for a matrix `B` of any columns.
    pub(super) fn times(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let columns: Vec<Vec<f64>> =
            (0..right.ncols()).map(|k| right.column(k).iter().copied().collect()).collect();
        let solved: Vec<Vec<f64>> =
            columns.par_chunks(COLUMNS).flat_map_iter(|chunk| self.equations.solve_all(chunk)).collect();
        DMatrix::from_fn(right.nrows(), right.ncols(), |row, column| solved[column][row])
    }

    /// Diagonal blocks of the covariance, one for each variable; zero for one that is held.
    pub(super) fn blocks(&self, problem: &Problem, variables: &[Variable]) -> Vec<DMatrix<f64>> {
        let mut chunks: Vec<&[Variable]> = Vec::new();
        let each = (COLUMNS / 6).max(1);
        chunks.extend(variables.chunks(each));
        chunks
            .into_par_iter()
            .flat_map_iter(|chunk| {
                let mut columns = Vec::new();
                for variable in chunk {
                    for unknown in self.range(*variable).into_iter().flatten() {
                        let mut column = vec![0.0; self.unknowns()];
                        column[unknown] = 1.0;
                        columns.push(column);
                    }
                }
                let mut solved = self.equations.solve_all(&columns).into_iter();
                let blocks: Vec<DMatrix<f64>> = chunk
                    .iter()
                    .map(|variable| {
                        let size = problem.freedom(*variable);
                        let Some(range) = self.range(*variable) else { return DMatrix::zeros(size, size) };
                        let mut block = DMatrix::zeros(size, size);
                        for column in 0..size {
                            let solution = solved.next().unwrap_or_default();
                            for (row, unknown) in range.clone().enumerate() {
                                block[(row, column)] = solution[unknown];
                            }
                        }
                        // Symmetric but for rounding.
                        (&block + block.transpose()) * 0.5
                    })
                    .collect();
                blocks
            })
            .collect()
    }
}
