//! The noise of measurements, as far as the truth lets it be measured.

use super::decide::{Judgement, NOISE_FREE_PX};
use super::residual::{DepthMiss, Spread};
use open_structure::structure::{Noise, registry};
use std::collections::BTreeMap;

/// Noise of pixel positions in the release, pixels.
const NOMINAL_PX: f64 = 1.0;
/// Noise of depths in the release, metres.
const NOMINAL_DEPTH_M: f64 = 0.05;
/// A found sigma farther than this from the nominal one, in parts, replaces it.
const TOLERANCE: f64 = 0.1;
/// Depths whose line moves them by more than this for a pixel of noise do not count, metres.
const STEADY_M: f64 = 0.01;
/// Fewer depths than this say nothing about their noise.
const FEWEST: usize = 50;

/// What the measurements' noise was found to be.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundNoise {
    /// Sigma of pixel positions of points, pixels.
    pub points_px: Option<Spread>,
    /// Sigma of distances of line ends from their line, pixels.
    pub lines_px: Option<Spread>,
    /// Sigma of depths of line ends, metres.
    pub depth_m: Option<Spread>,
    /// Shares of depth errors above 2.1 sigma and below -2.1 sigma.
    pub tails: Option<[f64; 2]>,
}

impl FoundNoise {
    /// From the judgements of the rows that became measurements, and the depths of line ends.
    pub(super) fn of(points: Option<&Judgement>, lines: Option<&Judgement>, depths: &[DepthMiss]) -> Self {
        let steady: Vec<f64> = depths
            .iter()
            .filter(|miss| miss.per_pixel < STEADY_M && miss.difference.is_finite())
            .map(|miss| miss.difference)
            .collect();
        let depth_m = (steady.len() >= FEWEST).then(|| Spread::of(steady.clone())).flatten();
        let tails = depth_m.map(|spread| {
            let share = |beyond: &dyn Fn(f64) -> bool| {
                steady.iter().filter(|difference| beyond(**difference)).count() as f64 / steady.len() as f64
            };
            let limit = 2.1 * spread.sigma;
            [share(&|difference| difference > limit), share(&|difference| difference < -limit)]
        });
        let own = |judgement: Option<&Judgement>| judgement.and_then(|judgement| judgement.own);
        Self { points_px: own(points), lines_px: own(lines), depth_m, tails }
    }

    /// What the manifest declares; nothing where the truth does not allow measuring it.
    ///
    /// The release's own figure stands where the found one is within 10 % of it.
    pub(super) fn declared(&self) -> Option<Noise> {
        let sigma_px = self.points_px.or(self.lines_px)?.sigma;
        let largest =
            self.points_px.iter().chain(&self.lines_px).map(|spread| spread.sigma).fold(0.0, f64::max);
        if largest < NOISE_FREE_PX {
            return Some(Noise {
                model: registry::NOISE_NONE.to_owned(),
                seed: None,
                parameters: BTreeMap::new(),
            });
        }
        let mut parameters = BTreeMap::from([("sigma_px".to_owned(), declared(sigma_px, NOMINAL_PX))]);
        let mut model = registry::NOISE_GAUSSIAN;
        if let Some(depth) = self.depth_m {
            parameters.insert("sigma_depth_m".to_owned(), declared(depth.sigma, NOMINAL_DEPTH_M));
            // Its generator replaced noise above 0.1 m by 0.08 m: the upper tail is missing. A Gaussian has 1.8 % on either side.
            if self.tails.is_some_and(|[above, below]| above < 0.5 * below) {
                model = registry::NOISE_FIRST_RELEASE;
            }
        }
        Some(Noise { model: model.to_owned(), seed: None, parameters })
    }
}

/// The nominal value, unless what was found is more than a tenth from it; then that, to four digits.
fn declared(found: f64, nominal: f64) -> f64 {
    if (found - nominal).abs() <= TOLERANCE * nominal {
        return nominal;
    }
    format!("{found:.3e}").parse().unwrap_or(found)
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the very value is declared")]
mod tests {
    use super::*;

    fn found(points: f64, lines: f64, depth: f64, tails: [f64; 2]) -> FoundNoise {
        let spread = |sigma| Some(Spread { sigma, count: 1000 });
        FoundNoise {
            points_px: spread(points),
            lines_px: spread(lines),
            depth_m: spread(depth),
            tails: Some(tails),
        }
    }

    #[test]
    fn the_nominal_sigma_stands_within_a_tenth_and_the_found_one_beyond() {
        let noise = found(1.02, 0.98, 0.0512, [0.001, 0.02]).declared().unwrap();
        assert_eq!(noise.model, registry::NOISE_FIRST_RELEASE);
        assert_eq!(noise.parameters["sigma_px"], 1.0);
        assert_eq!(noise.parameters["sigma_depth_m"], 0.05);
        let noise = found(2.512_345, 2.5, 0.071_234_5, [0.02, 0.02]).declared().unwrap();
        assert_eq!(noise.model, registry::NOISE_GAUSSIAN);
        assert_eq!(noise.parameters["sigma_px"], 2.512);
        assert_eq!(noise.parameters["sigma_depth_m"], 0.07123);
    }

    #[test]
    fn rows_without_noise_declare_none_and_rows_without_truth_nothing() {
        let noise = found(0.001, 0.0004, 1e-5, [0.0, 0.0]).declared().unwrap();
        assert_eq!((noise.model.as_str(), noise.parameters.len()), (registry::NOISE_NONE, 0));
        assert_eq!(FoundNoise::default().declared(), None);
    }
}
