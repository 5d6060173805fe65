//! Which frames show the same landmarks.

use std::collections::HashMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::distribution::Distribution;

/// How far apart frames are whose shared landmarks are counted.
pub const FRAMES_APART: [usize; 8] = [1, 2, 5, 10, 20, 50, 100, 200];
/// Shared points from which two frames count as covisible.
pub const COVISIBLE_POINTS: u32 = 15;
/// Most pairs of rows that are looked at to count covisible frames: bounds the time to about a second.
const MOST_PAIRS: u64 = 200_000_000;

/// Landmarks that frames share which are so many frames apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct SharedApart {
    /// Distance of the two frames in the table `frames`.
    pub frames_apart: u64,
    /// Landmarks that both frames of a pair show.
    pub shared: Distribution,
}

/// Who shows whom: four bytes for each row, and four more for each while covisible frames are counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Covisibility {
    indices: HashMap<i64, u32>,
    /// Frames that show each landmark, by index: the length of its track.
    tracks: Vec<u32>,
    /// Last frame that showed it, counted from 1.
    last_frame: Vec<u32>,
    /// Landmarks of all frames, one frame after the other.
    shown: Vec<u32>,
    /// Where the landmarks of each frame end.
    ends: Vec<usize>,
}

impl Covisibility {
    /// Index of a landmark that the current frame shows; `None` when it was shown in this frame already.
    pub(super) fn show(&mut self, landmark: i64) -> Option<u32> {
        let next = u32::try_from(self.indices.len()).ok()?;
        let index = *self.indices.entry(landmark).or_insert(next);
        if index == next {
            self.tracks.push(0);
            self.last_frame.push(0);
        }
        let (place, frame) = (index as usize, u32::try_from(self.ends.len() + 1).ok()?);
        if self.last_frame[place] == frame {
            return None;
        }
        self.last_frame[place] = frame;
        self.tracks[place] += 1;
        self.shown.push(index);
        Some(index)
    }

    /// Ends the current frame.
    pub(super) fn end_frame(&mut self) {
        self.ends.push(self.shown.len());
    }

    /// Length of each landmark's track, frames, in the order of first appearance.
    pub(super) fn tracks(&self) -> &[u32] {
        &self.tracks
    }

    fn frame(&self, frame: usize) -> &[u32] {
        let begin = if frame == 0 { 0 } else { self.ends[frame - 1] };
        &self.shown[begin..self.ends[frame]]
    }

    /// Landmarks shared by frames that are 1, 2, 5 … frames apart.
    pub(super) fn shared_apart(&self) -> Vec<SharedApart> {
        let frames = self.ends.len();
        let mut counts: Vec<Vec<f64>> = vec![Vec::new(); FRAMES_APART.len()];
        let mut shown_by = vec![usize::MAX; self.tracks.len()];
        for frame in 0..frames {
            for landmark in self.frame(frame) {
                shown_by[*landmark as usize] = frame;
            }
            for (apart, counts) in
                FRAMES_APART.iter().zip(&mut counts).filter(|(apart, _)| frame + *apart < frames)
            {
                let shared = self.frame(frame + apart).iter();
                counts.push(shared.filter(|landmark| shown_by[**landmark as usize] == frame).count() as f64);
            }
        }
        FRAMES_APART
            .iter()
            .zip(counts)
            .filter_map(|(apart, counts)| {
                Some(SharedApart { frames_apart: *apart as u64, shared: Distribution::new(counts)? })
            })
            .collect()
    }

    /// For a frame, how many others share at least 15 landmarks with it.
    ///
    /// Every frame is looked at, or every second, third … where that would be over 2·10⁸ pairs of rows.
    pub(super) fn covisible_frames(&self) -> Option<Distribution> {
        let pairs: u64 = self.tracks.iter().map(|track| u64::from(*track) * u64::from(*track)).sum();
        let stride = usize::try_from(pairs.div_ceil(MOST_PAIRS)).unwrap_or(usize::MAX).max(1);
        // Frames of each landmark, one landmark after the other.
        let mut begins = Vec::with_capacity(self.tracks.len());
        let mut next = 0_usize;
        for track in &self.tracks {
            begins.push(next);
            next += *track as usize;
        }
        let mut places = begins.clone();
        let mut frames_of = vec![0_u32; self.shown.len()];
        for frame in 0..self.ends.len() {
            for landmark in self.frame(frame) {
                let place = &mut places[*landmark as usize];
                frames_of[*place] = u32::try_from(frame).unwrap_or(u32::MAX);
                *place += 1;
            }
        }
        let mut shared = vec![0_u32; self.ends.len()];
        let numbers = (0..self.ends.len()).step_by(stride).map(|frame| {
            shared.fill(0);
            for landmark in self.frame(frame) {
                let (begin, length) = (begins[*landmark as usize], self.tracks[*landmark as usize]);
                for other in &frames_of[begin..begin + length as usize] {
                    shared[*other as usize] += 1;
                }
            }
            shared[frame] = 0;
            shared.iter().filter(|shared| **shared >= COVISIBLE_POINTS).count() as f64
        });
        Distribution::new(numbers)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use proptest::prelude::*;

    fn shown(frames: &[BTreeSet<i64>]) -> Covisibility {
        let mut covisibility = Covisibility::default();
        for frame in frames {
            for landmark in frame {
                assert!(covisibility.show(*landmark).is_some());
                assert!(covisibility.show(*landmark).is_none(), "shown already");
            }
            covisibility.end_frame();
        }
        covisibility
    }

    proptest! {
        #[test]
        fn counts_are_those_of_sets(
            frames in prop::collection::vec(prop::collection::btree_set(-20_i64..20, 0..35), 0..14),
        ) {
            let found = shown(&frames);
            for apart in FRAMES_APART {
                let pairs = frames.iter().zip(frames.iter().skip(apart));
                let counts = pairs.map(|(one, other)| one.intersection(other).count() as f64);
                let among = found.shared_apart().into_iter().find(|shared| shared.frames_apart == apart as u64);
                prop_assert_eq!(among.map(|shared| shared.shared), Distribution::new(counts));
            }
            let covisible = (0..frames.len()).map(|frame| {
                let others = frames.iter().enumerate().filter(|(other, _)| *other != frame);
                let enough = |shared: &BTreeSet<i64>| frames[frame].intersection(shared).count() >= 15;
                others.filter(|(_, other)| enough(other)).count() as f64
            });
            prop_assert_eq!(found.covisible_frames(), Distribution::new(covisible));
            let rows: usize = frames.iter().map(BTreeSet::len).sum();
            prop_assert_eq!(found.tracks().iter().sum::<u32>() as usize, rows);
        }
    }
}
