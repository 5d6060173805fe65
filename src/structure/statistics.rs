//! Counting what each frame sees: the paper's statistical analysis.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::{FrameId, FrameStatistics, GroupId, LineId, Sequence};

/// Side of a cell, pixels (paper, section II-B).
pub const CELL_SIZE_PX: f64 = 10.0;

#[derive(Default)]
struct Tally {
    points: i64,
    lines: i64,
    cells: HashSet<(i64, i64)>,
    groups: BTreeMap<GroupId, i64>,
}

impl Tally {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float-to-integer cast saturates, which is right here"
    )]
    fn occupy(&mut self, u: f64, v: f64) {
        self.cells.insert(((u / CELL_SIZE_PX).floor() as i64, (v / CELL_SIZE_PX).floor() as i64));
    }
}

/// Statistics of every frame, in table order.
///
/// Counted over the measurements; over the observations where a sequence has no measurement of the
/// kind. A cell is occupied when a point or an end of a segment lies in it; cells are aligned with
/// the image's origin. A line that is in no group adds no constraint.
///
/// # Source
/// Open-Structure (Li et al. 2024), section II-B.
#[must_use]
pub fn frame_statistics(sequence: &Sequence) -> Vec<FrameStatistics> {
    let mut groups_of: HashMap<LineId, Vec<GroupId>> = HashMap::new();
    for group in &sequence.structural_groups {
        for line in &group.line_ids {
            groups_of.entry(*line).or_default().push(group.group_id);
        }
    }
    let mut tallies: BTreeMap<FrameId, Tally> =
        sequence.frames.iter().map(|frame| (frame.frame_id, Tally::default())).collect();

    macro_rules! count_points {
        ($rows:expr) => {
            for row in $rows {
                let tally = tallies.entry(row.frame_id).or_default();
                tally.points += 1;
                tally.occupy(row.u, row.v);
            }
        };
    }
    macro_rules! count_lines {
        ($rows:expr) => {
            for row in $rows {
                let tally = tallies.entry(row.frame_id).or_default();
                tally.lines += 1;
                tally.occupy(row.start_u, row.start_v);
                tally.occupy(row.end_u, row.end_v);
                for group in groups_of.get(&row.line_id).into_iter().flatten() {
                    *tally.groups.entry(*group).or_default() += 1;
                }
            }
        };
    }
    if sequence.point_measurements.is_empty() {
        count_points!(&sequence.point_observations);
    } else {
        count_points!(&sequence.point_measurements);
    }
    if sequence.line_measurements.is_empty() {
        count_lines!(&sequence.line_observations);
    } else {
        count_lines!(&sequence.line_measurements);
    }

    tallies
        .into_iter()
        .map(|(frame_id, tally)| FrameStatistics {
            frame_id,
            point_count: tally.points,
            line_count: tally.lines,
            occupied_cells: i64::try_from(tally.cells.len()).unwrap_or(i64::MAX),
            structural_constraints: tally.groups.values().map(|lines| lines - 1).sum(),
        })
        .collect()
}
