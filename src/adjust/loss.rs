//! Robust losses: how much a residual counts.

use std::str::FromStr;

/// What a residual costs: `½ ρ(s)`, `s = |r|²` of the whitened residual `r`, so that scales are in units of sigma.
///
/// Every loss is `s` for small `s`, so that good measurements count as in least squares.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Loss {
    /// `ρ(s) = s`: least squares.
    #[default]
    None,
    /// `ρ(s) = s` up to `c²`, then `2 c √s − c²`: errors beyond `c` count linearly.
    Huber(f64),
    /// `ρ(s) = c² ln(1 + s/c²)`.
    Cauchy(f64),
    /// `ρ(s) = c²/3 (1 − (1 − s/c²)³)` up to `c²`, then constant: errors beyond `c` have no influence.
    Tukey(f64),
    /// `ρ(s) = s/(1 + s/c²)`.
    GemanMcClure(f64),
}

impl Loss {
    /// `ρ(s)` and its derivative `ρ'(s)`, the weight of the residual.
    #[must_use]
    pub fn evaluate(self, squared: f64) -> (f64, f64) {
        match self {
            Self::None => (squared, 1.0),
            Self::Huber(scale) => {
                let limit = scale * scale;
                if squared <= limit {
                    (squared, 1.0)
                } else {
                    let size = squared.sqrt();
                    (2.0 * scale * size - limit, scale / size)
                }
            }
            Self::Cauchy(scale) => {
                let limit = scale * scale;
                let ratio = squared / limit;
                (limit * libm::log1p(ratio), 1.0 / (1.0 + ratio))
            }
            Self::Tukey(scale) => {
                let limit = scale * scale;
                let left = 1.0 - squared / limit;
                if left <= 0.0 {
                    (limit / 3.0, 0.0)
                } else {
                    // The formula multiplied out: no digits are lost for small residuals.
                    let ratio = squared / limit;
                    (squared * (1.0 - ratio + ratio * ratio / 3.0), left * left)
                }
            }
            Self::GemanMcClure(scale) => {
                let shrink = 1.0 / (1.0 + squared / (scale * scale));
                (squared * shrink, shrink * shrink)
            }
        }
    }

    /// The weight `ρ'(s)` alone.
    #[inline]
    pub(super) fn weight(self, squared: f64) -> f64 {
        match self {
            Self::Cauchy(scale) => 1.0 / (1.0 + squared / (scale * scale)),
            _ => self.evaluate(squared).1,
        }
    }

    /// Curvature along the residual over that across it: `1 + 2 s ρ''(s)/ρ'(s)`, below zero where the loss bends down.
    #[must_use]
    pub fn stiffness(self, squared: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Huber(scale) if squared <= scale * scale => 1.0,
            Self::Huber(_) => 0.0,
            Self::Cauchy(scale) => {
                let limit = scale * scale;
                (limit - squared) / (limit + squared)
            }
            Self::Tukey(scale) => {
                let ratio = squared / (scale * scale);
                if ratio < 1.0 { (1.0 - 5.0 * ratio) / (1.0 - ratio) } else { 0.0 }
            }
            Self::GemanMcClure(scale) => {
                let limit = scale * scale;
                (limit - 3.0 * squared) / (limit + squared)
            }
        }
    }

    /// `2 ρ''(s)`, by which the loss bends down along the residual; of a residual of no length zero.
    ///
    /// * `weight` — `ρ'(s)`.
    #[inline]
    pub(super) fn bend(self, squared: f64, weight: f64) -> f64 {
        match self {
            Self::Cauchy(scale) => -2.0 * weight * weight / (scale * scale),
            _ if squared > 0.0 => weight * (self.stiffness(squared) - 1.0) / squared,
            _ => 0.0,
        }
    }

    /// Whether the scale is a number that a loss can have: finite and over zero.
    #[must_use]
    pub fn is_valid(self) -> bool {
        match self {
            Self::None => true,
            Self::Huber(scale) | Self::Cauchy(scale) | Self::Tukey(scale) | Self::GemanMcClure(scale) => {
                scale.is_finite() && scale > 0.0
            }
        }
    }
}

/// The sum of a loss over many residuals, which needs a logarithm for many of them only.
#[derive(Clone, Copy, Debug)]
pub(super) struct LossSum {
    loss: Loss,
    sum: f64,
    /// `Π (1 + s/c²) − 1` of what is not in the sum yet, for Cauchy's loss.
    product: f64,
}

/// Product at which its logarithm is taken.
const MOST_PRODUCT: f64 = 1e100;

impl LossSum {
    pub(super) fn new(loss: Loss) -> Self {
        Self { loss, sum: 0.0, product: 0.0 }
    }

    /// Adds `ρ(s)`; gives the weight `ρ'(s)`.
    #[inline]
    pub(super) fn add(&mut self, squared: f64) -> f64 {
        if let Loss::Cauchy(scale) = self.loss {
            let ratio = squared / (scale * scale);
            // ln(1 + p) + ln(1 + t) = ln(1 + (p + t + p t)), with every digit of small ones.
            self.product += ratio + self.product * ratio;
            if self.product.is_nan() || self.product > MOST_PRODUCT {
                self.flush();
            }
            1.0 / (1.0 + ratio)
        } else {
            let (rho, weight) = self.loss.evaluate(squared);
            self.sum += rho;
            weight
        }
    }

    fn flush(&mut self) {
        if let Loss::Cauchy(scale) = self.loss {
            self.sum += scale * scale * libm::log1p(self.product);
            self.product = 0.0;
        }
    }

    /// `Σ ρ`.
    pub(super) fn total(mut self) -> f64 {
        self.flush();
        self.sum
    }
}

impl FromStr for Loss {
    type Err = String;

    /// Reads `none`, or `huber`, `cauchy`, `tukey` or `geman-mcclure` with a scale in sigma, such as `cauchy:1`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, scale) = match text.split_once(':') {
            Some((kind, scale)) => {
                let scale = scale.parse().map_err(|_| format!("expected a number after {kind}:"))?;
                (kind, Some(scale))
            }
            None => (text, None),
        };
        // The usual tunings for 95 % efficiency under Gaussian noise, where there are any.
        let loss = match kind {
            "none" => Self::None,
            "huber" => Self::Huber(scale.unwrap_or(1.345)),
            "cauchy" => Self::Cauchy(scale.unwrap_or(2.385)),
            "tukey" => Self::Tukey(scale.unwrap_or(4.685)),
            "geman-mcclure" => Self::GemanMcClure(scale.unwrap_or(3.0)),
            _ => return Err(format!("no loss `{kind}`: none, huber, cauchy, tukey, geman-mcclure")),
        };
        if kind == "none" && scale.is_some() {
            return Err("the loss `none` has no scale".to_owned());
        }
        if loss.is_valid() { Ok(loss) } else { Err("expected a scale over zero".to_owned()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn losses() -> [Loss; 5] {
        [Loss::None, Loss::Huber(1.3), Loss::Cauchy(0.8), Loss::Tukey(4.7), Loss::GemanMcClure(2.0)]
    }

    proptest! {
        #[test]
        fn the_weight_is_the_derivative_of_the_loss(s in 1e-3..50.0_f64) {
            for loss in losses() {
                let h = 1e-5 * s;
                let difference = (loss.evaluate(s + h).0 - loss.evaluate(s - h).0) / (2.0 * h);
                // Central differences: rounding over the step.
                prop_assert!((difference - loss.evaluate(s).1).abs() < 1e-5, "{loss:?} at {s}");
            }
        }

        #[test]
        fn a_larger_residual_never_costs_less_nor_weighs_more(s in 0.0..50.0_f64, more in 0.0..50.0_f64) {
            for loss in losses() {
                let ((near, near_weight), (far, far_weight)) = (loss.evaluate(s), loss.evaluate(s + more));
                prop_assert!(far >= near && far_weight <= near_weight && near <= s + 1e-12);
            }
        }
    }

    proptest! {
        #[test]
        fn a_sum_of_losses_is_that_of_each(
            residuals in proptest::collection::vec(prop_oneof![0.0..1e-20_f64, 0.0..10.0_f64, 0.0..1e90_f64], 0..60),
        ) {
            for loss in losses() {
                let mut sum = LossSum::new(loss);
                let mut expected = 0.0;
                for squared in &residuals {
                    let (rho, weight) = loss.evaluate(*squared);
                    expected += rho;
                    prop_assert!((sum.add(*squared) - weight).abs() <= 1e-15 * weight);
                }
                let found = sum.total();
                prop_assert!((found - expected).abs() <= 1e-13 * expected, "{loss:?}: {found} for {expected}");
            }
        }

        #[test]
        fn the_stiffness_is_the_curvature_along_the_residual(r in 1e-2..7.0_f64) {
            for loss in losses() {
                let h = 1e-4 * r;
                let slope = |r: f64| r * loss.evaluate(r * r).1;
                let difference = (slope(r + h) - slope(r - h)) / (2.0 * h);
                let (_, weight) = loss.evaluate(r * r);
                // The kinks of Huber and Tukey have no curvature.
                let kink = match loss {
                    Loss::Huber(scale) | Loss::Tukey(scale) => (r - scale).abs() < 2.0 * h,
                    _ => false,
                };
                prop_assert!(kink || (difference - weight * loss.stiffness(r * r)).abs() < 1e-5, "{loss:?} at {r}");
                let bent = weight + loss.bend(r * r, weight) * r * r;
                prop_assert!((bent - weight * loss.stiffness(r * r)).abs() < 1e-12, "{loss:?} at {r}");
            }
        }
    }

    #[test]
    fn small_residuals_cost_what_they_do_in_least_squares() {
        for loss in losses() {
            let (cost, weight) = loss.evaluate(1e-12);
            assert!((cost - 1e-12).abs() < 1e-20 && (weight - 1.0).abs() < 1e-9, "{loss:?}");
        }
    }

    #[test]
    fn losses_are_read_by_name_and_scale() {
        assert_eq!("cauchy:1".parse(), Ok(Loss::Cauchy(1.0)));
        assert_eq!("none".parse(), Ok(Loss::None));
        assert_eq!("huber".parse(), Ok(Loss::Huber(1.345)));
        for wrong in ["cauchy:0", "cauchy:-1", "tukey:nan", "huber:x", "l1", "none:1"] {
            assert!(wrong.parse::<Loss>().is_err(), "{wrong}");
        }
    }
}
