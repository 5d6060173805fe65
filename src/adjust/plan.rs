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
}

impl Factorisation {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cheapest => "cheapest",
            Self::Dense => "dense",
            Self::Sparse => "sparse",
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

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, choice) in self.choices.iter().enumerate() {
            let mark = if place == self.taken { "->" } else { "  " };
            writeln!(
                f,
                "{mark} eliminate {:<9} ({} variables), factorise {} unknowns {}: {:.1} + {:.1} million multiplications",
                choice.eliminate.name(),
                choice.eliminated,
                choice.reduced,
                choice.factorisation.name(),
                choice.elimination_cost / 1e6,
                choice.factorisation_cost / 1e6,
            )?;
        }
        Ok(())
    }
}
