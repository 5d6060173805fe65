//! Levenberg-Marquardt and dog-leg: from a start to the nearest least cost.

use super::error::Error;
use super::linearisation::Linearisation;
use super::normal_equations::NormalEquations;
use super::plan::{Eliminate, Factorisation, Plan};
use super::problem::{Problem, Variable};
use super::refinement::Refinement;
use super::region::Region;

/// How steps are kept within the trusted region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Optimiser {
    /// `(H + λ diag H) δ = −g`, λ by how well the last step kept its promise.
    #[default]
    LevenbergMarquardt,
    /// Powell's dog-leg between the steepest descent and the Gauss-Newton step, in the norm of `diag H`.
    DogLeg,
}

/// When to stop, and how to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// How steps are found.
    pub optimiser: Optimiser,
    /// Steps tried at most, rejected ones counted.
    pub max_iterations: usize,
    /// Stop when an accepted step lowers the cost by less than this part of it.
    pub function_tolerance: f64,
    /// Stop when no entry of the gradient `Jᵀr` is larger.
    pub gradient_tolerance: f64,
    /// Stop when a step in units of `√diag H` (how far it moves residuals, in sigma) is shorter than this times the root of the number of
    /// unknowns.
    pub step_tolerance: f64,
    /// Stop at this cost, which only data without noise reaches.
    pub cost_tolerance: f64,
    /// Damping at the start, relative to the diagonal.
    pub damping: f64,
    /// What is eliminated before the rest is factorised.
    pub eliminate: Eliminate,
    /// How the rest is factorised.
    pub factorisation: Factorisation,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            optimiser: Optimiser::default(),
            max_iterations: 200,
            function_tolerance: 1e-9,
            gradient_tolerance: 1e-9,
            step_tolerance: 1e-9,
            cost_tolerance: 1e-25,
            damping: 1e-4,
            eliminate: Eliminate::default(),
            factorisation: Factorisation::default(),
        }
    }
}

/// Why an optimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Ending {
    /// The cost no longer falls: `function_tolerance`.
    Cost,
    /// The gradient vanished: `gradient_tolerance`.
    Gradient,
    /// The steps vanished: `step_tolerance`.
    Step,
    /// The cost vanished: `cost_tolerance`, or nothing is free.
    Zero,
    /// `max_iterations` steps were tried.
    #[default]
    Iterations,
    /// No step lowers the cost, however short: what is left is rounding.
    Stuck,
}

impl Ending {
    /// Whether a least cost was reached.
    #[must_use]
    pub fn has_converged(self) -> bool {
        self != Self::Iterations
    }

    /// The ending in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Cost => "converged: the cost no longer falls",
            Self::Gradient => "converged: the gradient vanished",
            Self::Step => "converged: the steps vanished",
            Self::Zero => "converged: no cost is left",
            Self::Iterations => "not converged: the most iterations were made",
            Self::Stuck => "converged: no step lowers the cost",
        }
    }
}

/// One step that was tried.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Step {
    /// Cost before it was tried, or after it if it was taken.
    pub cost: f64,
    /// How far it would lower the cost; negative where it would raise it, minus infinity where there is no cost.
    pub decrease: f64,
    /// Largest entry of the gradient from where it was tried.
    pub gradient_max: f64,
    /// Length of the step over all unknowns, radians and metres together.
    pub step_norm: f64,
    /// Damping λ (Levenberg-Marquardt), or the inverse of the trusted radius (dog-leg).
    pub damping: f64,
    /// Whether it was taken.
    pub accepted: bool,
}

/// How an optimisation went.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Minimum {
    /// Why it ended.
    pub ending: Ending,
    /// Cost at the start.
    pub initial_cost: f64,
    /// Cost at the end.
    pub final_cost: f64,
    /// Every step that was tried; the first entry is the start.
    pub steps: Vec<Step>,
    /// How the steps were solved for.
    pub plan: Plan,
}

/// A step that lowers the cost by less than this part of it is near the end. Before, steps need not be exact, and one that knows the
/// loss would go far, and leave as outliers what weights that are held bring back.
const NEAR: f64 = 1e-3;

/// A step is taken when it keeps at least this part of its promise.
const LEAST_PROMISE: f64 = 1e-4;

/// Moves the variables of a problem to the nearest least cost.
///
/// Steps solve the normal equations by blocks; one set of variables that do not meet in a factor is eliminated first, the one that makes
/// the rest cheapest. What is left is factorised, or solved by conjugate gradients as long as these cost less: far from the end, where
/// steps need not be exact. Levenberg-Marquardt: `λ` shrinks by `max(1/3, 1 − (2ϱ − 1)³)` after a step with gain ratio `ϱ`, and grows by
/// 2, 4, 8, … after steps that were rejected (Nielsen). With a robust loss, steps near the end are found with the loss as it is, not
/// with its weights held, and mended where the way bends. The result has the same bits on any number of threads.
///
/// # Errors
/// [`Error::Start`] when the cost at the start is not finite, [`Error::TooLarge`], [`Error::Option`].
pub fn minimise(problem: &mut Problem, options: &SolverOptions) -> Result<Minimum, Error> {
    minimise_watched(problem, options, &mut |_| true)
}

/// As [`minimise`], telling each step to a watcher, who ends it by giving `false`.
///
/// # Errors
/// Those of [`minimise`].
pub fn minimise_watched(
    problem: &mut Problem,
    options: &SolverOptions,
    watch: &mut dyn FnMut(&Step) -> bool,
) -> Result<Minimum, Error> {
    options.check()?;
    let mut equations = NormalEquations::new(problem, options)?;
    let mut cost = equations.linearise(problem);
    if !cost.is_finite() {
        return Err(Error::Start { found: cost });
    }
    let plan = equations.plan.clone();
    let mut minimum = Minimum { initial_cost: cost, final_cost: cost, plan, ..Minimum::default() };
    minimum.steps.push(Step {
        cost,
        gradient_max: equations.gradient_max(),
        accepted: true,
        ..Step::default()
    });
    if equations.unknowns() == 0 {
        minimum.ending = Ending::Zero;
        return Ok(minimum);
    }
    if let Some(ending) = options.is_done_at(cost, equations.gradient_max()) {
        minimum.ending = ending;
        return Ok(minimum);
    }
    let mut region = Region::new(options, equations.unknowns());
    let mut moved = problem.numbers.clone();
    let mut next = Linearisation::new(problem);
    let is_damped = options.optimiser == Optimiser::LevenbergMarquardt;
    let mut refinement = if is_damped { Refinement::new(problem, &equations) } else { None };
    let mut step = vec![0.0; equations.unknowns()];
    let (mut fresh, mut is_near) = (true, false);
    for _ in 0..options.max_iterations {
        let gradient_max = equations.gradient_max();
        let mut tried = Step { cost, gradient_max, damping: region.damping(), ..Step::default() };
        let mut promise = region.step(problem, &mut equations, fresh, is_near, &mut step);
        let mut refinement = refinement.as_mut();
        if is_near && let (Some(promise), Some(refinement)) = (&mut promise, &mut refinement) {
            *promise =
                refinement.lengthen(problem, &mut equations, region.damping, cost, *promise, &mut step);
        }
        // A step that follows one that was taken is mostly taken as well: what is linear there is made at once.
        let mut is_made = std::mem::replace(&mut fresh, false);
        tried.decrease = f64::NEG_INFINITY;
        let mut size = f64::INFINITY;
        if let Some(promise) = promise {
            // Near the end rounding decides whether the cost falls.
            let rounding = 1e-14 * cost;
            let keeps =
                |decrease: f64, ratio: f64| decrease > 0.0 && (ratio > LEAST_PROMISE || promise <= rounding);
            move_all(problem, &equations, &step, &mut moved);
            let mut there =
                if is_made { problem.linearise(&moved, &mut next) } else { problem.cost_at(&moved) };
            let mut ratio = (cost - there) / promise;
            if is_near && let Some(refinement) = &mut refinement {
                if is_made && there.is_finite() && Refinement::is_crooked(ratio) {
                    there = refinement.settle(problem, &mut moved, &mut next, there);
                    ratio = ((cost - there) / promise).min(Refinement::SETTLED);
                }
                if !keeps(cost - there, ratio)
                    && let Some(promise) = refinement.shorten(&mut step)
                {
                    move_all(problem, &equations, &step, &mut moved);
                    is_made = false;
                    there = problem.cost_at(&moved);
                    ratio = ((cost - there) / promise).min(Refinement::CAUTIOUS);
                }
            }
            tried.decrease = cost - there;
            tried.step_norm = step.iter().map(|s| s * s).sum::<f64>().sqrt();
            size = scaled_norm(&step, equations.diagonal());
            if keeps(tried.decrease, ratio) {
                std::mem::swap(&mut problem.numbers, &mut moved);
                if is_made {
                    equations.take(&mut next);
                } else {
                    equations.linearise(problem);
                }
                cost = there;
                tried.cost = cost;
                tried.accepted = true;
                is_near |= tried.decrease < NEAR * cost;
                region.succeed(ratio, size);
                fresh = true;
            } else {
                region.fail(size);
            }
            refinement.into_iter().for_each(|refinement| refinement.learn(&tried, &step));
            if promise <= rounding && !tried.accepted {
                minimum.steps.push(tried);
                minimum.ending = Ending::Stuck;
                break;
            }
        } else {
            region.fail(f64::INFINITY);
        }
        minimum.steps.push(tried);
        let ending = if tried.accepted {
            let done = options.is_done_at(cost, equations.gradient_max());
            let still = tried.decrease <= options.function_tolerance * cost;
            done.or(still.then_some(Ending::Cost))
        } else {
            region.is_lost().then_some(Ending::Stuck)
        };
        let least_step = options.step_tolerance * (step.len() as f64).sqrt();
        let ending = ending.or((size <= least_step).then_some(Ending::Step));
        if let Some(ending) = ending {
            minimum.ending = ending;
            watch(&tried);
            break;
        }
        if !watch(&tried) {
            break;
        }
    }
    minimum.final_cost = cost;
    Ok(minimum)
}

impl SolverOptions {
    fn check(&self) -> Result<(), Error> {
        let tolerances = [
            ("function_tolerance", self.function_tolerance),
            ("gradient_tolerance", self.gradient_tolerance),
            ("step_tolerance", self.step_tolerance),
            ("cost_tolerance", self.cost_tolerance),
        ];
        for (option, found) in tolerances {
            if !(found >= 0.0 && found.is_finite()) {
                return Err(Error::Option { option, expected: "a number not below zero", found });
            }
        }
        if !(self.damping > 0.0 && self.damping.is_finite()) {
            return Err(Error::Option {
                option: "damping",
                expected: "a number over zero",
                found: self.damping,
            });
        }
        Ok(())
    }

    fn is_done_at(&self, cost: f64, gradient_max: f64) -> Option<Ending> {
        if cost <= self.cost_tolerance {
            Some(Ending::Zero)
        } else if gradient_max <= self.gradient_tolerance {
            Some(Ending::Gradient)
        } else {
            None
        }
    }
}

/// The length of a step in units of `√diag H`.
pub(super) fn scaled_norm(step: &[f64], diagonal: &[f64]) -> f64 {
    step.iter().zip(diagonal).map(|(s, d)| s * s * d).sum::<f64>().sqrt()
}

/// Where all variables are after a step.
fn move_all(problem: &Problem, equations: &NormalEquations, step: &[f64], moved: &mut [f64]) {
    for index in 0..problem.len() {
        let numbers = problem.start[index]..problem.start[index + 1];
        match equations.step_of(index) {
            Some(range) => {
                let variable = Variable(u32::try_from(index).unwrap_or(u32::MAX));
                let space = &problem.spaces[problem.space_of[variable.index()] as usize];
                space.plus(&problem.numbers[numbers.clone()], &step[range], &mut moved[numbers]);
            }
            None => moved[numbers.clone()].copy_from_slice(&problem.numbers[numbers]),
        }
    }
}
