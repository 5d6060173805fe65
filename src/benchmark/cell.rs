//! One method on one sequence with one seed.

use serde::{Deserialize, Serialize};

/// Which cell.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CellKey {
    /// Name of the sequence.
    pub sequence: String,
    /// Name of the method, or of an estimate of the sequence.
    pub method: String,
    /// Seed of noise and samples.
    pub seed: u64,
}

/// What came out of a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Which cell.
    #[serde(flatten)]
    pub key: CellKey,
    /// Errors, or why there are none.
    pub outcome: Outcome,
    /// Wall time of the method alone, seconds; it does not count what the method begins with.
    pub seconds: f64,
    /// Cost over the iterations of an optimiser.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<CurvePoint>,
}

/// Errors of a cell, or why there are none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// There is an estimate.
    Estimated {
        /// Absolute error of translation after SE(3) alignment: root mean square, metres.
        ape_rmse_m: f64,
        /// The same, median, metres.
        ape_median_m: f64,
        /// Absolute error of translation after Sim(3) alignment: root mean square, metres.
        ape_sim3_rmse_m: f64,
        /// Relative error of rotation, delta 1 frame: root mean square, degrees.
        rpe_rotation_rmse_deg: f64,
        /// The same, median, degrees.
        rpe_rotation_median_deg: f64,
        /// Frames with a pose.
        frames: usize,
        /// Frames whose pose no measurement supports.
        predicted: usize,
        /// Iterations of an optimiser.
        iterations: Option<usize>,
        /// Its last cost.
        cost: Option<f64>,
        /// How an optimiser ended.
        ending: Option<String>,
    },
    /// The method gave none.
    Failed {
        /// Why.
        reason: String,
    },
}

/// The cost after an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Iteration, from 0.
    pub iteration: i64,
    /// Half the sum of the robust squared whitened residuals.
    pub cost: f64,
    /// Whether the step was taken.
    pub accepted: bool,
}
