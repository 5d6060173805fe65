//! Numbers cut into parts at given places, one task for each: without a list of the parts.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Calls with runs of at most `most` items and what arrays hold for them, on all cores.
///
/// * `items` — names of the items; `most` — items of one call.
/// * `arrays` — the numbers of all items, of each kind one array.
/// * `start` — where the numbers of an item begin in each array; of the last item's successor, where they end.
///
/// How items are put together depends on their number alone.
pub(super) fn for_each_part<const K: usize>(
    items: Range<usize>,
    most: usize,
    arrays: [&mut [f64]; K],
    start: &(impl Fn(usize) -> [usize; K] + Sync),
    each: &(impl Fn(Range<usize>, [&mut [f64]; K]) + Sync),
) {
    let count = items.len();
    if count == 0 {
        return;
    }
    if count <= most {
        return each(items, arrays);
    }
    // The left side takes whole runs.
    let middle = items.start + count.div_ceil(most).div_ceil(2) * most;
    let (first, cut) = (start(items.start), start(middle));
    let mut rest = arrays.map(Some);
    let left: [&mut [f64]; K] = std::array::from_fn(|k| {
        let (left, right) = rest[k].take().unwrap_or_default().split_at_mut(cut[k] - first[k]);
        rest[k] = Some(right);
        left
    });
    let right = rest.map(Option::unwrap_or_default);
    rayon::join(
        || for_each_part(items.start..middle, most, left, start, each),
        || for_each_part(middle..items.end, most, right, start, each),
    );
}

/// Whether all tasks said yes.
pub(super) struct AllTrue(AtomicBool);

impl AllTrue {
    pub(super) fn new() -> Self {
        Self(AtomicBool::new(true))
    }

    pub(super) fn and(&self, answer: bool) {
        if !answer {
            self.0.store(false, Ordering::Relaxed);
        }
    }

    pub(super) fn get(self) -> bool {
        self.0.into_inner()
    }
}

/// Room that tasks lend each other, so that each need not make its own.
#[derive(Default)]
pub(super) struct Spares(Mutex<Vec<Vec<usize>>>);

impl Spares {
    /// Calls with a list that holds whatever it held before.
    pub(super) fn lend<T>(&self, use_it: impl FnOnce(&mut Vec<usize>) -> T) -> T {
        let mut list = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        let found = use_it(&mut list);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(list);
        found
    }
}

/// Where things of these sizes begin one after the other, and where the last one ends.
pub(super) fn starts(sizes: impl IntoIterator<Item = usize>) -> Vec<usize> {
    let mut end = 0;
    let ends = sizes.into_iter().map(|size| {
        end += size;
        end
    });
    std::iter::once(0).chain(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_item_gets_its_own_numbers(
            sizes in proptest::collection::vec((0..5_usize, 1..3_usize), 0..60),
            most in 1..20_usize,
        ) {
            let a_start = starts(sizes.iter().map(|size| size.0));
            let b_start = starts(sizes.iter().map(|size| size.1));
            let mut a = vec![-1.0; a_start[sizes.len()]];
            let mut b = vec![-1.0; b_start[sizes.len()]];
            let start = |item: usize| [a_start[item], b_start[item]];
            for_each_part(0..sizes.len(), most, [&mut a, &mut b], &start, &|items, [a, b]| {
                assert!(items.len() <= most);
                for item in items.clone() {
                    a[a_start[item] - a_start[items.start]..a_start[item + 1] - a_start[items.start]].fill(item as f64);
                    b[b_start[item] - b_start[items.start]..b_start[item + 1] - b_start[items.start]].fill(item as f64);
                }
            });
            for item in 0..sizes.len() {
                prop_assert!(a[a_start[item]..a_start[item + 1]].iter().all(|number| *number == item as f64));
                prop_assert!(b[b_start[item]..b_start[item + 1]].iter().all(|number| *number == item as f64));
            }
        }
    }

    #[test]
    fn one_no_is_enough() {
        let all = AllTrue::new();
        all.and(true);
        all.and(false);
        all.and(true);
        assert!(!all.get());
    }
}
