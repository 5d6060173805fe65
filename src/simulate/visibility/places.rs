//! Ascending lists of places: as bits while they are found, and in a byte or two each while they are kept.

/// A set of places, a bit each.
#[derive(Clone, Debug)]
pub struct PlaceSet {
    words: Vec<u64>,
}

impl PlaceSet {
    /// An empty set of places below `count`.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self { words: vec![0; count.div_ceil(64)] }
    }

    /// Adds a place.
    pub(super) fn insert(&mut self, place: u32) {
        self.words[place as usize / 64] |= 1 << (place % 64);
    }

    /// Adds every place of a set with room for as many.
    pub(super) fn unite(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(word, other)| *word |= other);
    }

    /// The places, ascending; the set is empty then.
    pub(super) fn drain(&mut self) -> Vec<u32> {
        let count: u32 = self.words.iter().map(|word| word.count_ones()).sum();
        let mut places = Vec::with_capacity(count as usize);
        let mut buffer = [0; 64];
        for (base, word) in (0_u32..).step_by(64).zip(&mut self.words) {
            let mut bits = std::mem::take(word);
            if bits.count_ones() > 40 {
                // Runs, of which there are few.
                let mut at = base;
                while bits != 0 {
                    let skipped = bits.trailing_zeros();
                    at += skipped;
                    let run = (bits >> skipped).trailing_ones();
                    places.extend(at..at + run);
                    at += run;
                    bits = bits.checked_shr(skipped + run).unwrap_or(0);
                }
            } else {
                let mut len = 0;
                while bits != 0 {
                    buffer[len % 64] = base + bits.trailing_zeros();
                    len += 1;
                    bits &= bits - 1;
                }
                places.extend_from_slice(&buffer[..len]);
            }
        }
        places
    }
}

/// An ascending list of places in a byte or two each: the steps from one to the next, seven bits a byte, the
/// lowest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Places {
    bytes: Vec<u8>,
    len: usize,
    last: u32,
}

impl Places {
    /// Number of places.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a place that is not below the last.
    pub fn push(&mut self, place: u32) {
        debug_assert!(place >= self.last, "{place} after {}", self.last);
        let mut step = place.wrapping_sub(self.last);
        #[expect(clippy::cast_possible_truncation, reason = "seven bits")]
        while step >= 0x80 {
            self.bytes.push(step as u8 | 0x80);
            step >>= 7;
        }
        #[expect(clippy::cast_possible_truncation, reason = "seven bits")]
        self.bytes.push(step as u8);
        self.len += 1;
        self.last = place;
    }

    /// The places, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        let mut bytes = self.bytes.iter();
        let mut last = 0_u32;
        std::iter::from_fn(move || {
            let (mut step, mut shift) = (0, 0);
            loop {
                let byte = *bytes.next()?;
                step |= u32::from(byte & 0x7f) << shift;
                if byte < 0x80 {
                    break;
                }
                shift += 7;
            }
            last = last.wrapping_add(step);
            Some(last)
        })
    }

    /// Gives back memory that is not used.
    pub fn shrink_to_fit(&mut self) {
        self.bytes.shrink_to_fit();
    }
}

impl FromIterator<u32> for Places {
    /// Of places in ascending order.
    fn from_iter<I: IntoIterator<Item = u32>>(places: I) -> Self {
        let mut list = Self::default();
        places.into_iter().for_each(|place| list.push(place));
        list.shrink_to_fit();
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn places_come_back_as_they_went_in(places in prop::collection::btree_set(any::<u32>(), 0..50)) {
            let places: Vec<u32> = places.into_iter().collect();
            let list: Places = places.iter().copied().collect();
            prop_assert_eq!(list.len(), places.len());
            prop_assert_eq!(list.iter().collect::<Vec<_>>(), places);
        }

        #[test]
        fn a_set_gives_its_places_ascending_and_is_empty_then(
            places in prop::collection::vec(0_u32..300, 0..400), more in 0_u32..300,
        ) {
            let (mut set, mut other) = (PlaceSet::new(300), PlaceSet::new(300));
            let mut expected = places.clone();
            expected.extend(more..300);
            places.iter().for_each(|place| set.insert(*place));
            (more..300).for_each(|place| other.insert(place));
            set.unite(&other);
            expected.sort_unstable();
            expected.dedup();
            prop_assert_eq!(set.drain(), expected);
            prop_assert_eq!(set.drain(), Vec::<u32>::new());
        }
    }
}
