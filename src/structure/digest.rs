//! The digest of a table's content, the same for every encoding.

use std::fmt::Write as _;

use sha2::{Digest, Sha256};

use super::record::Record;

/// SHA-256 over the canonical bytes of rows, see the specification's section on digests.
#[derive(Clone, Default)]
pub struct ContentDigest {
    hasher: Sha256,
    buffer: Vec<u8>,
    rows: u64,
}

impl ContentDigest {
    /// Adds rows, in table order.
    pub fn update<R: Record>(&mut self, rows: &[R]) {
        for run in rows.chunks(1024) {
            self.buffer.clear();
            run.iter().for_each(|row| row.digest(&mut self.buffer));
            self.hasher.update(&self.buffer);
        }
        self.rows += rows.len() as u64;
    }

    /// Rows added so far.
    #[must_use]
    pub const fn rows(&self) -> u64 {
        self.rows
    }

    /// The digest, as 64 lower-case hexadecimal digits.
    #[must_use]
    pub fn finish(self) -> String {
        hex(&self.hasher.finalize())
    }
}

/// Bytes as lower-case hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(bytes.len() * 2), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
