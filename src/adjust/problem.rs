//! A non-linear least-squares problem: variables, and factors over them.

use super::error::Error;
use super::factor::{Batch, Factor, Kind, LinearChunk, MOST_RESIDUALS};
use super::linearisation::Linearisation;
use super::loss::Loss;
use super::parametrisation::{MOST_FREEDOM, Parametrisation};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Factors that are evaluated together; costs are added chunk by chunk, so that the sum does not depend on threads.
const CHUNK: usize = 256;

/// Name of a variable of one [`Problem`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Variable(pub(super) u32);

impl Variable {
    /// Place in the problem's lists.
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Where all variables are.
#[derive(Clone, Copy)]
pub struct Values<'a> {
    pub(super) numbers: &'a [f64],
    pub(super) start: &'a [usize],
}

impl<'a> Values<'a> {
    /// The numbers of a variable, as its parametrisation keeps them.
    #[must_use]
    #[inline]
    pub fn of(&self, variable: Variable) -> &'a [f64] {
        let index = variable.index();
        &self.numbers[self.start[index]..self.start[index + 1]]
    }
}

/// `½ Σ ρ(|r|²)` over variables in their spaces.
#[derive(Default)]
pub struct Problem {
    pub(super) spaces: Vec<Arc<dyn Parametrisation>>,
    pub(super) space_of: Vec<u32>,
    pub(super) start: Vec<usize>,
    pub(super) held: Vec<bool>,
    pub(super) numbers: Vec<f64>,
    pub(super) batches: Vec<Box<dyn Batch>>,
    pub(super) layout: Layout,
}

/// Where the factors' residuals and Jacobians stand in flat arrays.
#[derive(Default)]
pub(super) struct Layout {
    pub(super) batches: Vec<BatchLayout>,
    pub(super) factors: usize,
    pub(super) residuals: usize,
    pub(super) jacobians: usize,
}

/// One batch of the layout.
pub(super) struct BatchLayout {
    pub(super) residual_start: usize,
    pub(super) jacobian_start: usize,
    /// Place of the first factor among all.
    pub(super) factor_start: usize,
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Variables of one factor.
    pub(super) arity: usize,
    /// Variables of all factors, one after the other.
    pub(super) variables: Vec<Variable>,
}

impl BatchLayout {
    /// Factors of the batch.
    pub(super) fn factors(&self) -> usize {
        self.variables.len() / self.arity.max(1)
    }
}

impl Problem {
    /// A problem without variables.
    #[must_use]
    pub fn new() -> Self {
        Self { start: vec![0], ..Self::default() }
    }

    /// Adds a variable that lives in a space; variables of one kind should share the space itself.
    ///
    /// * `numbers` — where it begins, as many numbers as the space has.
    pub fn add<P: Parametrisation + 'static>(&mut self, space: &Arc<P>, numbers: &[f64]) -> Variable {
        debug_assert_eq!(space.numbers(), numbers.len());
        debug_assert!(space.freedom() <= MOST_FREEDOM);
        // Compared by address of the shared space; spaces without fields are one kind wherever they lie.
        let known =
            self.spaces.iter().position(|known| std::ptr::addr_eq(Arc::as_ptr(known), Arc::as_ptr(space)));
        let kind = known.unwrap_or_else(|| {
            self.spaces.push(Arc::<P>::clone(space));
            self.spaces.len() - 1
        });
        let variable = Variable(u32::try_from(self.space_of.len()).unwrap_or(u32::MAX));
        self.space_of.push(u32::try_from(kind).unwrap_or(u32::MAX));
        self.held.push(false);
        self.numbers.extend_from_slice(numbers);
        self.start.push(self.numbers.len());
        variable
    }

    /// Holds a variable where it is.
    pub fn hold(&mut self, variable: Variable) {
        self.held[variable.index()] = true;
    }

    /// Whether a variable is held.
    #[must_use]
    pub fn is_held(&self, variable: Variable) -> bool {
        self.held[variable.index()]
    }

    /// Adds factors of one kind, all with one loss.
    ///
    /// # Errors
    /// [`Error::Factor`] when a factor names a variable twice or one that is not there, or when the variables of two factors have other
    /// degrees of freedom; [`Error::Loss`] for a scale that is not a number over zero.
    pub fn add_factors<F: Factor + 'static>(&mut self, factors: Vec<F>, loss: Loss) -> Result<(), Error> {
        if !loss.is_valid() {
            return Err(Error::Loss { loss });
        }
        if factors.is_empty() {
            return Ok(());
        }
        let wrong = |factor: usize, expected: &'static str| Error::Factor { factor, expected };
        if F::RESIDUALS == 0 || F::RESIDUALS > MOST_RESIDUALS {
            return Err(wrong(0, "1 to 8 numbers of residual"));
        }
        let kind = Kind { factors, loss };
        let mut variables = Vec::new();
        kind.variables(&mut variables);
        let arity = variables.len() / kind.len();
        let mut shape: Option<Vec<usize>> = None;
        for (factor, named) in variables.chunks_exact(arity.max(1)).enumerate() {
            for (place, variable) in named.iter().enumerate() {
                if variable.index() >= self.space_of.len() {
                    return Err(wrong(factor, "variables of this problem"));
                }
                if named[..place].contains(variable) {
                    return Err(wrong(factor, "every variable once"));
                }
            }
            let found: Vec<usize> = named.iter().map(|variable| self.freedom(*variable)).collect();
            match &shape {
                None => shape = Some(found),
                Some(shape) if *shape == found => {}
                Some(_) => {
                    return Err(wrong(factor, "variables of the same spaces in all factors of a kind"));
                }
            }
        }
        let columns: usize = shape.unwrap_or_default().iter().sum();
        let layout = BatchLayout {
            residual_start: self.layout.residuals,
            jacobian_start: self.layout.jacobians,
            factor_start: self.layout.factors,
            rows: F::RESIDUALS,
            columns,
            arity,
            variables,
        };
        self.layout.factors += kind.len();
        self.layout.residuals += kind.len() * F::RESIDUALS;
        self.layout.jacobians += kind.len() * F::RESIDUALS * columns;
        self.layout.batches.push(layout);
        self.batches.push(Box::new(kind));
        Ok(())
    }

    /// Where all variables are.
    #[must_use]
    pub fn values(&self) -> Values<'_> {
        Values { numbers: &self.numbers, start: &self.start }
    }

    /// Degrees of freedom of a variable.
    pub(super) fn freedom(&self, variable: Variable) -> usize {
        self.spaces[self.space_of[variable.index()] as usize].freedom()
    }

    /// Variables.
    #[must_use]
    pub fn len(&self) -> usize {
        self.space_of.len()
    }

    /// Whether there is no variable.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.space_of.is_empty()
    }

    /// The cost `½ Σ ρ` where the variables are; infinite where a factor has no residual.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.cost_at(&self.numbers)
    }

    /// The cost `½ Σ ρ` at some numbers; infinite where a factor has no residual.
    pub(super) fn cost_at(&self, numbers: &[f64]) -> f64 {
        let values = Values { numbers, start: &self.start };
        let mut cost = 0.0;
        for batch in &self.batches {
            let chunks = 0..batch.len().div_ceil(CHUNK);
            let of = |chunk: usize| batch.cost(range_of(chunk, batch.len()), &values);
            cost += chunks.into_par_iter().map(of).collect::<Vec<f64>>().iter().sum::<f64>();
        }
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    /// Linearises every factor at some numbers; gives the cost.
    pub(super) fn linearise(&self, numbers: &[f64], into: &mut Linearisation) -> f64 {
        let values = Values { numbers, start: &self.start };
        let mut cost = 0.0;
        let Linearisation { residuals, jacobians, roots } = into;
        let (mut residuals, mut jacobians, mut roots) =
            (&mut residuals[..], &mut jacobians[..], &mut roots[..]);
        for (batch, layout) in self.batches.iter().zip(&self.layout.batches) {
            let size = layout.rows * layout.columns;
            let (my_residuals, tail) = residuals.split_at_mut(batch.len() * layout.rows);
            residuals = tail;
            let (my_jacobians, tail) = jacobians.split_at_mut(batch.len() * size);
            jacobians = tail;
            let (my_roots, tail) = roots.split_at_mut(batch.len());
            roots = tail;
            if size == 0 {
                continue;
            }
            let costs: Vec<f64> = my_residuals
                .par_chunks_mut(CHUNK * layout.rows)
                .zip(my_jacobians.par_chunks_mut(CHUNK * size))
                .zip(my_roots.par_chunks_mut(CHUNK))
                .enumerate()
                .map(|(chunk, ((residuals, jacobians), roots))| {
                    let into = LinearChunk { residuals, jacobians, roots };
                    batch.linearise(range_of(chunk, batch.len()), &values, into)
                })
                .collect();
            cost += costs.iter().sum::<f64>();
        }
        if cost.is_nan() { f64::INFINITY } else { cost }
    }
}

/// Factors of a chunk.
fn range_of(chunk: usize, factors: usize) -> Range<usize> {
    chunk * CHUNK..((chunk + 1) * CHUNK).min(factors)
}
