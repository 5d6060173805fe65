//! How figures spread over seeds.

/// Quantiles of some numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// How many there are.
    pub count: usize,
    /// The smallest.
    pub min: f64,
    /// Lower quartile.
    pub lower: f64,
    /// Median.
    pub median: f64,
    /// Upper quartile.
    pub upper: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// Quantiles, linear between neighbours; `None` without a number.
    #[must_use]
    pub fn of(numbers: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = numbers.into_iter().filter(|number| !number.is_nan()).collect();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        // Of quarters: the place is a whole number of them.
        let quantile = |quarters: usize| {
            let place = quarters * (sorted.len() - 1);
            let (low, high) = (sorted[place / 4], sorted[place.div_ceil(4)]);
            low + (high - low) * (place % 4) as f64 / 4.0
        };
        Some(Self {
            count: sorted.len(),
            min,
            lower: quantile(1),
            median: quantile(2),
            upper: quantile(3),
            max,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_neighbours() {
        let spread = Spread::of([4.0, f64::NAN, 1.0, 3.0, 2.0]).unwrap();
        let expected = Spread { count: 4, min: 1.0, lower: 1.75, median: 2.5, upper: 3.25, max: 4.0 };
        assert_eq!(spread, expected);
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::of([7.0]).unwrap().upper, 7.0);
    }
}
