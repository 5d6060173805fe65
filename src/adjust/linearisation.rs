//! What is linear of all factors at one place: residuals, Jacobians, weights.

use super::problem::Problem;

/// Residuals and Jacobians, weighted by the root of the loss' weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Linearisation {
    pub(super) residuals: Vec<f64>,
    /// Factor by factor, row by row.
    pub(super) jacobians: Vec<f64>,
    /// The root of each factor's weight.
    pub(super) roots: Vec<f64>,
}

impl Linearisation {
    /// Room for the factors of a problem.
    pub(super) fn new(problem: &Problem) -> Self {
        let layout = &problem.layout;
        Self {
            residuals: vec![0.0; layout.residuals],
            jacobians: vec![0.0; layout.jacobians],
            roots: vec![0.0; layout.factors],
        }
    }
}
