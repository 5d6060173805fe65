//! How often numbers of each size occur, as curves of a chart.

use super::super::axis::Axis;
use super::curve::{Curve, Drawn, Role};

/// Bins of a histogram.
const BINS: usize = 30;
/// The part of all numbers that has bins of its own; the few beyond share the last one, so that they do not take the room of the others.
const SHOWN: f64 = 0.99;

/// Histograms over the same bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// A curve for each list of numbers: left ends of bins, and how many of the numbers lie in each, percent.
    pub curves: Vec<Curve>,
    /// Where the last bin begins if it holds what is beyond as well.
    pub last_from: Option<f64>,
}

/// Histograms of some lists of numbers that are not under 0, the n-th as the n-th series; a number that is not finite is passed over.
#[must_use]
pub fn histogram(named: &[(&str, Vec<f64>)]) -> Histogram {
    let mut all: Vec<f64> =
        named.iter().flat_map(|(_, numbers)| numbers).copied().filter(|number| number.is_finite()).collect();
    all.sort_unstable_by(f64::total_cmp);
    let most = all.get(last_shown(all.len())).copied().unwrap_or(0.0);
    let high = Axis::from_zero(most).ends()[1];
    let width = high / BINS as f64;
    let beyond = all.last().is_some_and(|last| *last > high);
    let curve = |(place, (name, numbers)): (usize, &(&str, Vec<f64>))| Curve {
        name: (*name).to_owned(),
        role: Role::Series(place),
        places: (0..BINS)
            .map(|bin| width * bin as f64)
            .zip(percents(numbers, width))
            .map(|(x, y)| [x, y])
            .collect(),
        drawn: Drawn::Steps(width),
    };
    Histogram {
        curves: named.iter().enumerate().map(curve).collect(),
        last_from: beyond.then_some(width * (BINS - 1) as f64),
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a length")]
fn last_shown(count: usize) -> usize {
    ((count as f64 * SHOWN) as usize).min(count.saturating_sub(1))
}

/// How many of some numbers are in each bin, percent.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
fn percents(numbers: &[f64], width: f64) -> Vec<f64> {
    let mut counts = vec![0.0; BINS];
    let finite = || numbers.iter().filter(|number| number.is_finite());
    let each = 100.0 / finite().count().max(1) as f64;
    for number in finite() {
        counts[(number / width).clamp(0.0, (BINS - 1) as f64) as usize] += each;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_everything_and_say_what_is_beyond() {
        let mut numbers: Vec<f64> = (0..1000).map(|n| f64::from(n) / 1000.0).collect();
        numbers.extend([50.0, f64::NAN]);
        let found = histogram(&[("a", numbers), ("b", vec![0.0])]);
        for curve in &found.curves {
            let sum: f64 = curve.places.iter().map(|place| place[1]).sum();
            assert!((sum - 100.0).abs() < 1e-9, "{sum}");
        }
        assert_eq!(found.curves[0].places.len(), BINS);
        // The axis ends at 1.
        assert!((found.last_from.unwrap() - 29.0 / 30.0).abs() < 1e-12);
        assert_eq!(found.curves[1].places[0], [0.0, 100.0]);
        assert_eq!(histogram(&[("c", vec![1.0, 2.0])]).last_from, None);
    }
}
