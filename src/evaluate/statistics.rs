//! Seven numbers that sum up many.

use serde::Serialize;

/// Statistics of errors, as evo defines them.
///
/// `rmse = √(1/n Σ e²)`, `sse = Σ e²`, `std = √(1/n Σ (e − mean)²)`; the median of an even count is the mean of the middle
/// two. The unit is that of the errors, its square for `sse`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// How many errors there are.
    pub count: usize,
    /// The largest.
    pub max: f64,
    /// Their mean.
    pub mean: f64,
    /// The one in the middle.
    pub median: f64,
    /// The smallest.
    pub min: f64,
    /// Root of the mean square.
    pub rmse: f64,
    /// Sum of squares.
    pub sse: f64,
    /// Standard deviation of the population.
    pub std: f64,
}

impl Statistics {
    /// Statistics of numbers; `None` without any.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len();
        let half = count / 2;
        let median =
            if count.is_multiple_of(2) { 0.5 * sorted[half - 1] + 0.5 * sorted[half] } else { sorted[half] };
        let n = count as f64;
        let sse: f64 = values.iter().map(|value| value * value).sum();
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / n;
        Some(Self { count, max, mean, median, min, rmse: (sse / n).sqrt(), sse, std: variance.sqrt() })
    }

    /// The seven numbers with their names, in the order of evo's output.
    #[must_use]
    pub fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("max", self.max),
            ("mean", self.mean),
            ("median", self.median),
            ("min", self.min),
            ("rmse", self.rmse),
            ("sse", self.sse),
            ("std", self.std),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nothing_has_no_statistics_and_one_number_is_all_of_them() {
        assert_eq!(Statistics::of(&[]), None);
        let one = Statistics::of(&[3.0]).unwrap();
        assert_eq!(one.named().map(|(_, value)| value), [3.0, 3.0, 3.0, 3.0, 3.0, 9.0, 0.0]);
    }

    proptest! {
        #[test]
        fn mean_square_is_square_of_the_mean_and_variance(values in prop::collection::vec(0.0..10.0_f64, 1..50)) {
            let found = Statistics::of(&values).unwrap();
            // Rounding of fifty squares up to 100.
            prop_assert!((found.rmse.powi(2) - found.mean.powi(2) - found.std.powi(2)).abs() < 1e-11);
            prop_assert!((found.sse - found.rmse.powi(2) * found.count as f64).abs() < 1e-10);
            prop_assert!(found.min <= found.median && found.median <= found.max);
            prop_assert!(found.min <= found.mean + 1e-12 && found.mean <= found.rmse + 1e-12);
            let smaller = values.iter().filter(|value| **value < found.median).count();
            let larger = values.iter().filter(|value| **value > found.median).count();
            prop_assert!(2 * smaller <= values.len() && 2 * larger <= values.len());
        }
    }
}
