//! A reader that counts, and stops where there is too much.

use std::cell::Cell;
use std::io::{self, Read};

/// Counts what is read of a file, and tells it.
pub(super) struct Watched<'a, R> {
    inner: R,
    read: u64,
    total: u64,
    progress: &'a dyn Fn(u64, u64),
}

impl<'a, R> Watched<'a, R> {
    pub(super) fn new(inner: R, total: u64, progress: &'a dyn Fn(u64, u64)) -> Self {
        Self { inner, read: 0, total, progress }
    }
}

impl<R: Read> Read for Watched<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = self.inner.read(buffer)?;
        self.read += length as u64;
        (self.progress)(self.read.min(self.total), self.total);
        Ok(length)
    }
}

/// Ends with an error once more than a limit of bytes has come; sees how many zeros they end with.
pub(super) struct Metered<'a, R> {
    inner: R,
    left: &'a Cell<u64>,
    zeros: &'a Cell<u64>,
}

impl<'a, R> Metered<'a, R> {
    /// * `left` — bytes that may still come.
    /// * `zeros` — zeros at the end of what has come.
    pub(super) fn new(inner: R, left: &'a Cell<u64>, zeros: &'a Cell<u64>) -> Self {
        Self { inner, left, zeros }
    }
}

/// What an error is when the meter has run out.
pub(super) const RUN_OUT: io::ErrorKind = io::ErrorKind::QuotaExceeded;

impl<R: Read> Read for Metered<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = self.inner.read(buffer)?;
        let left = self.left.get().checked_sub(length as u64).ok_or_else(|| io::Error::from(RUN_OUT))?;
        self.left.set(left);
        let zeros = buffer[..length].iter().rev().take_while(|byte| **byte == 0).count();
        self.zeros.set(if zeros == length { self.zeros.get() + zeros as u64 } else { zeros as u64 });
        Ok(length)
    }
}
