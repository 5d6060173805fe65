//! The steps of an optimiser.

use super::record::record;

record! {
    /// One step of an optimiser; iteration 0 is the start.
    pub struct Iteration in iterations (Whole, Optional, key: [estimate, iteration]) {
        /// Name of the estimate, shared with `trajectories`.
        ["1", "-"]
        estimate: String,
        /// Number of the step, from 0.
        ["1", "-"]
        iteration: i64,
        /// Half the sum of the (robust) squared whitened residuals after the step.
        ["1", "-"]
        cost: f64,
        /// How much the step lowered the cost; negative for a step that was refused; absent at the start.
        ["1", "-"]
        cost_change: Option<f64>,
        /// Largest component of the gradient at the iterate.
        ["1", "-"]
        gradient_max: f64,
        /// Length of the step over all tangents; absent at the start.
        ["1", "-"]
        step_norm: Option<f64>,
        /// Damping of Levenberg-Marquardt, or the radius of a trust region, with which the step was made.
        ["1", "-"]
        damping: f64,
        /// Whether the step was taken.
        ["1", "-"]
        accepted: bool,
    }
}
