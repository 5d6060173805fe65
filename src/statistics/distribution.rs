//! How numbers are spread: extremes, quartiles, mean, and a histogram of track lengths.

use schemars::JsonSchema;
use serde::Serialize;

/// How some numbers are spread.
///
/// The quantile `p` of `n` ascending numbers is at place `p (n − 1)`, counted from 0; between two places it is interpolated
/// linearly (definition 7 of Hyndman and Fan 1996, the default of `NumPy`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Distribution {
    /// How many numbers there are.
    pub count: u64,
    /// The smallest.
    pub min: f64,
    /// A quarter is smaller.
    pub lower_quartile: f64,
    /// Half are smaller.
    pub median: f64,
    /// Their sum over their count.
    pub mean: f64,
    /// A quarter is larger.
    pub upper_quartile: f64,
    /// The largest.
    pub max: f64,
}

impl Distribution {
    /// The distribution of the finite numbers; `None` without any.
    #[must_use]
    pub fn new(numbers: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = numbers.into_iter().filter(|number| number.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        Some(Self {
            count: sorted.len() as u64,
            min,
            lower_quartile: quantile(&sorted, 1, 4),
            median: quantile(&sorted, 1, 2),
            mean: sorted.iter().sum::<f64>() / sorted.len() as f64,
            upper_quartile: quantile(&sorted, 3, 4),
            max,
        })
    }
}

/// The quantile `part / of` of ascending numbers, of which there is one at least.
fn quantile(sorted: &[f64], part: usize, of: usize) -> f64 {
    let place = part * (sorted.len() - 1);
    let low = sorted[place / of];
    let high = sorted[place.div_ceil(of)];
    low + (high - low) * ((place % of) as f64 / of as f64)
}

/// Landmarks whose tracks have a length within bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct TrackBin {
    /// Shortest track of the bin, frames: a power of two.
    pub at_least: u64,
    /// Longest track of the bin, frames.
    pub at_most: u64,
    /// Landmarks with such a track.
    pub landmarks: u64,
}

/// Histogram of track lengths, in bins from each power of two to the next; up to the longest track.
pub(super) fn track_bins(lengths: impl Iterator<Item = u32>) -> Vec<TrackBin> {
    let mut bins: Vec<TrackBin> = Vec::new();
    for length in lengths.filter(|length| *length > 0) {
        let bin = length.ilog2() as usize;
        while bins.len() <= bin {
            let at_least = 1 << bins.len();
            bins.push(TrackBin { at_least, at_most: 2 * at_least - 1, landmarks: 0 });
        }
        bins[bin].landmarks += 1;
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.percentile([1, 2, 4, 8, 16, 32], [0, 25, 50, 75, 100])
        let found = Distribution::new([32.0, 1.0, 2.0, f64::NAN, 4.0, 16.0, 8.0]).unwrap();
        let quartiles = [found.min, found.lower_quartile, found.median, found.upper_quartile, found.max];
        assert_eq!(quartiles, [1.0, 2.5, 6.0, 14.0, 32.0]);
        assert_eq!((found.count, found.mean), (6, 10.5));
        assert_eq!(Distribution::new([f64::INFINITY]), None);
    }

    proptest! {
        #[test]
        fn a_distribution_goes_up_and_forgets_the_order(numbers in prop::collection::vec(-1e6..1e6_f64, 1..40)) {
            let found = Distribution::new(numbers.iter().copied()).unwrap();
            let line = [found.min, found.lower_quartile, found.median, found.upper_quartile, found.max];
            prop_assert!(line.is_sorted());
            prop_assert_eq!(Distribution::new(numbers.into_iter().rev()), Some(found));
        }

        #[test]
        fn every_landmark_is_in_the_bin_of_its_length(lengths in prop::collection::vec(1_u32..5000, 0..60)) {
            let bins = track_bins(lengths.iter().copied());
            for bin in &bins {
                let within = |length: &&u32| (bin.at_least..=bin.at_most).contains(&u64::from(**length));
                prop_assert_eq!(bin.landmarks, lengths.iter().filter(within).count() as u64);
            }
            prop_assert_eq!(bins.iter().map(|bin| bin.landmarks).sum::<u64>(), lengths.len() as u64);
        }
    }
}
