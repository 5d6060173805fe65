//! Columns of numbers for the page: one block of little-endian bytes, and what stands where in it.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// Where a column stands in the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Column {
    /// `f32`, `u32`, `u16` or `u8`.
    kind: &'static str,
    /// First byte; a multiple of 4.
    offset: usize,
    /// Numbers.
    length: usize,
}

impl Column {
    /// Whether there is no number.
    pub(super) const fn is_empty(&self) -> bool {
        self.length == 0
    }
}

/// A block that grows.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    bytes: Vec<u8>,
}

impl Columns {
    fn column(&mut self, kind: &'static str, length: usize, bytes: impl Iterator<Item = u8>) -> Column {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        Column { kind, offset, length }
    }

    /// Adds numbers that are rounded to single precision, about seven digits.
    #[expect(clippy::cast_possible_truncation, reason = "said above")]
    pub(super) fn f32(&mut self, numbers: &[f64]) -> Column {
        self.column("f32", numbers.len(), numbers.iter().flat_map(|number| (*number as f32).to_le_bytes()))
    }

    /// Adds whole numbers, two bytes each where all fit, else four.
    pub(super) fn whole(&mut self, numbers: &[u32]) -> Column {
        let narrow: Option<Vec<u16>> = numbers.iter().map(|number| u16::try_from(*number).ok()).collect();
        match narrow {
            Some(narrow) => self.u16(&narrow),
            None => self.column("u32", numbers.len(), numbers.iter().flat_map(|number| number.to_le_bytes())),
        }
    }

    /// Adds whole numbers of two bytes.
    pub(super) fn u16(&mut self, numbers: &[u16]) -> Column {
        self.column("u16", numbers.len(), numbers.iter().flat_map(|number| number.to_le_bytes()))
    }

    /// Adds whole numbers of one byte.
    pub(super) fn u8(&mut self, numbers: &[u8]) -> Column {
        self.column("u8", numbers.len(), numbers.iter().copied())
    }

    /// The block in base64.
    pub(super) fn base64(&self) -> String {
        STANDARD.encode(&self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_begin_at_multiples_of_four() {
        let mut columns = Columns::default();
        assert_eq!(columns.u8(&[7]), Column { kind: "u8", offset: 0, length: 1 });
        assert_eq!(columns.whole(&[1, 65_535]), Column { kind: "u16", offset: 4, length: 2 });
        assert_eq!(columns.whole(&[65_536]), Column { kind: "u32", offset: 8, length: 1 });
        assert_eq!(columns.f32(&[0.5]), Column { kind: "f32", offset: 12, length: 1 });
        let bytes = STANDARD.decode(columns.base64()).unwrap();
        assert_eq!(bytes, [7, 0, 0, 0, 1, 0, 255, 255, 0, 0, 1, 0, 0, 0, 0, 63]);
    }
}
