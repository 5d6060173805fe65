//! The trusted region: how long the steps of Levenberg-Marquardt and dog-leg are.

use super::minimise::{Optimiser, SolverOptions, scaled_norm};
use super::normal_equations::NormalEquations;
use super::problem::Problem;

/// Damping is kept above this, so that what the measurements leave open (a free scale) stays where it is.
const LEAST_DAMPING: f64 = 1e-12;
/// Damping above which no step helps.
const MOST_DAMPING: f64 = 1e16;

/// What is trusted of the linear model.
pub(super) struct Region {
    optimiser: Optimiser,
    pub(super) damping: f64,
    growth: f64,
    radius: f64,
    /// The two steps between which a dog-leg goes.
    newton: Vec<f64>,
    descent: Vec<f64>,
    has_newton: bool,
    right: Vec<f64>,
}

impl Region {
    pub(super) fn new(options: &SolverOptions, unknowns: usize) -> Self {
        let legs = if options.optimiser == Optimiser::DogLeg { unknowns } else { 0 };
        Self {
            optimiser: options.optimiser,
            damping: options.damping,
            growth: 2.0,
            radius: f64::INFINITY,
            newton: vec![0.0; legs],
            descent: vec![0.0; legs],
            has_newton: false,
            right: vec![0.0; unknowns],
        }
    }

    pub(super) fn damping(&self) -> f64 {
        match self.optimiser {
            Optimiser::LevenbergMarquardt => self.damping,
            Optimiser::DogLeg => 1.0 / self.radius,
        }
    }

    /// Finds a step; gives the decrease of the cost that the linear model promises, `None` where there is no step.
    pub(super) fn step(
        &mut self,
        problem: &Problem,
        equations: &mut NormalEquations,
        fresh: bool,
        is_near: bool,
        step: &mut [f64],
    ) -> Option<f64> {
        for (right, gradient) in self.right.iter_mut().zip(equations.gradient()) {
            *right = -gradient;
        }
        match self.optimiser {
            Optimiser::LevenbergMarquardt => {
                if !equations.prepare(self.damping, is_near) || !equations.solve(&self.right, step) {
                    return None;
                }
                let parts = step.iter().zip(equations.gradient()).zip(equations.diagonal());
                // −gᵀδ − ½ δᵀHδ with δᵀHδ = −gᵀδ − λδᵀDδ, which is so of conjugate gradients wherever they stop.
                let promise: f64 = parts.map(|((s, g), d)| 0.5 * s * (self.damping * d * s - g)).sum();
                (promise.is_finite() && promise > 0.0).then_some(promise)
            }
            Optimiser::DogLeg => {
                if fresh || !self.has_newton {
                    self.legs(problem, equations)?;
                }
                self.bend(equations.diagonal(), step);
                let slope: f64 = step.iter().zip(equations.gradient()).map(|(s, g)| s * g).sum();
                let promise = -slope - 0.5 * equations.squared_change(problem, step);
                (promise.is_finite() && promise > 0.0).then_some(promise)
            }
        }
    }

    /// Steepest descent and Gauss-Newton from here; the latter damped as little as it needs to be.
    fn legs(&mut self, problem: &Problem, equations: &mut NormalEquations) -> Option<()> {
        let mut damping = 1e-10;
        while !equations.factorise(damping) {
            damping *= 100.0;
            if damping > 1.0 {
                return None;
            }
        }
        equations.solve(&self.right, &mut self.newton);
        for ((descent, right), diagonal) in self.descent.iter_mut().zip(&self.right).zip(equations.diagonal())
        {
            *descent = right / diagonal;
        }
        let slope: f64 = self.descent.iter().zip(&self.right).map(|(d, r)| d * r).sum();
        let change = equations.squared_change(problem, &self.descent);
        let length = if change > 0.0 { slope / change } else { 0.0 };
        self.descent.iter_mut().for_each(|d| *d *= length);
        self.has_newton = self.newton.iter().chain(&self.descent).all(|entry| entry.is_finite());
        if self.radius.is_infinite() {
            // The first step is trusted as far as Gauss-Newton goes.
            self.radius = scaled_norm(&self.newton, equations.diagonal());
        }
        self.has_newton.then_some(())
    }

    /// The point of the dog-leg at the trusted radius.
    fn bend(&self, diagonal: &[f64], step: &mut [f64]) {
        let newton = scaled_norm(&self.newton, diagonal);
        let descent = scaled_norm(&self.descent, diagonal);
        if newton <= self.radius {
            step.copy_from_slice(&self.newton);
        } else if descent >= self.radius {
            let scale = self.radius / descent;
            step.iter_mut().zip(&self.descent).for_each(|(step, d)| *step = d * scale);
        } else {
            // |descent + t (newton − descent)| = radius
            let (mut a, mut b) = (0.0, 0.0);
            for ((n, d), weight) in self.newton.iter().zip(&self.descent).zip(diagonal) {
                a += weight * (n - d) * (n - d);
                b += weight * d * (n - d);
            }
            let c = descent * descent - self.radius * self.radius;
            let t = if a > 0.0 { -c / (b + (b * b - a * c).max(0.0).sqrt()) } else { 0.0 };
            for ((step, n), d) in step.iter_mut().zip(&self.newton).zip(&self.descent) {
                *step = d + t.clamp(0.0, 1.0) * (n - d);
            }
        }
    }

    /// After a step that was taken: its gain ratio, and its length in units of `√diag H`.
    pub(super) fn succeed(&mut self, ratio: f64, size: f64) {
        let better = 2.0 * ratio - 1.0;
        self.damping = (self.damping * (1.0 - better * better * better).max(1.0 / 3.0)).max(LEAST_DAMPING);
        self.growth = 2.0;
        if ratio > 0.75 {
            self.radius = self.radius.max(3.0 * size);
        } else if ratio < 0.25 {
            self.radius *= 0.5;
        }
    }

    /// After a step that was not.
    pub(super) fn fail(&mut self, size: f64) {
        self.damping *= self.growth;
        self.growth *= 2.0;
        self.radius = 0.25 * self.radius.min(size);
    }

    pub(super) fn is_lost(&self) -> bool {
        match self.optimiser {
            Optimiser::LevenbergMarquardt => self.damping > MOST_DAMPING,
            Optimiser::DogLeg => self.radius < 1e-12 || self.radius.is_nan(),
        }
    }
}
