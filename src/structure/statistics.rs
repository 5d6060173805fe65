//! Counting what each frame sees: the paper's statistical analysis.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::{Camera, FrameBundle, FrameStatistics, GroupId, LineId, Sequence, StructuralGroup};

/// Side of a cell, pixels (paper, section II-B).
pub const CELL_SIZE_PX: f64 = 10.0;

/// Counts what frames see, one at a time.
///
/// Measurements are counted; observations where the sequence has no measurement of the kind. A cell is
/// occupied when a point or an end of a segment lies in it; cells are aligned with the image's origin.
/// A line that is in no group adds no constraint.
///
/// # Source
/// Open-Structure (Li et al. 2024), section II-B.
#[derive(Clone, Debug)]
pub struct FrameCounter {
    groups_of: HashMap<LineId, Vec<GroupId>>,
    measured_points: bool,
    measured_lines: bool,
}

impl FrameCounter {
    /// A counter for the frames of one sequence.
    ///
    /// * `measured_points`, `measured_lines` — whether the sequence has any measurement of the kind;
    ///   observations are counted where it has none.
    #[must_use]
    pub fn new(
        groups: &[StructuralGroup],
        _cameras: &[Camera],
        measured_points: bool,
        measured_lines: bool,
    ) -> Self {
        let mut groups_of: HashMap<LineId, Vec<GroupId>> = HashMap::new();
        for group in groups {
            for line in &group.line_ids {
                groups_of.entry(*line).or_default().push(group.group_id);
            }
        }
        Self { groups_of, measured_points, measured_lines }
    }

    /// Statistics of a frame.
    ///
    /// * `previous` — the frame before it in the table `frames`, with its rows; `None` for the first.
    #[must_use]
    pub fn count(&self, _previous: Option<&FrameBundle>, frame: &FrameBundle) -> FrameStatistics {
        let mut tally = Tally::default();
        macro_rules! points {
            ($rows:expr) => {
                for row in $rows {
                    tally.points += 1;
                    tally.occupy(row.u, row.v);
                }
            };
        }
        macro_rules! lines {
            ($rows:expr) => {
                for row in $rows {
                    tally.lines += 1;
                    tally.occupy(row.start_u, row.start_v);
                    tally.occupy(row.end_u, row.end_v);
                    for group in self.groups_of.get(&row.line_id).into_iter().flatten() {
                        *tally.groups.entry(*group).or_default() += 1;
                    }
                }
            };
        }
        if self.measured_points {
            points!(&frame.point_measurements);
        } else {
            points!(&frame.point_observations);
        }
        if self.measured_lines {
            lines!(&frame.line_measurements);
        } else {
            lines!(&frame.line_observations);
        }
        FrameStatistics {
            frame_id: frame.frame.frame_id,
            point_count: tally.points,
            line_count: tally.lines,
            occupied_cells: i64::try_from(tally.cells.len()).unwrap_or(i64::MAX),
            structural_constraints: tally.groups.values().map(|lines| lines - 1).sum(),
        }
    }
}

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

/// Statistics of every frame of a sequence, in table order; see [`FrameCounter`].
#[must_use]
pub fn frame_statistics(sequence: &Sequence) -> Vec<FrameStatistics> {
    let counter = FrameCounter::new(
        &sequence.structural_groups,
        &sequence.manifest.cameras,
        !sequence.point_measurements.is_empty(),
        !sequence.line_measurements.is_empty(),
    );
    let mut previous: Option<FrameBundle> = None;
    sequence
        .bundles()
        .map(|frame| {
            let statistics = counter.count(previous.as_ref(), &frame);
            previous = Some(frame);
            statistics
        })
        .collect()
}
