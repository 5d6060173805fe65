//! The noise of depth, as each model has it.

use super::super::Random;
use super::{NoiseModel, NoiseRecipe};

/// Above this depth noise, metres, the first release's code put [`REPLACEMENT_M`] for the ends of lines.
const REPLACED_ABOVE_M: f64 = 0.1;
/// What the first release's code put instead, metres.
const REPLACEMENT_M: f64 = 0.08;
/// What the paper's formula adds to the disparity.
const PAPER_BIAS: f64 = 0.5;

/// The noise of depth with its numbers.
#[derive(Clone, Copy, Debug)]
pub(super) enum DepthNoise {
    /// No noise.
    None,
    /// `d = d̂ + α`.
    Metres { sigma_m: f64, replaced: bool },
    /// `d = m / (m/(d̂ + α) + 0.5)`, centimetres.
    Paper { m: f64, sigma_cm: f64 },
    /// `d = m / ⌊m/d̂(û + δ) + α + 0.5⌋`, centimetres.
    Disparity { m: f64, sigma: f64, sigma_lateral_px: f64 },
}

impl DepthNoise {
    pub(super) fn new(recipe: &NoiseRecipe) -> Self {
        let parameter = |name: &str| recipe.parameter(name);
        match recipe.model {
            NoiseModel::None => Self::None,
            NoiseModel::Gaussian => Self::Metres { sigma_m: parameter("sigma_depth_m"), replaced: false },
            NoiseModel::FirstRelease => Self::Metres { sigma_m: parameter("sigma_depth_m"), replaced: true },
            NoiseModel::Paper => Self::Paper { m: parameter("m"), sigma_cm: parameter("sigma_d") },
            NoiseModel::KinectDisparity => Self::Disparity {
                m: parameter("m"),
                sigma: parameter("sigma_disparity"),
                sigma_lateral_px: parameter("sigma_lateral_px"),
            },
        }
    }

    /// The measured depth of a true one, metres; `None` where a sensor would give none: a depth of 0 or less,
    /// or a disparity of 0 or less.
    ///
    /// * `inverse_slope` — how the inverse of depth changes along the line at this end of a segment, 1/m per
    ///   pixel; 0 where no slope is known. `None` for a point.
    ///
    /// Two numbers are drawn whatever the model and the depth, so that rows do not depend on each other.
    pub(super) fn measure(
        self,
        depth_m: Option<f64>,
        inverse_slope: Option<f64>,
        random: &mut Random,
    ) -> Option<f64> {
        let (along, normal) = (random.normal(), random.normal());
        let depth_m = depth_m.filter(|depth| *depth > 0.0 && depth.is_finite())?;
        let measured = match self {
            Self::None => depth_m,
            Self::Metres { sigma_m, replaced } => {
                let noise = sigma_m * normal;
                let replaced = replaced && inverse_slope.is_some() && noise > REPLACED_ABOVE_M;
                depth_m + if replaced { REPLACEMENT_M } else { noise }
            }
            Self::Paper { m, sigma_cm } => {
                0.01 * m / (m / (100.0 * depth_m + sigma_cm * normal) + PAPER_BIAS)
            }
            Self::Disparity { m, sigma, sigma_lateral_px } => {
                let shift_px = sigma_lateral_px * along;
                let inverse_m = 1.0 / depth_m + inverse_slope.unwrap_or(0.0) * shift_px;
                let steps = (0.01 * m * inverse_m + sigma * normal + 0.5).floor();
                if steps < 1.0 {
                    return None;
                }
                0.01 * m / steps
            }
        };
        (measured > 0.0 && measured.is_finite()).then_some(measured)
    }
}
