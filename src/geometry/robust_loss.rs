//! What a residual costs when it may be wrong.

/// A loss over the squared length `s` of a whitened residual block, in squared sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobustLoss {
    /// `ρ(s) = s`.
    Squared,
    /// `ρ(s) = k² ln(1 + s/k²)`: far residuals hardly count.
    Cauchy {
        /// `k`, where doubt begins, sigma.
        sigma: f64,
    },
}

impl RobustLoss {
    /// `ρ(s)` and `ρ'(s)`.
    pub(super) fn at(self, squared: f64) -> [f64; 2] {
        match self {
            Self::Squared => [squared, 1.0],
            Self::Cauchy { sigma } => {
                let scale = sigma * sigma;
                [scale * libm::log1p(squared / scale), 1.0 / (1.0 + squared / scale)]
            }
        }
    }
}
