//! Steps of an optimiser as rows of an estimate.

use super::minimise::Step;
use crate::structure::Iteration;

/// The steps of an optimisation as rows of the estimate of a name.
///
/// * `steps` — every step that was tried, the first entry being the start.
#[must_use]
pub fn iterations(name: &str, steps: &[Step]) -> Vec<Iteration> {
    let rows = (0..).zip(steps).map(|(iteration, step)| Iteration {
        estimate: name.to_owned(),
        iteration,
        cost: step.cost,
        cost_change: (iteration > 0 && step.decrease.is_finite()).then_some(step.decrease),
        gradient_max: step.gradient_max,
        step_norm: (iteration > 0).then_some(step.step_norm),
        damping: step.damping,
        accepted: step.accepted,
    });
    rows.collect()
}
