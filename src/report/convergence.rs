//! Costs over the steps of optimisers.

use std::path::Path;

use super::error::Error;
use super::input::Input;
use crate::format;
use crate::structure::Iteration;

/// The steps of one optimiser.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Name of the estimate or method.
    pub name: String,
    /// Cost after each step, from the start on, and whether the step was taken; no cost where it is no number.
    pub steps: Vec<(Option<f64>, bool)>,
}

impl Run {
    /// The runs of a sequence, in the order of the table.
    #[must_use]
    pub fn of(iterations: &[Iteration]) -> Vec<Self> {
        iterations
            .chunk_by(|left, right| left.estimate == right.estimate)
            .map(|rows| {
                let mut run = Self { name: rows[0].estimate.clone(), steps: Vec::new() };
                rows.iter().for_each(|row| run.push(Some(row.cost), row.accepted));
                run
            })
            .collect()
    }

    /// The runs of a sequence, or of each sequence in a folder that `os benchmark` wrote, with the name of each.
    ///
    /// # Errors
    /// Those of [`format::open`] and of reading its tables; those of reading results.
    pub fn read(path: &Path) -> Result<Vec<(String, Vec<Self>)>, Error> {
        match Input::of(path)? {
            Input::Sequence => {
                let reader = format::open(path)?;
                Ok(vec![(reader.manifest().name.clone(), Self::of(&reader.table::<Iteration>()?))])
            }
            Input::Results(results) => Ok(results.runs.into_iter().collect()),
        }
    }

    /// Adds a step.
    pub(super) fn push(&mut self, cost: Option<f64>, accepted: bool) {
        self.steps.push((cost, accepted));
    }

    /// Costs at the start and after each step that was taken.
    #[must_use]
    pub fn accepted(&self) -> Vec<f64> {
        self.steps.iter().filter(|(_, accepted)| *accepted).filter_map(|(cost, _)| *cost).collect()
    }
}
