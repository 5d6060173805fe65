//! Work on several threads whose results come in order.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

/// What a thread made, or the panic it ended with.
type Made<T> = Result<T, Box<dyn Any + Send>>;

/// What the threads share.
struct Bench<T> {
    state: Mutex<State<T>>,
    /// An item was made.
    made: Condvar,
    /// An item was taken, or no more are wanted.
    room: Condvar,
}

struct State<T> {
    /// The next to be made.
    next: usize,
    /// Items from here on may not be begun.
    end: usize,
    /// Made and not yet taken.
    made: BTreeMap<usize, Made<T>>,
}

/// Makes items on threads and hands them over in order, on the calling thread.
///
/// What is handed over, and where it ends, does not depend on the number of threads.
///
/// * `count` — items are 0 to `count - 1`.
/// * `threads` — that make items, beside the calling one; 0 counts as 1.
/// * `window` — most items that exist at a time: being made, made, or in `take`; 0 counts as 1.
/// * `make` — makes an item, in any order.
/// * `take` — is given each item by its number, in order; an error ends the work.
///
/// # Errors
/// The error of `take`. Items that were begun are finished and dropped, none is begun after it.
///
/// # Panics
/// A panic of `make` goes on on the calling thread when the item's turn comes, one of `take` at once.
pub fn ordered<T: Send, E>(
    count: usize,
    threads: usize,
    window: usize,
    make: impl Fn(usize) -> T + Sync,
    mut take: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    let window = window.max(1);
    let threads = threads.clamp(1, window.min(count.max(1)));
    let bench = Bench {
        state: Mutex::new(State { next: 0, end: window.min(count), made: BTreeMap::new() }),
        made: Condvar::new(),
        room: Condvar::new(),
    };
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| bench.work(count, &make));
        }
        // However this ends, workers that wait for room have to be told.
        let _stop = Stop(&bench);
        for number in 0..count {
            match bench.await_item(number) {
                Ok(item) => take(number, item)?,
                Err(panic) => resume_unwind(panic),
            }
            bench.lock().end = count.min(number + 1 + window);
            bench.room.notify_one();
        }
        Ok(())
    })
}

impl<T: Send> Bench<T> {
    /// No user's code runs under the lock, so that it is never poisoned.
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes items until there are no more.
    fn work(&self, count: usize, make: &(impl Fn(usize) -> T + Sync)) {
        loop {
            let mut state = self.lock();
            while state.next >= state.end && state.next < count {
                state = self.room.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            if state.next >= count {
                return;
            }
            let number = state.next;
            state.next += 1;
            drop(state);
            let item = catch_unwind(AssertUnwindSafe(|| make(number)));
            self.lock().made.insert(number, item);
            self.made.notify_one();
        }
    }

    /// Waits until an item is there.
    fn await_item(&self, number: usize) -> Made<T> {
        let mut state = self.lock();
        loop {
            if let Some(item) = state.made.remove(&number) {
                return item;
            }
            state = self.made.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Tells workers that no more items are wanted when it goes.
struct Stop<'a, T: Send>(&'a Bench<T>);

impl<T: Send> Drop for Stop<'_, T> {
    fn drop(&mut self) {
        self.0.lock().next = usize::MAX;
        self.0.room.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn items_come_in_order_on_any_number_of_threads(
            count in 0..60_usize, threads in 0..9_usize, window in 0..9_usize, last in 0..80_usize,
        ) {
            let mut taken = Vec::new();
            let found = ordered(count, threads, window, |number| number * number, |number, item| {
                taken.push((number, item));
                if number == last { Err(number) } else { Ok(()) }
            });
            prop_assert_eq!(found, if last < count { Err(last) } else { Ok(()) });
            let expected: Vec<_> = (0..count.min(last + 1)).map(|number| (number, number * number)).collect();
            prop_assert_eq!(taken, expected);
        }
    }

    /// Counts those of its kind that exist.
    struct Counted<'a>(&'a AtomicUsize);

    impl Drop for Counted<'_> {
        fn drop(&mut self) {
            self.0.fetch_sub(1, Ordering::SeqCst);
        }
    }

    #[test]
    fn no_more_than_the_window_exist_at_a_time() {
        for (threads, window) in [(1, 1), (3, 2), (4, 4), (2, 7)] {
            let (alive, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
            let make = |number| {
                most.fetch_max(alive.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                // The first of each window is the slowest: the others run ahead as far as they may.
                thread::sleep(Duration::from_micros(if number % window == 0 { 900 } else { 20 }));
                Counted(&alive)
            };
            let taken = |_, item| {
                thread::sleep(Duration::from_micros(100));
                drop(item);
                Ok::<(), ()>(())
            };
            ordered(50, threads, window, make, taken).unwrap();
            assert_eq!(alive.load(Ordering::SeqCst), 0);
            let most = most.load(Ordering::SeqCst);
            assert!(most <= window, "{threads} threads, window {window}: {most}");
        }
    }

    #[test]
    fn threads_work_at_the_same_time() {
        let barrier = std::sync::Barrier::new(3);
        let make = |_| barrier.wait().is_leader();
        let mut leaders = 0;
        let take = |_, leader| {
            leaders += usize::from(leader);
            Ok::<(), ()>(())
        };
        // Each waits for two others: one thread alone would wait for ever.
        ordered(12, 3, 3, make, take).unwrap();
        assert_eq!(leaders, 4);
    }

    #[test]
    fn nothing_is_begun_after_an_error() {
        let begun = AtomicUsize::new(0);
        let make = |_| begun.fetch_add(1, Ordering::SeqCst);
        let found =
            ordered(1_000_000, 2, 4, make, |number, _| if number == 10 { Err("full") } else { Ok(()) });
        assert_eq!(found, Err("full"));
        assert!(begun.load(Ordering::SeqCst) <= 14, "{begun:?}");
    }

    #[test]
    fn a_panic_of_a_thread_comes_in_its_turn() {
        let mut taken = 0;
        let found = catch_unwind(AssertUnwindSafe(|| {
            ordered(
                20,
                3,
                5,
                |number| assert_ne!(number, 7, "made to fail"),
                |_, ()| {
                    taken += 1;
                    Ok::<(), ()>(())
                },
            )
        }));
        assert!(found.is_err());
        assert_eq!(taken, 7);
    }

    #[test]
    fn a_panic_of_the_taker_leaves_no_thread_waiting() {
        let found = catch_unwind(|| {
            ordered(
                20,
                3,
                2,
                |number| number,
                |number, _| {
                    assert_ne!(number, 3, "made to fail");
                    Ok::<(), ()>(())
                },
            )
        });
        assert!(found.is_err());
    }
}
