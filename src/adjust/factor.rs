//! A factor: a residual over variables, and batches of factors of one kind.

use super::loss::{Loss, LossSum};
use super::problem::{Values, Variable};
use std::ops::Range;

/// Most numbers of one residual.
pub const MOST_RESIDUALS: usize = 8;

/// A whitened residual over a few variables, with its Jacobian.
///
/// A user's own factor takes part like the library's own:
///
/// ```
/// use open_structure::adjust::{Factor, Problem, SolverOptions, Values, Variable, VectorSpace, minimise};
/// use std::sync::Arc;
///
/// /// The distance of two points in the plane was measured.
/// struct Distance { ends: [Variable; 2], measured_m: f64, sigma_m: f64 }
///
/// impl Factor for Distance {
///     const RESIDUALS: usize = 1;
///     type Variables = [Variable; 2];
///
///     fn variables(&self) -> [Variable; 2] { self.ends }
///
///     fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
///         let (a, b) = (values.of(self.ends[0]), values.of(self.ends[1]));
///         let (x, y) = (b[0] - a[0], b[1] - a[1]);
///         let distance = x.hypot(y);
///         residual[0] = (distance - self.measured_m) / self.sigma_m;
///         if let Some(jacobian) = jacobian {
///             let (x, y) = (x / distance / self.sigma_m, y / distance / self.sigma_m);
///             jacobian.copy_from_slice(&[-x, -y, x, y]);
///         }
///         distance > 0.0
///     }
/// }
///
/// let plane = Arc::new(VectorSpace(2));
/// let mut problem = Problem::new();
/// let a = problem.add(&plane, &[0.0, 0.0]);
/// let b = problem.add(&plane, &[1.0, 1.0]);
/// problem.hold(a);
/// problem.add_factors(vec![Distance { ends: [a, b], measured_m: 2.0, sigma_m: 0.1 }], Default::default())?;
/// let ending = minimise(&mut problem, &SolverOptions::default())?;
/// assert!(ending.final_cost < 1e-20);
/// # Ok::<(), open_structure::adjust::Error>(())
/// ```
pub trait Factor: Send + Sync {
    /// Numbers of the residual, at most [`MOST_RESIDUALS`].
    const RESIDUALS: usize;

    /// An array of [`Variable`].
    type Variables: AsRef<[Variable]>;

    /// The variables, in the order of the Jacobian's columns; no variable twice.
    fn variables(&self) -> Self::Variables;

    /// The residual in units of sigma, and its derivative by a step of every variable.
    ///
    /// * `values` — where the variables are.
    /// * `residual` — [`Factor::RESIDUALS`] numbers to write.
    /// * `jacobian` — row by row, one column for each degree of freedom of each variable, in their order; all of it is to be written.
    ///
    /// Gives `false` where there is no residual, which ends a step there.
    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool;
}

/// Where what is linear of some factors goes.
pub(super) struct LinearChunk<'a> {
    pub(super) residuals: &'a mut [f64],
    /// Row by row, factor by factor.
    pub(super) jacobians: &'a mut [f64],
    /// By what each factor's residual and Jacobian are multiplied: the root of its weight.
    pub(super) roots: &'a mut [f64],
}

/// Factors of one kind with one loss: the loop over them knows their type.
pub(super) trait Batch: Send + Sync {
    /// Factors.
    fn len(&self) -> usize;
    /// Numbers of one residual.
    fn residuals(&self) -> usize;
    /// Appends the variables of every factor.
    fn variables(&self, into: &mut Vec<Variable>);
    /// Their loss.
    fn loss(&self) -> Loss;
    /// The cost `½ Σ ρ` of a range of factors, infinite where one has no residual.
    fn cost(&self, range: Range<usize>, values: &Values<'_>) -> f64;
    /// Residuals and Jacobians of a range of factors, weighted by the root of the loss' weight; gives the cost as well.
    fn linearise(&self, range: Range<usize>, values: &Values<'_>, into: LinearChunk<'_>) -> f64;
    /// Squared norm of the whitened residual of one factor, before the loss; `None` where there is none.
    fn squared(&self, factor: usize, values: &Values<'_>) -> Option<f64>;
}

/// The factors and their loss.
pub(super) struct Kind<F> {
    pub(super) factors: Vec<F>,
    pub(super) loss: Loss,
}

impl<F: Factor> Batch for Kind<F> {
    fn len(&self) -> usize {
        self.factors.len()
    }

    fn residuals(&self) -> usize {
        F::RESIDUALS
    }

    fn variables(&self, into: &mut Vec<Variable>) {
        for factor in &self.factors {
            into.extend_from_slice(factor.variables().as_ref());
        }
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    fn cost(&self, range: Range<usize>, values: &Values<'_>) -> f64 {
        let mut sum = LossSum::new(self.loss);
        let mut residual = [0.0; MOST_RESIDUALS];
        let residual = &mut residual[..F::RESIDUALS];
        for factor in &self.factors[range] {
            if !factor.evaluate(values, residual, None) {
                return f64::INFINITY;
            }
            sum.add(squared_norm(residual));
        }
        let cost = 0.5 * sum.total();
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    fn linearise(&self, range: Range<usize>, values: &Values<'_>, into: LinearChunk<'_>) -> f64 {
        let LinearChunk { residuals, jacobians, roots } = into;
        let mut sum = LossSum::new(self.loss);
        let size = jacobians.len() / roots.len().max(1);
        let places = residuals.chunks_exact_mut(F::RESIDUALS).zip(jacobians.chunks_exact_mut(size.max(1)));
        for ((factor, root), (residual, jacobian)) in self.factors[range].iter().zip(roots).zip(places) {
            if !factor.evaluate(values, residual, Some(jacobian)) {
                return f64::INFINITY;
            }
            let weight = sum.add(squared_norm(residual));
            *root = weight.sqrt();
            if weight < 1.0 {
                residual.iter_mut().for_each(|r| *r *= *root);
                jacobian.iter_mut().for_each(|j| *j *= *root);
            }
        }
        let cost = 0.5 * sum.total();
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    fn squared(&self, factor: usize, values: &Values<'_>) -> Option<f64> {
        let mut residual = [0.0; MOST_RESIDUALS];
        let residual = &mut residual[..F::RESIDUALS];
        self.factors[factor].evaluate(values, residual, None).then(|| squared_norm(residual))
    }
}

#[inline]
fn squared_norm(residual: &[f64]) -> f64 {
    residual.iter().map(|r| r * r).sum()
}
