//! Which depth map belongs to which colour image.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Pairs of stamps, one of each list, the closest first, each stamp in one pair at most.
///
/// What the benchmark's own tool finds by sorting all candidates: of what is left, the pair with the smallest
/// difference; of equal ones that with the earlier colour image, then the earlier depth map. Such a pair never has
/// another stamp between its two, so only neighbours are looked at, and the work is `O(n log n)` whatever the stamps.
///
/// * `colour`, `depth` — stamps, ascending, each once, nanoseconds.
/// * `most` — largest difference, nanoseconds.
///
/// Returns indexes into both lists, ascending.
///
/// # Source
/// `associate.py` of TUM RGB-D (Sturm et al. 2012): what it computes, not how. There differences have to be below the
/// largest one; here they may be equal to it.
pub(super) fn associate(colour: &[i64], depth: &[i64], most: i64) -> Vec<(usize, usize)> {
    // (stamp, is depth, index)
    let mut all: Vec<(i64, bool, usize)> = colour.iter().enumerate().map(|(i, s)| (*s, false, i)).collect();
    all.extend(depth.iter().enumerate().map(|(i, s)| (*s, true, i)));
    all.sort_unstable();
    let end = all.len();
    let mut before: Vec<Option<usize>> = (0..end).map(|place| place.checked_sub(1)).collect();
    let mut after: Vec<Option<usize>> =
        (0..end).map(|place| Some(place + 1).filter(|next| *next < end)).collect();
    let mut taken = vec![false; end];
    let candidate = |a: usize, b: usize| {
        let ((first, is_depth, _), (second, other, _)) = (all[a], all[b]);
        let apart = first.abs_diff(second);
        let stamps = if is_depth { (second, first) } else { (first, second) };
        (is_depth != other && i128::from(apart) <= i128::from(most)).then_some(Reverse((apart, stamps, a, b)))
    };
    let mut heap: BinaryHeap<_> = (1..end).filter_map(|place| candidate(place - 1, place)).collect();
    let mut pairs = Vec::new();
    while let Some(Reverse((_, _, a, b))) = heap.pop() {
        if taken[a] || taken[b] {
            continue;
        }
        (taken[a], taken[b]) = (true, true);
        let (colour, depth) = if all[a].1 { (all[b].2, all[a].2) } else { (all[a].2, all[b].2) };
        pairs.push((colour, depth));
        // They were neighbours; now those around them are.
        let (left, right) = (before[a], after[b]);
        if let Some(left) = left {
            after[left] = right;
        }
        if let Some(right) = right {
            before[right] = left;
        }
        if let (Some(left), Some(right)) = (left, right) {
            heap.extend(candidate(left, right));
        }
    }
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// What the benchmark's tool does.
    fn by_sorting_all(colour: &[i64], depth: &[i64], most: i64) -> Vec<(usize, usize)> {
        let mut candidates = Vec::new();
        for (i, a) in colour.iter().enumerate() {
            for (j, b) in depth.iter().enumerate() {
                if (a - b).abs() <= most {
                    candidates.push(((a - b).abs(), i, j));
                }
            }
        }
        candidates.sort_unstable();
        let (mut colours, mut depths, mut pairs) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for (_, i, j) in candidates {
            if !colours.contains(&i) && !depths.contains(&j) {
                colours.insert(i);
                depths.insert(j);
                pairs.insert((i, j));
            }
        }
        pairs.into_iter().collect()
    }

    proptest! {
        #[test]
        fn neighbours_are_enough(
            colour in prop::collection::btree_set(0..60_i64, 0..20),
            depth in prop::collection::btree_set(0..60_i64, 0..20),
            most in 0..12_i64,
        ) {
            let (colour, depth): (Vec<_>, Vec<_>) = (colour.into_iter().collect(), depth.into_iter().collect());
            prop_assert_eq!(associate(&colour, &depth, most), by_sorting_all(&colour, &depth, most));
        }
    }

    #[test]
    fn stamps_at_both_ends_of_time_are_far_apart() {
        assert_eq!(associate(&[i64::MIN, i64::MAX], &[i64::MAX], i64::MAX), [(1, 0)]);
        assert_eq!(associate(&[i64::MIN], &[i64::MAX], i64::MAX), []);
    }
}
