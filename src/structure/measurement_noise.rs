//! How far a measurement may be trusted: the declared noise as an estimator needs it.

use super::manifest::{Manifest, Noise};
use super::registry;

/// Standard deviation of a pixel coordinate where nothing is declared: the paper's.
const USUAL_SIGMA_PX: f64 = 1.0;
/// Standard deviation of depth where nothing is declared: the first release's, metres.
const USUAL_SIGMA_DEPTH_M: f64 = 0.05;
/// Less noise than this is taken for this much, so that noise-free data keeps finite weights.
const LEAST_SIGMA_PX: f64 = 1e-3;
/// Less noise of depth than this is taken for this much, metres.
const LEAST_SIGMA_DEPTH_M: f64 = 1e-4;
/// Centimetres in a metre: the registry's `m` and `sigma_d` are in centimetres.
const CM: f64 = 100.0;

/// In which space the noise of depth is Gaussian, and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthNoise {
    /// Depth is not to be used.
    Unknown,
    /// Depth itself is measured.
    Constant {
        /// Standard deviation, metres.
        sigma_m: f64,
    },
    /// The inverse of depth is measured, as a disparity gives it.
    Inverse {
        /// Standard deviation of `1/d`, 1/m.
        sigma_per_m: f64,
    },
    /// Depth is measured and then bent by half a step of disparity: the model `paper` of the registry.
    Bent {
        /// Depth times disparity, metres.
        m: f64,
        /// Standard deviation before the bending, metres.
        sigma_m: f64,
    },
}

/// Standard deviations of measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurementNoise {
    /// Standard deviation of `u` and of `v`, pixels.
    pub sigma_px: f64,
    /// Noise of depth.
    pub depth: DepthNoise,
}

impl Default for MeasurementNoise {
    /// The first release's: 1 px and 0.05 m.
    fn default() -> Self {
        Self { sigma_px: USUAL_SIGMA_PX, depth: DepthNoise::Constant { sigma_m: USUAL_SIGMA_DEPTH_M } }
    }
}

impl MeasurementNoise {
    /// What a manifest declares.
    ///
    /// Quantisation adds its variance q²/12. Where nothing is declared, or the model is unknown and has no parameter
    /// of the registry's names, it is 1 px and 0.05 m. The model `none` has these as well: its measurements are
    /// exact, and what counts is their weight relative to each other.
    ///
    /// The disparity of `kinect-disparity` has the variance `sigma_disparity² + 1/12` in steps (registry, section 4.3);
    /// its lateral shift, which depends on the scene, is left out.
    #[must_use]
    pub fn declared(manifest: &Manifest) -> Self {
        manifest.noise.as_ref().map_or_else(Self::default, Self::of)
    }

    fn of(noise: &Noise) -> Self {
        if noise.model == registry::NOISE_NONE {
            return Self::default();
        }
        let parameter = |name: &str| {
            noise.parameters.get(name).copied().filter(|value| value.is_finite() && *value >= 0.0)
        };
        let step = parameter("quantisation_px").unwrap_or(0.0);
        let sigma_px = parameter("sigma_px").unwrap_or(USUAL_SIGMA_PX);
        let sigma_px = (sigma_px * sigma_px + step * step / 12.0).sqrt().max(LEAST_SIGMA_PX);
        let m = parameter("m").filter(|m| *m > 0.0).map(|m| m / CM);
        let usual = parameter("sigma_depth_m").unwrap_or(USUAL_SIGMA_DEPTH_M).max(LEAST_SIGMA_DEPTH_M);
        let depth = match (noise.model.as_str(), m) {
            (registry::NOISE_PAPER, Some(m)) => {
                let sigma_m = parameter("sigma_d").unwrap_or(CM / 600.0) / CM;
                DepthNoise::Bent { m, sigma_m: sigma_m.max(LEAST_SIGMA_DEPTH_M) }
            }
            (registry::NOISE_KINECT_DISPARITY, Some(m)) => {
                let sigma = parameter("sigma_disparity").unwrap_or(1.0 / 6.0);
                DepthNoise::Inverse { sigma_per_m: (sigma * sigma + 1.0 / 12.0).sqrt() / m }
            }
            _ => DepthNoise::Constant { sigma_m: usual },
        };
        Self { sigma_px, depth }
    }

    /// The noise of a stereo camera, whose depth is a disparity: `d = fx b / (u_left − u_right)`.
    ///
    /// * `fx_px` — focal length, pixels, of either sign; `baseline_m` — distance of the two cameras, metres.
    ///
    /// The disparity has the standard deviation of a pixel coordinate.
    #[must_use]
    pub fn stereo(self, fx_px: f64, baseline_m: f64) -> Self {
        let sigma_per_m = self.sigma_px / (fx_px * baseline_m).abs();
        Self { depth: DepthNoise::Inverse { sigma_per_m }, ..self }
    }

    /// The same pixels without depth.
    #[must_use]
    pub fn monocular(self) -> Self {
        Self { depth: DepthNoise::Unknown, ..self }
    }

    /// Whitened residual of a measured depth, and its derivative by the predicted depth.
    ///
    /// `r = (h(d) − h(z)) / σ` with `h` the space in which the noise is Gaussian; returns `[r, ∂r/∂z]`, in sigma and
    /// sigma per metre.
    ///
    /// * `measured_m`, `predicted_z_m` — depth along the optical axis, metres.
    ///
    /// `None` where depth is not used, or either is not a positive number.
    #[must_use]
    #[inline]
    pub fn depth_residual(&self, measured_m: f64, predicted_z_m: f64) -> Option<[f64; 2]> {
        let positive = |depth: f64| depth > 0.0 && depth.is_finite();
        if !positive(measured_m) || !positive(predicted_z_m) {
            return None;
        }
        let weighted = |residual: f64, slope: f64, sigma: f64| Some([residual / sigma, slope / sigma]);
        match self.depth {
            DepthNoise::Unknown => None,
            DepthNoise::Constant { sigma_m } => weighted(measured_m - predicted_z_m, -1.0, sigma_m),
            DepthNoise::Inverse { sigma_per_m } => {
                let inverse = 1.0 / predicted_z_m;
                weighted(1.0 / measured_m - inverse, inverse * inverse, sigma_per_m)
            }
            DepthNoise::Bent { m, sigma_m } => {
                let straight = Self::straight(m, measured_m)?;
                weighted(straight - predicted_z_m, -1.0, sigma_m)
            }
        }
    }

    /// The depth that a measurement speaks for, and its standard deviation, metres.
    ///
    /// The measurement itself but for [`DepthNoise::Bent`], whose bias is taken off. `None` where depth is not used
    /// or is not a positive number.
    #[must_use]
    pub fn depth(&self, measured_m: f64) -> Option<(f64, f64)> {
        if !(measured_m > 0.0 && measured_m.is_finite()) {
            return None;
        }
        match self.depth {
            DepthNoise::Unknown => None,
            DepthNoise::Constant { sigma_m } => Some((measured_m, sigma_m)),
            DepthNoise::Inverse { sigma_per_m } => Some((measured_m, sigma_per_m * measured_m * measured_m)),
            DepthNoise::Bent { m, sigma_m } => Some((Self::straight(m, measured_m)?, sigma_m)),
        }
    }

    /// Undoes `d = m / (m/x + 0.5)`: `x = m / (m/d − 0.5)`.
    fn straight(m: f64, measured_m: f64) -> Option<f64> {
        let steps = m / measured_m - 0.5;
        (steps > 0.0).then(|| m / steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn declared(model: &str, parameters: &[(&str, f64)]) -> MeasurementNoise {
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let noise = Noise { model: model.to_owned(), seed: None, parameters };
        MeasurementNoise::declared(&Manifest { noise: Some(noise), ..Manifest::default() })
    }

    fn models() -> [MeasurementNoise; 4] {
        [
            declared(registry::NOISE_GAUSSIAN, &[("sigma_px", 0.5), ("sigma_depth_m", 0.02)]),
            declared(registry::NOISE_PAPER, &[("m", 35130.0), ("sigma_d", 1.0)]),
            declared(registry::NOISE_KINECT_DISPARITY, &[("m", 35130.0), ("sigma_disparity", 0.5)]),
            MeasurementNoise::default().stereo(-500.0, 0.1),
        ]
    }

    proptest! {
        #[test]
        fn the_residual_vanishes_at_the_depth_it_speaks_for(d in 0.1..50.0_f64, model in 0..4_usize) {
            let noise = models()[model];
            let (depth, sigma) = noise.depth(d).unwrap();
            let [residual, slope] = noise.depth_residual(d, depth).unwrap();
            // Rounding of 1/d over a sigma of 1e-3/m and more.
            prop_assert!(residual.abs() < 1e-10, "{residual}");
            // A standard deviation of depth is one sigma of the residual, to first order.
            prop_assert!((slope.abs() * sigma - 1.0).abs() < 1e-12);
        }

        #[test]
        fn the_slope_is_the_difference(d in 0.1..50.0_f64, z in 0.1..50.0_f64, model in 0..4_usize) {
            let noise = models()[model];
            let step = 1e-6 * z;
            let at = |z: f64| noise.depth_residual(d, z).unwrap();
            let difference = (at(z + step)[0] - at(z - step)[0]) / (2.0 * step);
            prop_assert!((at(z)[1] - difference).abs() <= 1e-5 * difference.abs().max(1.0));
        }
    }

    #[test]
    fn what_is_declared_is_taken() {
        let noise = declared(registry::NOISE_GAUSSIAN, &[("sigma_px", 0.5), ("quantisation_px", 1.0)]);
        assert!((noise.sigma_px - (0.25_f64 + 1.0 / 12.0).sqrt()).abs() < 1e-15);
        assert_eq!(noise.depth, DepthNoise::Constant { sigma_m: 0.05 });
        assert_eq!(MeasurementNoise::declared(&Manifest::default()), MeasurementNoise::default());
        assert_eq!(declared(registry::NOISE_NONE, &[]), MeasurementNoise::default());
        // 0.5 px of disparity noise and a step's rounding, over 351.3 m.
        let DepthNoise::Inverse { sigma_per_m } = models()[2].depth else { panic!("{:?}", models()[2]) };
        assert!((sigma_per_m - (0.25_f64 + 1.0 / 12.0).sqrt() / 351.3).abs() < 1e-15);
    }

    #[test]
    fn numbers_that_are_no_depth_have_no_residual() {
        let noise = MeasurementNoise::default();
        for (measured, predicted) in [(0.0, 1.0), (f64::NAN, 1.0), (1.0, -1.0), (1.0, f64::INFINITY)] {
            assert_eq!(noise.depth_residual(measured, predicted), None);
        }
        assert_eq!(noise.monocular().depth_residual(1.0, 1.0), None);
        // Beyond two steps of disparity nothing is straight any more.
        assert_eq!(models()[1].depth(800.0), None);
    }
}
