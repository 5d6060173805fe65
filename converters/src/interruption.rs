//! What an interrupted program waits for.

use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Read while `OpenCV` works: a process that ends then takes away from under it what it works with, and crashes.
static WORKING: RwLock<()> = RwLock::new(());

/// Held by a thread for as long as `OpenCV` works on it; not twice by one thread.
pub(crate) fn working() -> RwLockReadGuard<'static, ()> {
    WORKING.read().unwrap_or_else(PoisonError::into_inner)
}

/// Waits until `OpenCV` works on no thread; it begins on none as long as this is held.
///
/// For a program that is about to end while other threads go on.
#[must_use = "without it nothing rests"]
pub fn rest() -> RwLockWriteGuard<'static, ()> {
    WORKING.write().unwrap_or_else(PoisonError::into_inner)
}
