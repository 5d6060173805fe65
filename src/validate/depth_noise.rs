//! How depth noise is declared, and how a residual shows it.

use super::mix::mix;

/// How depth noise is declared, and how a residual shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DepthNoise {
    /// `d = d̂ + α`, sigma in metres.
    Metres(f64),
    /// The paper's: `d = m / (m/(d̂ + α) + 0.5)`, all in centimetres.
    Paper {
        /// The constant m.
        m: f64,
        /// Sigma of α, centimetres.
        sigma_cm: f64,
    },
    /// Of Kinect disparities: `d = m / ⌊m/d̂ + α + 0.5⌋`, in centimetres.
    Disparity {
        /// The constant m.
        m: f64,
        /// Sigma of α, steps of disparity.
        sigma: f64,
    },
}

impl DepthNoise {
    /// The noise that makes the measured depth of the true one (both metres), in the unit of sigma.
    ///
    /// Rounded disparities do not show their noise, only an interval in which it was. There one is drawn as
    /// the declared noise would be: if it is declared rightly, the result is normal with its sigma, whatever
    /// the true disparities, and if not, it is not.
    pub(crate) fn residual(self, measured: f64, truth: f64) -> f64 {
        match self {
            Self::Metres(_) => measured - truth,
            Self::Paper { m, .. } => m / (m / (100.0 * measured) - 0.5) - 100.0 * truth,
            Self::Disparity { m, sigma } => {
                let off = m / (100.0 * measured) - m / (100.0 * truth);
                let bits = mix(measured.to_bits() ^ mix(truth.to_bits()));
                let part = ((bits >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
                drawn_between(off - 0.5, off + 0.5, sigma, part)
            }
        }
    }

    pub(crate) const fn sigma(self) -> f64 {
        match self {
            Self::Metres(sigma) | Self::Paper { sigma_cm: sigma, .. } | Self::Disparity { sigma, .. } => {
                sigma
            }
        }
    }

    /// Sigma at a depth, both metres.
    pub(crate) fn sigma_m(self, depth: f64) -> f64 {
        match self {
            Self::Metres(sigma) => sigma,
            Self::Paper { sigma_cm, .. } => 0.01 * sigma_cm,
            Self::Disparity { m, sigma } => 100.0 * depth * depth / m * sigma,
        }
    }

    /// What rounded poses and landmarks add, in the unit of sigma: a millimetre, and for disparities what a
    /// millimetre is at four metres.
    pub(crate) const fn least_sigma(self) -> f64 {
        match self {
            Self::Metres(_) | Self::Paper { .. } => 1e-3,
            Self::Disparity { .. } => 0.02,
        }
    }

    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::Metres(_) => "m",
            Self::Paper { .. } => "cm (of α)",
            Self::Disparity { .. } => "steps of disparity",
        }
    }
}

/// A number of `N(0, σ²)` between two limits: where the distribution has passed a part of what lies between.
fn drawn_between(low: f64, high: f64, sigma: f64, part: f64) -> f64 {
    if !(low.is_finite() && high.is_finite()) {
        return f64::NAN;
    }
    // In the lower tail the distribution function is exact.
    if low > 0.0 {
        return -drawn_between(-high, -low, sigma, part);
    }
    let nearest = high.min(0.0);
    let [first, last] = [low, high].map(|limit| below(limit / sigma));
    let target = first + part * (last - first);
    // No noise of this sigma comes here.
    if sigma <= 0.0 || target.is_nan() || last - first < 1e-300 {
        return nearest;
    }
    sigma * bisect((low / sigma).max(-40.0), (high / sigma).min(40.0), |z| below(z) - target)
}

/// The standard normal distribution function.
pub(crate) fn below(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// Where a rising function is zero.
pub(crate) fn bisect(mut low: f64, mut high: f64, function: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..45 {
        let middle = 0.5 * (low + high);
        if function(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number of the standard normal distribution for each index.
    fn normal(index: u64) -> f64 {
        let part = ((mix(index) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
        bisect(-9.0, 9.0, |z| below(z) - part)
    }

    /// Mean and sigma of the residuals of disparities that lie on `phases` places between two steps.
    fn residuals(actual: f64, declared: f64, phases: u64) -> (f64, f64) {
        const COUNT: u64 = 40_000;
        let noise = DepthNoise::Disparity { m: 35130.0, sigma: declared };
        let found: Vec<f64> = (0..COUNT)
            .map(|index| {
                let steps = 150.25 + (index % phases) as f64 / phases as f64 + 1e-9 * index as f64;
                let measured = (steps + actual * normal(index) + 0.5).floor();
                noise.residual(351.3 / measured, 351.3 / steps)
            })
            .collect();
        let mean = found.iter().sum::<f64>() / COUNT as f64;
        let variance = found.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / COUNT as f64;
        (mean, variance.sqrt())
    }

    #[test]
    fn residuals_of_disparities_have_the_declared_sigma_whatever_the_true_disparities() {
        for sigma in [1.0 / 6.0, 0.5, 3.0] {
            for phases in [1, 2, 1000] {
                let (mean, found) = residuals(sigma, sigma, phases);
                // Five standard errors: sigma/√n and sigma/√(2n).
                assert!(mean.abs() < 5.0 * sigma / 200.0, "{sigma} {phases}: mean {mean}");
                assert!((found - sigma).abs() < 5.0 * sigma / 282.8, "{sigma} {phases}: {found}");
            }
        }
    }

    #[test]
    fn a_wrongly_declared_sigma_of_disparities_shows() {
        for (actual, declared) in [(1.0 / 6.0, 0.4), (0.4, 1.0 / 6.0), (1.0, 2.0), (2.0, 1.0)] {
            let (_, found) = residuals(actual, declared, 1000);
            assert!((found / declared - 1.0).abs() > 0.15, "{actual} {declared}: {found}");
        }
    }

    #[test]
    fn a_disparity_that_no_noise_explains_is_as_far_as_it_is() {
        let noise = DepthNoise::Disparity { m: 35130.0, sigma: 0.1 };
        assert!((noise.residual(351.3 / 160.0, 351.3 / 100.0) - 59.5).abs() < 1e-9);
        assert!((noise.residual(351.3 / 100.0, 351.3 / 160.0) + 59.5).abs() < 1e-9);
        let exact = DepthNoise::Disparity { m: 35130.0, sigma: 0.0 };
        assert!(exact.residual(351.3 / 100.0, 351.3 / 100.3).abs() < 1e-12);
        assert!(noise.residual(0.0, 1.0).is_nan());
    }
}
