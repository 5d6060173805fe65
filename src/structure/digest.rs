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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{FrameId, FrameStatistics};

    fn digest(rows: &[FrameStatistics]) -> String {
        let mut digest = ContentDigest::default();
        digest.update(rows);
        digest.finish()
    }

    #[test]
    fn a_column_of_a_minor_version_leaves_no_trace_where_it_is_absent() {
        let mut row = FrameStatistics { frame_id: FrameId(7), point_count: 3, ..FrameStatistics::default() };
        let version_1_0: Vec<u8> =
            [7_i64, 3, 0, 0, 0].iter().flat_map(|number| number.to_le_bytes()).collect();
        assert_eq!(digest(std::slice::from_ref(&row)), hex(&Sha256::digest(&version_1_0)));

        row.covered_cells = Some(5);
        let name = b"\x0d\0\0\0\0\0\0\0covered_cells".iter().copied();
        let with = version_1_0.into_iter().chain(name).chain([1]).chain(5_i64.to_le_bytes());
        assert_eq!(digest(&[row]), hex(&Sha256::digest(with.collect::<Vec<_>>())));
    }
}
