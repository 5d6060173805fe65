//! Colours that people with any kind of colour vision can tell apart.

use std::collections::BTreeMap;

use ::foxglove::messages::Color;

use crate::structure::{LineId, StructuralGroup};

/// Colours of groups: those of Okabe and Ito (2008) but for green, which marks points, and black.
const PALETTE: [[f64; 3]; 6] = [
    [0.902, 0.624, 0.0],   // orange
    [0.337, 0.706, 0.914], // sky blue
    [0.8, 0.475, 0.655],   // reddish purple
    [0.941, 0.894, 0.259], // yellow
    [0.0, 0.447, 0.698],   // blue
    [0.835, 0.369, 0.0],   // vermilion
];
/// Each round through the palette is this much darker than the one before, down to two fifths.
const DARKER: [f64; 3] = [1.0, 0.65, 0.4];
/// Points: Okabe and Ito's bluish green.
pub(in crate::format) const POINT: Color = Color { r: 0.0, g: 0.62, b: 0.451, a: 1.0 };
/// Lines of no group.
const UNGROUPED: Color = Color { r: 0.55, g: 0.55, b: 0.55, a: 1.0 };

/// The colour of each line.
#[derive(Default)]
pub(in crate::format) struct GroupColors {
    groups: usize,
    /// Rank of the group of each line.
    group_of: BTreeMap<LineId, usize>,
}

impl GroupColors {
    /// Gives the next colour to a group; a line in two groups keeps its first.
    pub(in crate::format) fn add(&mut self, group: &StructuralGroup) {
        for line in &group.line_ids {
            self.group_of.entry(*line).or_insert(self.groups);
        }
        self.groups += 1;
    }

    /// Lines by colour, the colours in the order of the groups, those of no group first.
    pub(in crate::format) fn by_color<T>(
        &self,
        lines: impl Iterator<Item = (LineId, T)>,
    ) -> Vec<(Color, Vec<T>)> {
        let mut runs: BTreeMap<Option<usize>, Vec<T>> = BTreeMap::new();
        for (line, value) in lines {
            let group = self.group_of.get(&line).copied();
            runs.entry(group).or_default().push(value);
        }
        runs.into_iter().map(|(group, values)| (group.map_or(UNGROUPED, color), values)).collect()
    }
}

/// The colour of the group of a rank.
fn color(rank: usize) -> Color {
    let shade = DARKER[rank / PALETTE.len() % DARKER.len()];
    let [r, g, b] = PALETTE[rank % PALETTE.len()].map(|part| part * shade);
    Color { r, g, b, a: 1.0 }
}
