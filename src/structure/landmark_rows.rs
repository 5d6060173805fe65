//! Which rows show which landmark, gathered frame by frame in about two bytes a row.

use std::collections::HashMap;
use std::hash::Hash;

use super::id::FrameId;

/// Rows by landmark: the landmark, its frames ascending, and the row in each.
pub type RowsOfLandmark<Id> = (Id, Vec<FrameId>, Vec<i64>);

/// Which rows of a table are kept in another, a bit each.
#[derive(Clone, Debug, Default)]
pub struct KeptRows {
    words: Vec<u64>,
    len: usize,
    kept: u64,
}

impl KeptRows {
    /// Says whether the next row is kept.
    pub fn push(&mut self, keep: bool) {
        if self.len.is_multiple_of(64) {
            self.words.push(0);
        }
        if let Some(word) = self.words.last_mut() {
            *word |= u64::from(keep) << (self.len % 64);
        }
        self.len += 1;
        self.kept += u64::from(keep);
    }

    /// Whether a row is kept; no row that was never mentioned is.
    #[must_use]
    pub fn get(&self, row: usize) -> bool {
        self.words.get(row / 64).is_some_and(|word| word >> (row % 64) & 1 == 1)
    }

    /// How many rows are kept.
    #[must_use]
    pub const fn kept(&self) -> u64 {
        self.kept
    }
}

/// Gathers which landmark each row of a per-frame table shows, and turns that round piece by piece.
///
/// Two bytes or so are kept for each row, so that the correspondences of a sequence too long for memory can
/// still be written: see [`pieces`](Self::pieces).
#[derive(Clone, Debug)]
pub struct LandmarkRows<Id> {
    places: HashMap<Id, u32>,
    ids: Vec<Id>,
    counts: Vec<u64>,
    frames: Vec<RowsOfFrame>,
    rows: usize,
    /// Whether landmarks ascend within every frame, as they do in a file.
    ascending: bool,
}

/// The landmarks of a frame's rows by their places: the step from each to the next, in turn 0, −1, 1, −2, …
/// as 0, 1, 2, 3, …, seven bits a byte, the lowest first.
#[derive(Clone, Debug)]
struct RowsOfFrame {
    frame_id: FrameId,
    steps: Box<[u8]>,
}

/// How far a frame was gone through.
#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    byte: usize,
    place: u32,
    /// Number of the next row in the table, and in the table of kept rows.
    row: usize,
    number: i64,
}

impl RowsOfFrame {
    /// The place of the next row, and the byte after it.
    fn next(&self, Cursor { mut byte, place, .. }: Cursor) -> Option<(u32, usize)> {
        let (mut code, mut shift) = (0_u64, 0);
        loop {
            let bits = *self.steps.get(byte)?;
            byte += 1;
            code |= u64::from(bits & 0x7f) << shift;
            if bits < 0x80 {
                break;
            }
            shift += 7;
        }
        let step = (code >> 1).cast_signed() ^ -(code & 1).cast_signed();
        let place = i64::from(place) + step;
        Some((u32::try_from(place).unwrap_or(u32::MAX), byte))
    }
}

/// Appends the step from one place to another.
fn push_step(steps: &mut Vec<u8>, from: u32, to: u32) {
    let step = i64::from(to) - i64::from(from);
    let mut code = (step << 1 ^ step >> 63).cast_unsigned();
    #[expect(clippy::cast_possible_truncation, reason = "seven bits")]
    while code >= 0x80 {
        steps.push(code as u8 | 0x80);
        code >>= 7;
    }
    #[expect(clippy::cast_possible_truncation, reason = "seven bits")]
    steps.push(code as u8);
}

impl<Id> Default for LandmarkRows<Id> {
    fn default() -> Self {
        Self {
            places: HashMap::new(),
            ids: Vec::new(),
            counts: Vec::new(),
            frames: Vec::new(),
            rows: 0,
            ascending: true,
        }
    }
}

impl<Id: Copy + Ord + Hash> LandmarkRows<Id> {
    /// Adds the landmarks of the next rows of the table, which belong to one frame.
    pub fn push_frame(&mut self, frame_id: FrameId, landmarks: impl IntoIterator<Item = Id>) {
        let mut steps = Vec::new();
        let (mut last, mut before) = (0, None);
        for id in landmarks {
            let place = *self.places.entry(id).or_insert_with(|| {
                self.ids.push(id);
                self.counts.push(0);
                u32::try_from(self.ids.len() - 1).unwrap_or(u32::MAX)
            });
            self.counts[place as usize] += 1;
            self.rows += 1;
            self.ascending &= before.is_none_or(|before| before <= id);
            push_step(&mut steps, last, place);
            (last, before) = (place, Some(id));
        }
        self.frames.push(RowsOfFrame { frame_id, steps: steps.into() });
    }

    /// Rows so far.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.rows
    }

    /// Whether there is no row yet.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// Landmarks with their numbers of rows, ascending by landmark.
    #[must_use]
    pub fn counts(&self) -> Vec<(Id, u64)> {
        self.order().into_iter().map(|place| (self.ids[place], self.counts[place])).collect()
    }

    /// The rows of every landmark, ascending by landmark, in pieces of about `limit` rows.
    ///
    /// A landmark is never cut, so one with more rows than `limit` makes a larger piece; so does a frame
    /// whose landmarks do not ascend, which makes all rows one piece.
    pub fn pieces(&self, limit: u64) -> impl Iterator<Item = Vec<RowsOfLandmark<Id>>> + '_ {
        self.pieces_where(self.counts.clone(), limit, |_| true)
    }

    /// As [`pieces`](Self::pieces), of the table that has the kept rows of this one alone, numbered anew.
    pub fn pieces_of<'a>(
        &'a self,
        kept: &'a KeptRows,
        limit: u64,
    ) -> impl Iterator<Item = Vec<RowsOfLandmark<Id>>> + 'a {
        let mut counts = vec![0; self.ids.len()];
        self.go_through(|row, place| counts[place as usize] += u64::from(kept.get(row)));
        self.pieces_where(counts, limit, |row| kept.get(row))
    }

    /// Calls a function with the number of every row and the place of its landmark.
    fn go_through(&self, mut visit: impl FnMut(usize, u32)) {
        let mut row = 0;
        for frame in &self.frames {
            let mut cursor = Cursor::default();
            while let Some((place, byte)) = frame.next(cursor) {
                visit(row, place);
                row += 1;
                cursor = Cursor { byte, place, ..cursor };
            }
        }
    }

    fn pieces_where<'a>(
        &'a self,
        counts: Vec<u64>,
        limit: u64,
        keep: impl Fn(usize) -> bool + 'a,
    ) -> impl Iterator<Item = Vec<RowsOfLandmark<Id>>> + 'a {
        let limit = if self.ascending { limit } else { u64::MAX };
        let mut order = self.order();
        order.retain(|place| counts[*place] > 0);
        let mut cursors = Vec::new();
        let mut begin = 0;
        std::iter::from_fn(move || {
            if begin == order.len() {
                return None;
            }
            if begin == 0 {
                cursors = self.cursors(&keep);
            }
            let mut end = begin;
            let mut rows = 0;
            while end < order.len() && (end == begin || rows + counts[order[end]] <= limit) {
                rows += counts[order[end]];
                end += 1;
            }
            let piece = self.piece(&order[begin..end], &counts, &keep, &mut cursors);
            begin = end;
            Some(piece)
        })
    }

    /// Places of the landmarks, ascending by landmark.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.ids.len()).collect();
        order.sort_unstable_by_key(|place| self.ids[*place]);
        order
    }

    /// The beginnings of all frames.
    fn cursors(&self, keep: &impl Fn(usize) -> bool) -> Vec<Cursor> {
        let (mut row, mut number) = (0, 0);
        self.frames
            .iter()
            .map(|frame| {
                let cursor = Cursor { row, number, ..Cursor::default() };
                // One byte of each row ends it.
                for _ in frame.steps.iter().filter(|byte| **byte < 0x80) {
                    number += i64::from(keep(row));
                    row += 1;
                }
                cursor
            })
            .collect()
    }

    /// The next piece, of landmarks that follow those of the pieces before.
    fn piece(
        &self,
        places: &[usize],
        counts: &[u64],
        keep: &impl Fn(usize) -> bool,
        cursors: &mut [Cursor],
    ) -> Vec<RowsOfLandmark<Id>> {
        const ELSEWHERE: u32 = u32::MAX;
        let mut slot_of = vec![ELSEWHERE; self.ids.len()];
        let mut lists: Vec<RowsOfLandmark<Id>> = Vec::with_capacity(places.len());
        for (slot, place) in (0_u32..).zip(places) {
            slot_of[*place] = slot;
            let count = usize::try_from(counts[*place]).unwrap_or(0);
            lists.push((self.ids[*place], Vec::with_capacity(count), Vec::with_capacity(count)));
        }
        let Some(last) = lists.last().map(|list| list.0) else { return lists };
        for (frame, cursor) in self.frames.iter().zip(cursors) {
            while let Some((place, byte)) = frame.next(*cursor) {
                // In ascending frames what is beyond the piece waits for the next.
                if self.ascending && self.ids[place as usize] > last {
                    break;
                }
                let kept = keep(cursor.row);
                let slot = slot_of[place as usize];
                if kept && slot != ELSEWHERE {
                    let list = &mut lists[slot as usize];
                    list.1.push(frame.frame_id);
                    list.2.push(cursor.number);
                }
                *cursor =
                    Cursor { byte, place, row: cursor.row + 1, number: cursor.number + i64::from(kept) };
            }
        }
        lists
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pieces_of_any_size_hold_every_row_once(
            frames in prop::collection::vec(prop::collection::btree_set(0_i64..20, 0..12), 0..12),
            limit in 1_u64..40,
        ) {
            let mut gathered = LandmarkRows::default();
            let mut expected: std::collections::BTreeMap<i64, (Vec<FrameId>, Vec<i64>)> = Default::default();
            let mut row = 0;
            for (frame, ids) in (0_i64..).zip(&frames) {
                gathered.push_frame(FrameId(frame), ids.iter().copied());
                for id in ids {
                    let list = expected.entry(*id).or_default();
                    list.0.push(FrameId(frame));
                    list.1.push(row);
                    row += 1;
                }
            }
            let whole: Vec<_> = gathered.pieces(u64::MAX).flatten().collect();
            prop_assert_eq!(&gathered.pieces(limit).flatten().collect::<Vec<_>>(), &whole);
            let expected: Vec<_> = expected.into_iter().map(|(id, (frames, rows))| (id, frames, rows)).collect();
            prop_assert_eq!(whole, expected);
            for piece in gathered.pieces(limit) {
                let rows: usize = piece.iter().map(|list| list.2.len()).sum();
                prop_assert!(piece.len() == 1 || rows as u64 <= limit);
            }
        }

        #[test]
        fn rows_in_any_order_are_gathered_as_well(
            frames in prop::collection::vec(prop::collection::vec(0_i64..20, 0..12), 0..12), limit in 1_u64..40,
        ) {
            let mut gathered = LandmarkRows::default();
            let mut expected: std::collections::BTreeMap<i64, (Vec<FrameId>, Vec<i64>)> = Default::default();
            let mut row = 0;
            for (frame, ids) in (0_i64..).zip(&frames) {
                gathered.push_frame(FrameId(frame), ids.iter().copied());
                for id in ids {
                    let list = expected.entry(*id).or_default();
                    list.0.push(FrameId(frame));
                    list.1.push(row);
                    row += 1;
                }
            }
            let found: Vec<_> = gathered.pieces(limit).flatten().collect();
            let expected: Vec<_> = expected.into_iter().map(|(id, (frames, rows))| (id, frames, rows)).collect();
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn kept_rows_are_those_of_a_table_that_has_them_alone(
            frames in prop::collection::vec(prop::collection::btree_map(0_i64..20, any::<bool>(), 0..12), 0..12),
            limit in 1_u64..40,
        ) {
            let (mut all, mut alone, mut kept) =
                (LandmarkRows::default(), LandmarkRows::default(), KeptRows::default());
            for (frame, rows) in (0_i64..).zip(&frames) {
                all.push_frame(FrameId(frame), rows.keys().copied());
                alone.push_frame(FrameId(frame), rows.iter().filter(|row| *row.1).map(|row| *row.0));
                rows.values().for_each(|keep| kept.push(*keep));
            }
            prop_assert_eq!(kept.kept(), alone.len() as u64);
            let found: Vec<_> = all.pieces_of(&kept, limit).collect();
            prop_assert_eq!(found, alone.pieces(limit).collect::<Vec<_>>());
        }
    }
}
