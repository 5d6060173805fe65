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
