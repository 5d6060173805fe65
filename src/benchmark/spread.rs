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
        let quantile = |part: f64| {
            let place = part * (sorted.len() - 1) as f64;
            let below = place.floor();
            let (low, high) = (sorted[below as usize], sorted[place.ceil() as usize]);
            low + (high - low) * (place - below)
        };
        Some(Self {
            count: sorted.len(),
            min,
            lower: quantile(0.25),
            median: quantile(0.5),
            upper: quantile(0.75),
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
