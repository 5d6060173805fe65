//! Segments in a tree, so that whole boxes out of view are passed over.

use super::View;
use super::places::PlaceSet;
use super::tree::Tree;
use crate::geometry::Segment;

/// Segments sorted into a tree of boxes.
#[derive(Clone, Debug, Default)]
pub struct LineIndex {
    tree: Tree,
}

impl LineIndex {
    /// An index of segments, named by their places.
    #[must_use]
    pub fn new(lines: &[Segment]) -> Self {
        let boxes: Vec<_> =
            lines.iter().map(|line| [line.start.inf(&line.end), line.start.sup(&line.end)]).collect();
        Self { tree: Tree::new(&boxes) }
    }

    /// Names of the segments that may be in the frustum of a view, ascending: every one that is, and few others.
    ///
    /// * `set` — an empty set with room for every segment; it is empty again afterwards.
    #[must_use]
    pub fn near(&self, view: &View, set: &mut PlaceSet) -> Vec<u32> {
        let mut at = 0;
        while let Some(node) = self.tree.nodes.get(at) {
            let found = view.classify_box(&node.center, &node.half);
            if found == Some(true) || (found.is_some() && node.exit == at + 1) {
                self.tree.order[node.begin..node.end].iter().for_each(|id| set.insert(*id));
            }
            at = if found == Some(false) { at + 1 } else { node.exit };
        }
        set.drain()
    }
}

#[cfg(test)]
mod tests {
    use super::super::view::tests::{point, view};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_segment_in_view_is_passed_over(
            view in view(), ends in prop::collection::vec((point(6.0), point(1.0)), 0..200),
        ) {
            let lines: Vec<Segment> =
                ends.into_iter().map(|(start, along)| Segment { start, end: start + along.coords }).collect();
            let found = LineIndex::new(&lines).near(&view, &mut PlaceSet::new(lines.len()));
            prop_assert!(found.is_sorted_by(|one, other| one < other));
            for (place, line) in (0_u32..).zip(&lines) {
                if view.clip(&line.start, &line.end).is_some() {
                    prop_assert!(found.binary_search(&place).is_ok(), "{}", place);
                }
            }
        }
    }
}
