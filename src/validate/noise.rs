//! Noise: what the manifest declares, and what residuals show of it.

use super::finding::{Detail, Findings};
use super::rules::RuleId;
use crate::structure::{Noise, registry};

/// Residuals that are kept of a table; the robust sigma of so many is known to 0.2 %.
const KEPT: usize = 1 << 18;
/// Fewer residuals say nothing about their sigma.
const LEAST: usize = 30;
/// A sigma that is off by less than this part is not told from the declared one.
const RELATIVE_TOLERANCE: f64 = 0.1;
/// Standard errors that are allowed on top.
const STANDARD_ERRORS: f64 = 4.0;
/// Standard error of the robust sigma of normal residuals, over sigma/√n.
const ROBUST_ERROR: f64 = 1.167;
/// What rounded poses add, pixels; sigma under this is no noise at all.
const LEAST_SIGMA_PX: f64 = 0.05;
/// What rounded poses and landmarks add, metres.
const LEAST_SIGMA_M: f64 = 1e-3;

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
}

impl DepthNoise {
    /// The noise that makes the measured depth of the true one (both metres), in the unit of sigma.
    #[inline]
    pub(crate) fn residual(self, measured: f64, truth: f64) -> f64 {
        match self {
            Self::Metres(_) => measured - truth,
            Self::Paper { m, .. } => m / (m / (100.0 * measured) - 0.5) - 100.0 * truth,
        }
    }

    fn sigma(self) -> f64 {
        match self {
            Self::Metres(sigma) | Self::Paper { sigma_cm: sigma, .. } => sigma,
        }
    }

    /// Sigma in metres.
    pub(crate) fn sigma_m(self) -> f64 {
        match self {
            Self::Metres(sigma) => sigma,
            Self::Paper { sigma_cm, .. } => 0.01 * sigma_cm,
        }
    }

    const fn unit(self) -> &'static str {
        match self {
            Self::Metres(_) => "m",
            Self::Paper { .. } => "cm (of α)",
        }
    }
}

/// What the manifest says about noise, as far as residuals can show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Declared {
    /// Sigma of pixel positions.
    pub(crate) sigma_px: Option<f64>,
    /// Noise of depth. That of `kinect-disparity` is not judged: its disparities are whole numbers.
    pub(crate) depth: Option<DepthNoise>,
}

impl Declared {
    pub(crate) fn new(noise: Option<&Noise>) -> Self {
        let Some(noise) = noise else { return Self::default() };
        let parameter = |name: &str| {
            noise.parameters.get(name).copied().filter(|value| value.is_finite() && *value >= 0.0)
        };
        let none = noise.model == registry::NOISE_NONE;
        let depth = match noise.model.as_str() {
            registry::NOISE_NONE => Some(DepthNoise::Metres(0.0)),
            registry::NOISE_PAPER => match (parameter("m"), parameter("sigma_d")) {
                (Some(m), Some(sigma_cm)) => Some(DepthNoise::Paper { m, sigma_cm }),
                _ => None,
            },
            registry::NOISE_KINECT_DISPARITY => None,
            _ => parameter("sigma_depth_m").map(DepthNoise::Metres),
        };
        Self { sigma_px: if none { Some(0.0) } else { parameter("sigma_px") }, depth }
    }

    /// How far outside the image a measurement may lie, pixels.
    pub(crate) fn margin_px(&self) -> f64 {
        (6.0 * self.sigma_px.unwrap_or(1.0)).max(1.0)
    }
}

/// Residuals of one row at the claimed landmark.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Residual {
    /// Place of the landmark.
    pub(crate) landmark: u32,
    /// Of a point: u and v. Of a segment: the distances of its two ends. Pixels.
    pub(crate) pixels: [f64; 2],
    /// Of depth, in the unit of the declared noise; NaN where there is none.
    pub(crate) depths: [f64; 2],
}

/// An even sample of all rows, of bounded size: every first, second, fourth … row.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    stride: u64,
    seen: u64,
    kept: Vec<Residual>,
}

impl Default for Sample {
    fn default() -> Self {
        Self { stride: 1, seen: 0, kept: Vec::new() }
    }
}

impl Sample {
    /// Takes a row in, or passes over it.
    #[inline]
    pub(crate) fn add(&mut self, residual: Residual) {
        if self.seen.is_multiple_of(self.stride) {
            self.kept.push(residual);
            if self.kept.len() == KEPT {
                let mut index = 0;
                self.kept.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.stride *= 2;
            }
        }
        self.seen += 1;
    }

    /// Only the rows of some landmarks.
    pub(crate) fn keep(&mut self, landmark: impl Fn(usize) -> bool) {
        self.kept.retain(|residual| landmark(residual.landmark as usize));
    }

    pub(crate) fn column(&self, value: impl Fn(&Residual) -> f64) -> Vec<f64> {
        self.kept.iter().map(value).filter(|value| value.is_finite()).collect()
    }
}

/// A sigma that was found, and how well it is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) sigma: f64,
    pub(crate) standard_error: f64,
    pub(crate) count: usize,
}

/// The robust sigma of residuals: 1.4826 times the median of their absolute values; `None` of too few.
pub(crate) fn robust_sigma(mut residuals: Vec<f64>) -> Option<Found> {
    let count = residuals.len();
    if count < LEAST {
        return None;
    }
    for residual in &mut residuals {
        *residual = residual.abs();
    }
    let (_, median, _) = residuals.select_nth_unstable_by(count / 2, f64::total_cmp);
    let sigma = 1.4826 * *median;
    Some(Found { sigma, standard_error: ROBUST_ERROR * sigma / (count as f64).sqrt(), count })
}

/// Holds found sigmas of pixel positions against the declared one.
pub(crate) fn judge_pixels(
    found: &[(&str, Found)],
    declared: &Declared,
    table: &'static str,
    findings: &mut Findings,
) {
    if found.is_empty() {
        return;
    }
    let words = || {
        let sigmas: Vec<String> =
            found.iter().map(|(name, found)| format!("{name} {:.3} px", found.sigma)).collect();
        let count = found.iter().map(|(_, found)| found.count).sum::<usize>();
        format!("sigma of {} ({count} residuals)", sigmas.join(", "))
    };
    if let Some(sigma_px) = declared.sigma_px
        && !found.iter().all(|(_, found)| agrees(*found, sigma_px, LEAST_SIGMA_PX))
    {
        findings.add(RuleId::NoiseAgrees, Some(table), || {
            Detail::new(format!("the declared sigma of {sigma_px} px"), words())
        });
    }
    if found.iter().all(|(_, found)| found.sigma < LEAST_SIGMA_PX) {
        findings
            .add(RuleId::MeasurementsNoisy, Some(table), || Detail::new("noise of 0.05 px or more", words()));
    }
}

/// Holds the found sigma of depth against the declared one.
pub(crate) fn judge_depth(
    residuals: Vec<f64>,
    declared: &Declared,
    table: &'static str,
    findings: &mut Findings,
) {
    let (Some(depth), Some(found)) = (declared.depth, robust_sigma(residuals)) else { return };
    if !agrees(found, depth.sigma(), LEAST_SIGMA_M) {
        findings.add(RuleId::NoiseAgrees, Some(table), || {
            let unit = depth.unit();
            let expected = format!("the declared sigma of depth of {} {unit}", depth.sigma());
            Detail::new(
                expected,
                format!("sigma of depth {:.4} {unit} ({} residuals)", found.sigma, found.count),
            )
        });
    }
}

fn agrees(found: Found, declared: f64, least: f64) -> bool {
    let allowed = RELATIVE_TOLERANCE * declared + STANDARD_ERRORS * found.standard_error + least;
    (found.sigma - declared).abs() <= allowed
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn noise(model: &str, parameters: &[(&str, f64)]) -> Noise {
        let parameters: BTreeMap<_, _> =
            parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Noise { model: model.to_owned(), seed: None, parameters }
    }

    #[test]
    fn the_sample_is_even_and_bounded() {
        let mut sample = Sample::default();
        for index in 0..u32::try_from(KEPT * 3).unwrap() {
            sample.add(Residual { landmark: index, pixels: [0.0; 2], depths: [f64::NAN; 2] });
        }
        assert!(sample.kept.len() < KEPT);
        assert!(sample.kept.windows(2).all(|pair| pair[1].landmark - pair[0].landmark == 4));
        assert!(sample.column(|residual| residual.depths[0]).is_empty());
    }

    #[test]
    fn the_papers_depth_noise_is_undone() {
        let paper =
            Declared::new(Some(&noise("paper", &[("m", 35130.0), ("sigma_d", 1.5), ("sigma_px", 1.0)])));
        let depth = paper.depth.unwrap();
        let (truth, alpha) = (3.2, 1.25);
        let measured = 0.01 * 35130.0 / (35130.0 / (100.0 * truth + alpha) + 0.5);
        assert!((depth.residual(measured, truth) - alpha).abs() < 1e-9);
        assert!((depth.sigma_m() - 0.015).abs() < 1e-15);
    }

    #[test]
    fn what_is_not_declared_is_not_judged() {
        assert_eq!(Declared::new(None), Declared::default());
        let none = Declared::new(Some(&noise("none", &[])));
        assert_eq!((none.sigma_px, none.depth), (Some(0.0), Some(DepthNoise::Metres(0.0))));
        let kinect =
            Declared::new(Some(&noise("kinect-disparity", &[("sigma_px", 0.5), ("sigma_disparity", 0.1)])));
        assert_eq!((kinect.sigma_px, kinect.depth), (Some(0.5), None));
        let own = Declared::new(Some(&noise("mine", &[("sigma_px", f64::NAN), ("sigma_depth_m", 0.02)])));
        assert_eq!((own.sigma_px, own.depth), (None, Some(DepthNoise::Metres(0.02))));
    }

    #[test]
    fn sigma_is_held_to_a_tenth_and_four_standard_errors() {
        let found = |sigma: f64, count: usize| {
            robust_sigma(
                (0..count).map(|index| if index % 2 == 0 { 1.0 } else { -1.0 } * sigma / 1.4826).collect(),
            )
        };
        assert!(found(1.0, LEAST - 1).is_none());
        let many = found(1.0, 1_000_000).unwrap();
        assert!((many.sigma - 1.0).abs() < 1e-12);
        assert!(agrees(many, 1.0, 0.0) && agrees(many, 1.1, 0.0) && agrees(many, 0.92, 0.0));
        assert!(!agrees(many, 1.2, 0.0) && !agrees(many, 0.85, 0.0) && !agrees(many, 0.0, 0.05));
        assert!(agrees(found(1.0, 100).unwrap(), 1.5, 0.0), "few residuals know little");
    }
}
