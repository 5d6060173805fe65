//! What steps under a robust loss are given besides Levenberg-Marquardt: more length, a way back, and a settling.

use super::elimination::independent_sets;
use super::linearisation::Linearisation;
use super::minimise::Step;
use super::normal_equations::NormalEquations;
use super::problem::Problem;
use super::settle::Settling;
use super::subspace::Subspace;

/// Gain ratio below which the way is crooked, so that variables are to be settled.
const CROOKED: f64 = 0.9;

/// Refines steps near the end.
pub(super) struct Refinement {
    subspace: Subspace,
    settling: Option<Settling>,
    /// The step with the weights held and what it promises, while a longer one is tried.
    plain: Vec<f64>,
    promise: Option<f64>,
}

impl Refinement {
    /// The most that a shortened step tells of the damping: that it is right.
    pub(super) const CAUTIOUS: f64 = 0.5;

    /// The most that a settled step tells of it: that an eighth less may do.
    pub(super) const SETTLED: f64 = 0.75;

    /// For a problem with a robust loss; `None` where all are least squares.
    pub(super) fn new(problem: &Problem, equations: &NormalEquations) -> Option<Self> {
        let subspace = Subspace::new(problem, equations)?;
        let plain = vec![0.0; equations.unknowns()];
        Some(Self { subspace, settling: None, plain, promise: None })
    }

    /// Makes of a step the best that is found from it; gives what it promises.
    ///
    /// * `damping`, `promise` — of the step; `cost` — where it begins.
    pub(super) fn lengthen(
        &mut self,
        problem: &Problem,
        equations: &mut NormalEquations,
        damping: f64,
        cost: f64,
        promise: f64,
        step: &mut [f64],
    ) -> f64 {
        self.plain.copy_from_slice(step);
        let Some(found) = self.subspace.search(problem, equations, damping, cost, step) else {
            step.copy_from_slice(&self.plain);
            self.promise = None;
            return promise;
        };
        self.promise = Some(promise);
        found
    }

    /// Whether variables are to be settled after a step of this gain ratio.
    pub(super) fn is_crooked(ratio: f64) -> bool {
        ratio < CROOKED
    }

    /// Brings variables to their own least cost, where `linear` was made and the cost is `cost`; gives the cost after.
    pub(super) fn settle(
        &mut self,
        problem: &Problem,
        numbers: &mut Vec<f64>,
        linear: &mut Linearisation,
        cost: f64,
    ) -> f64 {
        let settling = self.settling.get_or_insert_with(|| Settling::new(problem, independent_sets(problem)));
        settling.settle(problem, numbers, linear, cost)
    }

    /// Takes a lengthened step back to what it was; gives what that promises, `None` where it was not lengthened.
    pub(super) fn shorten(&mut self, step: &mut [f64]) -> Option<f64> {
        let promise = self.promise.take()?;
        step.copy_from_slice(&self.plain);
        Some(promise)
    }

    /// What became of a step.
    pub(super) fn learn(&mut self, tried: &Step, step: &[f64]) {
        if tried.accepted {
            self.subspace.remember(step);
        } else {
            self.subspace.forget();
        }
    }
}
