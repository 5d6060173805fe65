//! How far a depth map may be from the surface.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard deviation of a sensor's depth, `σ(z) = constant + linear z + quadratic z²`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DepthNoise {
    /// What every depth has, metres: half a step of the file's numbers at least.
    pub constant_m: f64,
    /// What grows with the depth, metres per metre: digits of a floating point number.
    pub linear: f64,
    /// What grows with its square, 1/metres: a disparity's steps.
    pub quadratic_per_m: f64,
}

impl DepthNoise {
    /// The standard deviation at a depth, metres.
    #[must_use]
    pub fn sigma_m(&self, depth_m: f64) -> f64 {
        self.constant_m + depth_m * (self.linear + depth_m * self.quadratic_per_m)
    }

    /// The noise with more of what every depth has, metres.
    #[must_use]
    pub fn with_constant(&self, more_m: f64) -> Self {
        Self { constant_m: self.constant_m + more_m, ..*self }
    }
}
