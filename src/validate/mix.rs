//! Sums of hashes: whether two tables say the same, whatever the order, in a few bytes.

/// A good mixer of 64 bits (the finaliser of `SplitMix64`).
#[inline]
pub(crate) const fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// The hash of a multiset: equal for equal ones, and for others with a chance of about 2⁻¹²⁸.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Mix {
    low: u64,
    high: u64,
}

impl Mix {
    /// Adds one element.
    #[inline]
    pub(crate) fn add(&mut self, element: u64) {
        self.low = self.low.wrapping_add(mix(element));
        self.high = self.high.wrapping_add(mix(element ^ 0x5851_f42d_4c95_7f2d));
    }
}

/// One element: a row of a table that shows a landmark in a frame.
#[inline]
pub(crate) const fn shown(row: i64, landmark: i64, frame: i64) -> u64 {
    let hash = mix(row.cast_unsigned());
    let hash = mix(hash ^ landmark.cast_unsigned());
    mix(hash ^ frame.cast_unsigned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(elements: &[(i64, i64, i64)]) -> Mix {
        let mut sum = Mix::default();
        elements.iter().for_each(|(row, landmark, frame)| sum.add(shown(*row, *landmark, *frame)));
        sum
    }

    #[test]
    fn order_does_not_matter_and_everything_else_does() {
        let right = sum(&[(0, 7, 1), (1, 8, 1), (2, 7, 3)]);
        assert_eq!(right, sum(&[(2, 7, 3), (0, 7, 1), (1, 8, 1)]));
        for wrong in [
            &[(0, 7, 1), (1, 8, 1)][..],
            &[(0, 7, 1), (1, 8, 1), (2, 7, 3), (2, 7, 3)],
            &[(0, 8, 1), (1, 7, 1), (2, 7, 3)],
            &[(0, 7, 1), (2, 8, 1), (1, 7, 3)],
            &[(0, 7, 3), (1, 8, 1), (2, 7, 1)],
        ] {
            assert_ne!(right, sum(wrong));
        }
    }
}
