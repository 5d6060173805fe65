//! What is run.

use serde::{Deserialize, Serialize};

use super::Method;
use crate::simulate::noise::NoiseRecipe;

/// What is run: methods, seeds and noise. The sequences are named when it runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Methods, in the order of the columns.
    pub methods: Vec<Method>,
    /// Estimates that stand in the sequences themselves and are evaluated beside the methods, by name.
    pub estimates: Vec<String>,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Noise for what the sequence has without noise, and for depths that it has not at all.
    pub noise: NoiseRecipe,
    /// Whether methods get the measurements as they stand in the sequences: then nothing is drawn, and a seed is that of the
    /// methods alone.
    #[serde(default)]
    pub as_measured: bool,
    /// Whether the bound is computed.
    pub bound: bool,
}
