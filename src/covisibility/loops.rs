//! Where a path closes loops: landmarks that are seen again after a gap.

use std::collections::BTreeMap;

use super::LoopRule;
use super::key_frames::Vertex;

/// A landmark, point or line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Landmark {
    Point(i64),
    Line(i64),
}

/// Where a landmark was seen.
#[derive(Default)]
struct Sightings {
    /// Frames that saw it, ascending.
    frames: Vec<usize>,
    /// Where in `frames` the current run begins.
    run: usize,
}

/// Pairs of frames, later and earlier, that close a loop, by the later one.
///
/// A landmark begins a new run when it was not seen for `gap` frames. A frame closes a loop to the earlier frame that saw
/// most of the landmarks that are in a run not older than `gap` frames and had one before.
pub(super) fn loops(vertices: &[Vertex<'_>], rule: LoopRule) -> Vec<(usize, usize)> {
    let mut seen: BTreeMap<Landmark, Sightings> = BTreeMap::new();
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (place, vertex) in vertices.iter().enumerate() {
        let points = vertex.frame.points.iter().map(|row| Landmark::Point(row.point_id.0));
        let lines = vertex.frame.lines.iter().map(|row| Landmark::Line(row.line_id.0));
        let mut votes: BTreeMap<usize, usize> = BTreeMap::new();
        for landmark in points.chain(lines) {
            let sightings = seen.entry(landmark).or_default();
            if sightings.frames.last().is_some_and(|last| place - last >= rule.gap) {
                sightings.run = sightings.frames.len();
            }
            sightings.frames.push(place);
            let begun = sightings.frames[sightings.run];
            if sightings.run > 0 && place - begun <= rule.gap {
                for earlier in &sightings.frames[..sightings.run] {
                    *votes.entry(*earlier).or_default() += 1;
                }
            }
        }
        let spaced = found.last().is_none_or(|(last, _)| place - last >= rule.spacing);
        // The first of those with most votes.
        let best = votes.into_iter().max_by_key(|(earlier, count)| (*count, usize::MAX - earlier));
        if let Some((earlier, count)) = best
            && spaced
            && count >= rule.least_shared
        {
            found.push((place, earlier));
        }
    }
    found
}
