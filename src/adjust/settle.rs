//! Variables that do not meet in a factor, each brought to its own least cost while the others stay.

use super::elimination::{Incidence, Lists, for_each_factor};
use super::linearisation::Linearisation;
use super::parametrisation::MOST_FREEDOM;
use super::problem::{Problem, Values};
use super::small_blocks::with_size;
use nalgebra::{SMatrix, SVector, linalg::Cholesky};
use rayon::prelude::*;

/// Damping of a variable's own step, relative to the diagonal.
const DAMPING: f64 = 1e-6;

/// Variables that one task moves.
const CHUNK: usize = 16;

/// One factor of a variable.
#[derive(Clone, Copy)]
struct Share {
    batch: u32,
    factor: u32,
    incidence: Incidence,
}

/// Where a long step bends the way, poses and landmarks are off from each other to the second order; one step of each alone, with the
/// others held, mends that at the price of a linearisation. No variable is moved that would not lower its own cost by it.
pub(super) struct Settling {
    /// Variables of each kind that may move at once, with their factors.
    sets: Vec<Set>,
    moved: Vec<f64>,
}

struct Set {
    variables: Vec<u32>,
    shares: Lists<Share>,
    /// A step of each variable, and whether it is kept.
    found: Vec<Option<[f64; MOST_FREEDOM]>>,
    keep: Vec<bool>,
}

impl Settling {
    /// For the sets of variables that may move at once.
    pub(super) fn new(problem: &Problem, sets: Vec<Vec<bool>>) -> Self {
        let sets =
            sets.into_iter().map(|set| Set::new(problem, &set)).filter(|set| !set.variables.is_empty());
        Self { sets: sets.collect(), moved: vec![0.0; problem.numbers.len()] }
    }

    /// Settles the variables at some numbers, where `linear` was made; gives the cost there and leaves `linear` made anew.
    pub(super) fn settle(
        &mut self,
        problem: &Problem,
        numbers: &mut Vec<f64>,
        linear: &mut Linearisation,
        mut cost: f64,
    ) -> f64 {
        for set in &mut self.sets {
            self.moved.copy_from_slice(numbers);
            set.step(problem, numbers, linear, &mut self.moved);
            let found = problem.linearise(&self.moved, linear);
            std::mem::swap(numbers, &mut self.moved);
            cost = found;
        }
        cost
    }
}

impl Set {
    fn new(problem: &Problem, set: &[bool]) -> Self {
        let mut owner = vec![usize::MAX; problem.len()];
        let mut variables = Vec::new();
        for variable in (0..problem.len()).filter(|v| set[*v] && !problem.held[*v]) {
            owner[variable] = variables.len();
            variables.push(u32::try_from(variable).unwrap_or(u32::MAX));
        }
        let mut pairs = Vec::new();
        let mut counts =
            problem.layout.batches.iter().map(|layout| layout.variables.len() / layout.arity.max(1));
        let (mut batch, mut factor, mut left) = (0, 0, counts.next().unwrap_or(0));
        for_each_factor(problem, |named| {
            while left == 0 {
                batch += 1;
                factor = 0;
                left = counts.next().unwrap_or(usize::MAX);
            }
            for (variable, incidence) in named {
                if owner[*variable] != usize::MAX {
                    pairs.push((owner[*variable], Share { batch, factor, incidence: *incidence }));
                }
            }
            left -= 1;
            factor += 1;
        });
        let shares = Lists::gather(variables.len(), &pairs);
        Self { shares, variables, found: Vec::new(), keep: Vec::new() }
    }

    /// One step of each variable, into `moved` where it lowers its cost.
    fn step(&mut self, problem: &Problem, numbers: &[f64], linear: &Linearisation, moved: &mut [f64]) {
        let Self { variables, shares, found, keep } = self;
        let all = || (0..variables.len()).into_par_iter().with_min_len(CHUNK);
        let step = |at: usize| {
            let freedom = problem.spaces[problem.space_of[variables[at] as usize] as usize].freedom();
            with_size!(freedom, own_step(shares.of(at), linear))
        };
        all().map(step).collect_into_vec(found);
        for (variable, step) in variables.iter().zip(&*found) {
            let variable = *variable as usize;
            if let Some(step) = step {
                let range = problem.start[variable]..problem.start[variable + 1];
                let space = &problem.spaces[problem.space_of[variable] as usize];
                space.plus(&numbers[range.clone()], &step[..space.freedom()], &mut moved[range]);
            }
        }
        let (before, after) =
            (Values { numbers, start: &problem.start }, Values { numbers: moved, start: &problem.start });
        let is_better = |at: usize| {
            let cost = |values: &Values<'_>| -> Option<f64> {
                let mut cost = 0.0;
                for share in shares.of(at) {
                    let batch = &problem.batches[share.batch as usize];
                    cost += batch.loss().evaluate(batch.squared(share.factor as usize, values)?).0;
                }
                Some(cost)
            };
            found[at].is_some()
                && matches!((cost(&before), cost(&after)), (Some(before), Some(after)) if after < before)
        };
        all().map(is_better).collect_into_vec(keep);
        for (variable, keep) in variables.iter().zip(&*keep) {
            if !keep {
                let range = problem.start[*variable as usize]..problem.start[*variable as usize + 1];
                moved[range.clone()].copy_from_slice(&numbers[range]);
            }
        }
    }
}

/// The Gauss-Newton step of one variable alone.
fn own_step<const N: usize>(shares: &[Share], linear: &Linearisation) -> Option<[f64; MOST_FREEDOM]> {
    let (mut hessian, mut gradient) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for Share { incidence, .. } in shares {
        for k in 0..incidence.rows as usize {
            let from = incidence.jacobian + k * incidence.columns as usize + incidence.column as usize;
            let line = SVector::<f64, N>::from_column_slice(&linear.jacobians[from..from + N]);
            gradient += line * linear.residuals[incidence.residual + k];
            hessian += line * line.transpose();
        }
    }
    for k in 0..N {
        hessian[(k, k)] += DAMPING * hessian[(k, k)];
    }
    let step = -Cholesky::new(hessian)?.solve(&gradient);
    let mut found = [0.0; MOST_FREEDOM];
    found[..N].copy_from_slice(step.as_slice());
    step.iter().all(|entry| entry.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::super::elimination::independent_sets;
    use super::super::factor::Factor;
    use super::super::loss::Loss;
    use super::super::parametrisation::VectorSpace;
    use super::super::problem::Variable;
    use super::*;
    use proptest::prelude::*;
    use std::sync::Arc;

    /// The product of two numbers was measured.
    struct Product {
        of: [Variable; 2],
        measured: f64,
    }

    impl Factor for Product {
        const RESIDUALS: usize = 1;
        type Variables = [Variable; 2];

        fn variables(&self) -> [Variable; 2] {
            self.of
        }

        fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
            let (a, b) = (values.of(self.of[0])[0], values.of(self.of[1])[0]);
            residual[0] = a * b - self.measured;
            if let Some(jacobian) = jacobian {
                jacobian.copy_from_slice(&[b, a]);
            }
            true
        }
    }

    proptest! {
        #[test]
        fn settling_never_costs_and_leaves_what_is_linear_there(
            numbers in proptest::collection::vec(-3.0..3.0_f64, 8),
            measured in proptest::collection::vec(-3.0..3.0_f64, 16),
        ) {
            let mut problem = Problem::new();
            let (rows, columns) = (Arc::new(VectorSpace(1)), Arc::new(VectorSpace(1)));
            let a: Vec<_> = numbers[..4].iter().map(|number| problem.add(&rows, &[*number])).collect();
            let b: Vec<_> = numbers[4..].iter().map(|number| problem.add(&columns, &[*number])).collect();
            let factors = measured
                .iter()
                .enumerate()
                .map(|(at, measured)| Product { of: [a[at / 4], b[at % 4]], measured: *measured })
                .collect();
            problem.add_factors(factors, Loss::Cauchy(1.0)).unwrap();
            let mut linear = Linearisation::new(&problem);
            let mut moved = problem.numbers.clone();
            let before = problem.linearise(&moved, &mut linear);
            let mut settling = Settling::new(&problem, independent_sets(&problem));
            let after = settling.settle(&problem, &mut moved, &mut linear, before);
            prop_assert!(after <= before * (1.0 + 1e-12), "{after} after {before}");
            prop_assert!((problem.cost_at(&moved) - after).abs() <= 1e-12 * before);
            let mut anew = Linearisation::new(&problem);
            problem.linearise(&moved, &mut anew);
            prop_assert_eq!(anew.residuals, linear.residuals);
        }
    }
}
