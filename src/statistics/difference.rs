//! How far measurements are from observations: mean and spread, without keeping the numbers.

use schemars::JsonSchema;
use serde::Serialize;

/// Differences of measurements and observations of the same landmark in the same frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Difference {
    /// Differences that were found.
    pub count: u64,
    /// Their mean, in the unit of the member's name.
    pub mean: f64,
    /// Their standard deviation, in the unit of the member's name.
    pub sigma: f64,
    /// The largest absolute value, in the unit of the member's name.
    pub largest: f64,
}

/// Gathers differences.
///
/// # Source
/// Welford, *Note on a method for calculating corrected sums of squares and products*, 1962.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Differences {
    count: u64,
    mean: f64,
    squares: f64,
    largest: f64,
}

impl Differences {
    /// Adds a difference; one that is not finite is passed over.
    pub(super) fn add(&mut self, difference: f64) {
        if !difference.is_finite() {
            return;
        }
        self.count += 1;
        let from_mean = difference - self.mean;
        self.mean += from_mean / self.count as f64;
        self.squares += from_mean * (difference - self.mean);
        self.largest = self.largest.max(difference.abs());
    }

    /// What was found; `None` without any, or where the numbers are beyond reason.
    pub(super) fn finish(self) -> Option<Difference> {
        let Self { count, mean, squares, largest } = self;
        let sigma = (squares / count as f64).sqrt();
        (sigma.is_finite() && mean.is_finite()).then_some(Difference { count, mean, sigma, largest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_sigma_are_those_of_the_definition() {
        let mut found = Differences::default();
        [1e9 + 1.0, 1e9 + 2.0, 1e9 + 6.0, f64::NAN].into_iter().for_each(|number| found.add(number));
        let found = found.finish().unwrap();
        // Numbers of 1e9 are exact to 1.2e-7.
        assert!((found.mean - (1e9 + 3.0)).abs() < 1e-6);
        assert!((found.sigma - (14.0_f64 / 3.0).sqrt()).abs() < 1e-6);
        assert_eq!((found.count, found.largest), (3, 1e9 + 6.0));
        assert_eq!(Differences::default().finish(), None);
    }
}
