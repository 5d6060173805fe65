//! Noise: what the manifest declares, and what residuals show of it.

use super::depth_noise::{DepthNoise, below, bisect};
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

/// What the manifest says about noise, as far as residuals can show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Declared {
    /// Sigma of pixel positions, before they are rounded.
    pub(crate) sigma_px: Option<f64>,
    /// Step to which pixel positions are rounded; 0 where they are not.
    pub(crate) quantisation_px: f64,
    /// Sigma of where depth is read.
    pub(crate) sigma_lateral_px: f64,
    /// Part of the rows that show another landmark than they say; `None` where nothing is said of any.
    pub(crate) outlier_fraction: Option<f64>,
    /// Noise of depth.
    pub(crate) depth: Option<DepthNoise>,
}

impl Declared {
    pub(crate) fn new(noise: Option<&Noise>) -> Self {
        let Some(noise) = noise else { return Self::default() };
        let parameter = |name: &str| {
            noise.parameters.get(name).copied().filter(|value| value.is_finite() && *value >= 0.0)
        };
        let none = noise.model == registry::NOISE_NONE;
        let m = parameter("m").filter(|m| *m > 0.0);
        let depth = match noise.model.as_str() {
            registry::NOISE_NONE => Some(DepthNoise::Metres(0.0)),
            registry::NOISE_PAPER => {
                m.zip(parameter("sigma_d")).map(|(m, sigma_cm)| DepthNoise::Paper { m, sigma_cm })
            }
            registry::NOISE_KINECT_DISPARITY => {
                m.zip(parameter("sigma_disparity")).map(|(m, sigma)| DepthNoise::Disparity { m, sigma })
            }
            _ => parameter("sigma_depth_m").map(DepthNoise::Metres),
        };
        Self {
            sigma_px: if none { Some(0.0) } else { parameter("sigma_px") },
            quantisation_px: parameter("quantisation_px").unwrap_or(0.0),
            sigma_lateral_px: parameter("sigma_lateral_px").unwrap_or(0.0),
            outlier_fraction: parameter("outlier_fraction").filter(|fraction| *fraction > 0.0),
            depth,
        }
    }

    /// How far outside the image a measurement may lie, pixels.
    pub(crate) fn margin_px(&self) -> f64 {
        (6.0 * self.sigma_px.unwrap_or(1.0)).max(1.0) + 0.5 * self.quantisation_px
    }

    /// Whether a measurement is so far from its landmark's image that it is taken for a declared outlier.
    #[inline]
    pub(crate) fn is_outlier(&self, residuals: [f64; 2]) -> bool {
        self.outlier_fraction.is_some() && residuals.iter().any(|residual| residual.abs() > self.margin_px())
    }

    /// Whether roundings of neighbouring frames may go the same way, so that many rows say a wrong place.
    ///
    /// With a sigma of half a step what they have in common is `exp(−2π²/4)`, under 1 %.
    pub(crate) fn roundings_agree(&self) -> bool {
        self.sigma_px.is_none_or(|sigma| sigma < 0.5 * self.quantisation_px)
            && self.quantisation_px > LEAST_SIGMA_PX
    }

    /// Sigma of the place along a line where depth is read, seen from the measured one, pixels.
    pub(crate) fn sigma_along_px(&self) -> f64 {
        let [sigma, lateral] = [self.sigma_px.unwrap_or(1.0), self.sigma_lateral_px];
        (sigma * sigma + lateral * lateral + self.quantisation_px * self.quantisation_px / 12.0).sqrt()
    }

    /// The sigmas that residuals of pixels may show, from the least to the greatest; `None` where none is
    /// declared.
    ///
    /// A rounding adds a uniform number. The robust sigma of the sum is that along an axis of the grid;
    /// oblique directions mix two roundings, which is closer to a normal number of the same variance.
    fn sigmas_px(&self) -> Option<[f64; 2]> {
        let (sigma, step) = (self.sigma_px?, self.quantisation_px);
        let normal = (sigma * sigma + step * step / 12.0).sqrt();
        let along_axis = rounded_sigma(sigma, step);
        Some([normal.min(along_axis), normal.max(along_axis)])
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
    /// Whether the next row is taken in.
    #[inline]
    pub(crate) const fn takes_next(&self) -> bool {
        self.seen.is_multiple_of(self.stride)
    }

    /// Takes a row in, or passes over it.
    #[inline]
    pub(crate) fn add(&mut self, residual: Residual) {
        if self.takes_next() {
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
    if let Some((sigma_px, range)) = declared.sigma_px.zip(declared.sigmas_px())
        && !found.iter().all(|(_, found)| agrees(*found, range, LEAST_SIGMA_PX))
    {
        findings.add(RuleId::NoiseAgrees, Some(table), || {
            let rounded = match declared.quantisation_px {
                step if step > 0.0 => format!(", rounded to {step} px"),
                _ => String::new(),
            };
            Detail::new(format!("the declared sigma of {sigma_px} px{rounded}"), words())
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
    if !agrees(found, [depth.sigma(); 2], depth.least_sigma()) {
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

/// Holds the part of rows that are taken for outliers against the declared one.
pub(crate) fn judge_outliers(
    wild: u64,
    rows: u64,
    declared: &Declared,
    table: &'static str,
    findings: &mut Findings,
) {
    let Some(fraction) = declared.outlier_fraction.filter(|_| rows > 0) else { return };
    let found = wild as f64 / rows as f64;
    let error = (fraction * (1.0 - fraction.min(1.0)) / rows as f64).sqrt();
    if found > (1.0 + RELATIVE_TOLERANCE) * fraction + STANDARD_ERRORS * error + 1.0 / rows as f64 {
        findings.add(RuleId::NoiseAgrees, Some(table), || {
            let margin = declared.margin_px();
            let expected =
                format!("at most the declared part of {fraction} over {margin} px from their landmark");
            Detail::new(expected, format!("{found:.4} ({wild} of {rows} rows)"))
        });
    }
}

fn agrees(found: Found, [least_declared, most_declared]: [f64; 2], least: f64) -> bool {
    let allowed = RELATIVE_TOLERANCE * most_declared + STANDARD_ERRORS * found.standard_error + least;
    (least_declared - allowed..=most_declared + allowed).contains(&found.sigma)
}

/// The robust sigma of a normal number that is rounded to steps: of `N(0, σ²)` plus a uniform number.
///
/// Half of the absolute values are below its median x: `F(x) = ½`, with the mean of the normal distribution
/// function over a step, `(σ/q) [G((x + q/2)/σ) − G((x − q/2)/σ)]`, `G(z) = z Φ(z) + φ(z)`.
fn rounded_sigma(sigma: f64, step: f64) -> f64 {
    if step <= 1e-6 * sigma || step == 0.0 {
        return sigma;
    }
    let half = 0.5 * step;
    // Without noise the median is a quarter of the step.
    if sigma <= 1e-6 * step {
        return 1.4826 * 0.5 * half;
    }
    let primitive = |z: f64| z * below(z) + libm::exp(-0.5 * z * z) / std::f64::consts::TAU.sqrt();
    let mean_below = |x: f64| sigma / step * (primitive((x + half) / sigma) - primitive((x - half) / sigma));
    1.4826 * bisect(0.0, 2.0 * sigma + step, |x| mean_below(x) - mean_below(-x) - 0.5)
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
        assert!((depth.sigma_m(3.0) - 0.015).abs() < 1e-15);
    }

    #[test]
    fn what_is_not_declared_is_not_judged() {
        assert_eq!(Declared::new(None), Declared::default());
        let none = Declared::new(Some(&noise("none", &[])));
        assert_eq!((none.sigma_px, none.depth), (Some(0.0), Some(DepthNoise::Metres(0.0))));
        let kinect =
            Declared::new(Some(&noise("kinect-disparity", &[("sigma_px", 0.5), ("sigma_disparity", 0.1)])));
        assert_eq!((kinect.sigma_px, kinect.depth), (Some(0.5), None), "m is missing");
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
        assert!(agrees(many, [1.0; 2], 0.0) && agrees(many, [1.1; 2], 0.0) && agrees(many, [0.92; 2], 0.0));
        assert!(
            !agrees(many, [1.2; 2], 0.0) && !agrees(many, [0.85; 2], 0.0) && !agrees(many, [0.0; 2], 0.05)
        );
        assert!(agrees(found(1.0, 100).unwrap(), [1.5; 2], 0.0), "few residuals know little");
    }

    #[test]
    fn the_robust_sigma_of_rounded_noise_is_that_of_many_numbers() {
        // Uniform between −½ and ½: the median of absolute values is a quarter.
        assert!((rounded_sigma(0.0, 1.0) - 1.4826 * 0.25).abs() < 1e-12);
        assert!((rounded_sigma(1.0, 0.0) - 1.0).abs() < 1e-12);
        // Steps that are small beside sigma add their variance, 1/12.
        assert!((rounded_sigma(5.0, 1.0) - (25.0_f64 + 1.0 / 12.0).sqrt()).abs() < 1e-3);
        for (sigma, step) in [(0.1, 1.0), (0.5, 1.0), (1.0, 2.0)] {
            // Every quantile of one with every quantile of the other.
            let quantile = |part: f64| bisect(-9.0, 9.0, |z| below(z) - part);
            let parts: Vec<f64> = (0..400).map(|index| (f64::from(index) + 0.5) / 400.0).collect();
            let normal: Vec<f64> = parts.iter().map(|part| sigma * quantile(*part)).collect();
            let sums = normal.iter().flat_map(|one| parts.iter().map(move |part| one + step * (part - 0.5)));
            let found = robust_sigma(sums.collect()).unwrap().sigma;
            // 400 quantiles leave gaps of a 400th.
            assert!((found - rounded_sigma(sigma, step)).abs() < step / 400.0, "{sigma} {step}: {found}");
        }
    }

    #[test]
    fn more_outliers_than_are_declared_are_found() {
        let declared =
            Declared::new(Some(&noise("gaussian", &[("sigma_px", 1.0), ("outlier_fraction", 0.1)])));
        assert!(declared.is_outlier([0.0, -6.1]) && !declared.is_outlier([5.9, -5.9]));
        assert!(!Declared::default().is_outlier([1e9, 0.0]));
        let broken = |wild: u64| {
            let mut findings = Findings::new(10);
            judge_outliers(wild, 10_000, &declared, "point_measurements", &mut findings);
            findings.into_parts().next().is_some()
        };
        // A tenth more, four standard errors of 30 rows.
        assert!(!broken(0) && !broken(1000) && !broken(1219) && broken(1230));
    }
}
