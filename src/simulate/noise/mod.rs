//! Noise: observations in, measurements out.
//!
//! The registry of the specification (section 4) has the formulas; each is written once more here, as code.

mod complete;
mod depth;
mod measure;
mod model;
mod recipe;

#[cfg(test)]
mod tests;

pub use complete::CompletedDepths;
pub use model::NoiseModel;
pub use recipe::NoiseRecipe;
