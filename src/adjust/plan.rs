//! The plan of a linear solver: which variables go first, and how the rest is factorised.

use std::fmt;

/// What is eliminated before the rest is factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Eliminate {
    /// Whatever costs least.
    #[default]
    Cheapest,
    /// Points and lines: what bundle adjusters do.
    Landmarks,
    /// Poses: cheaper where many frames see few landmarks.
    Poses,
    /// Nothing: all unknowns are factorised at once.
    Nothing,
}

impl Eliminate {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cheapest => "cheapest",
            Self::Landmarks => "landmarks",
            Self::Poses => "poses",
            Self::Nothing => "nothing",
        }
    }
}

/// How the reduced system is factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Factorisation {
    /// Whatever costs least.
    #[default]
    Cheapest,
    /// As a full matrix.
    Dense,
    /// By its non-zero parts, in an order with little fill.
    Sparse,
    /// Not at all: solved by conjugate gradients, preconditioned by its diagonal blocks, as far as is worth it.
    Iterative,
}

impl Factorisation {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cheapest => "cheapest",
            Self::Dense => "dense",
            Self::Sparse => "sparse",
            Self::Iterative => "iterative",
        }
    }
}

/// One way to solve the normal equations, and what it costs by the model: multiplications, weighed by how fast they run.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// What is eliminated.
    pub eliminate: Eliminate,
    /// Variables that are eliminated.
    pub eliminated: usize,
    /// Unknowns of the reduced system.
    pub reduced: usize,
    /// How the reduced system would be factorised.
    pub factorisation: Factorisation,
    /// Cost of the elimination.
    pub elimination_cost: f64,
    /// Cost of the factorisation.
    pub factorisation_cost: f64,
    /// Iterations of conjugate gradients that cost as much: while steps need no more of them, nothing is factorised. None where that
    /// would never be so.
    pub iterations: usize,
    /// Whether the cost of the factorisation is a lower bound: it is more than another way costs, and was not looked at further.
    pub is_bound: bool,
}

impl Choice {
    /// What one step costs.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.elimination_cost + self.factorisation_cost
    }
}

/// What was weighed, and what was taken.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Plan {
    /// The ways that were weighed.
    pub choices: Vec<Choice>,
    /// The place of the one that was taken.
    pub taken: usize,
}

impl Plan {
    /// What was taken.
    pub(super) fn choice(&self) -> &Choice {
        &self.choices[self.taken]
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, choice) in self.choices.iter().enumerate() {
            let mark = if place == self.taken { "->" } else { "  " };
            let Choice { eliminated, reduced, iterations, elimination_cost, factorisation_cost, .. } = choice;
            let (eliminate, millions) = (choice.eliminate.name(), |cost: f64| cost / 1e6);
            write!(
                f,
                "{mark} eliminate {eliminate:<9} ({eliminated} variables), factorise {reduced} unknowns"
            )?;
            if choice.is_bound {
                write!(f, ": {:.1} + at least", millions(*elimination_cost))?;
            } else {
                write!(f, " {}: {:.1} +", choice.factorisation.name(), millions(*elimination_cost))?;
            }
            write!(f, " {:.1} million multiplications", millions(*factorisation_cost))?;
            match iterations {
                0 => writeln!(f)?,
                _ => writeln!(f, ", or up to {iterations} iterations of conjugate gradients")?,
            }
        }
        Ok(())
    }
}
