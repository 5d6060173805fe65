//! Things that are joined two by two, the best pair first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Joins the pair of the least cost, again and again, until no pair is left that has one.
///
/// What comes out depends on the costs alone; among pairs of equal cost the one whose things stand first is joined
/// first, so things in an order of their own (such as sorted ones) give the same result in any order of arrival.
///
/// * `cost` — what joining two costs, symmetric; `None` or NaN where they may not be joined.
/// * `join` — what two become, the one that stands first in front.
///
/// Returns what was never joined, in its order, then what was made, oldest first.
pub(crate) fn agglomerate<T>(
    items: Vec<T>,
    cost: impl Fn(&T, &T) -> Option<f64>,
    join: impl Fn(&T, &T) -> T,
) -> Vec<T> {
    let mut heap = BinaryHeap::new();
    let mut pool: Vec<Option<T>> = Vec::with_capacity(items.len());
    let mut waiting = items.into_iter();
    let mut made = None;
    while let Some(item) = made.take().or_else(|| waiting.next()) {
        let second = pool.len();
        for (first, other) in pool.iter().enumerate() {
            if let Some(other) = other
                && let Some(cost) = cost(other, &item).filter(|cost| !cost.is_nan())
            {
                heap.push(Reverse((Cost(cost), first, second)));
            }
        }
        pool.push(Some(item));
        if waiting.len() > 0 {
            continue;
        }
        while let Some(Reverse((_, first, second))) = heap.pop() {
            if let (Some(a), Some(b)) = (&pool[first], &pool[second]) {
                made = Some(join(a, b));
                (pool[first], pool[second]) = (None, None);
                break;
            }
        }
    }
    pool.into_iter().flatten().collect()
}

/// A cost that is a number.
#[derive(PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Intervals that are joined where they touch.
    fn union(intervals: Vec<(i32, i32)>) -> Vec<(i32, i32)> {
        let touch = |a: &(i32, i32), b: &(i32, i32)| {
            let gap = a.0.max(b.0) - a.1.min(b.1);
            (gap <= 0).then_some(f64::from(gap))
        };
        let mut found = agglomerate(intervals, touch, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        found.sort_unstable();
        found
    }

    proptest! {
        #[test]
        fn intervals_become_their_union(places in prop::collection::vec((0..200, 1..9), 0..40)) {
            let intervals: Vec<_> = places.iter().map(|(from, length)| (*from, from + length)).collect();
            let found = union(intervals.clone());
            prop_assert!(found.windows(2).all(|pair| pair[0].1 < pair[1].0));
            for place in 0..220 {
                let within = |list: &[(i32, i32)]| list.iter().any(|(from, to)| (*from..=*to).contains(&place));
                prop_assert_eq!(within(&found), within(&intervals));
            }
        }
    }

    #[test]
    fn the_closest_pair_is_joined_first() {
        // 10 is nearer to 12 than 0 is; joined, both are at 11, too far from 4.
        let near = |a: &f64, b: &f64| ((a - b).abs() <= 6.0).then_some((a - b).abs());
        assert_eq!(agglomerate(vec![4.0, 10.0, 12.0], near, |a, b| (a + b) / 2.0), [4.0, 11.0]);
        assert_eq!(agglomerate(vec![1.0, 1.0], |_, _| Some(f64::NAN), |a, _| *a), [1.0, 1.0]);
    }
}
