//! What a tracker or an optimiser gives: a path, a map, and how it came about.

use super::iteration::Iteration;
use super::map::{MapLine, MapPoint};
use super::sequence::Sequence;
use super::tracking::TrackedFrame;
use super::trajectory::TrajectoryPose;

/// An estimate: every row has its name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Name of the estimate.
    pub name: String,
    /// Estimated poses.
    pub trajectory: Vec<TrajectoryPose>,
    /// Estimated points.
    pub points: Vec<MapPoint>,
    /// Estimated lines.
    pub lines: Vec<MapLine>,
    /// What a tracker did in each frame; empty for an optimiser.
    pub tracking: Vec<TrackedFrame>,
    /// Steps of an optimiser; empty for a tracker.
    pub iterations: Vec<Iteration>,
}

impl Estimate {
    /// Whether a sequence has rows of an estimate of this name.
    #[must_use]
    pub fn is_in(sequence: &Sequence, name: &str) -> bool {
        sequence.trajectories.iter().any(|row| row.estimate == name)
            || sequence.map_points.iter().any(|row| row.estimate == name)
            || sequence.map_lines.iter().any(|row| row.estimate == name)
            || sequence.tracking.iter().any(|row| row.estimate == name)
            || sequence.iterations.iter().any(|row| row.estimate == name)
    }

    /// The rows of an estimate in a sequence; `None` when there are none.
    #[must_use]
    pub fn of(sequence: &Sequence, name: &str) -> Option<Self> {
        macro_rules! rows {
            ($table:ident) => {
                sequence.$table.iter().filter(|row| row.estimate == name).cloned().collect()
            };
        }
        Self::is_in(sequence, name).then(|| Self {
            name: name.to_owned(),
            trajectory: rows!(trajectories),
            points: rows!(map_points),
            lines: rows!(map_lines),
            tracking: rows!(tracking),
            iterations: rows!(iterations),
        })
    }

    /// Puts the estimate into a sequence, in place of rows of the same name; all rows get its name.
    pub fn put(self, sequence: &mut Sequence) {
        macro_rules! put {
            ($table:ident, $rows:ident) => {
                sequence.$table.retain(|row| row.estimate != self.name);
                sequence.$table.extend(self.$rows.into_iter().map(|mut row| {
                    row.estimate.clone_from(&self.name);
                    row
                }));
                sequence.$table.sort_by(super::Record::compare_key);
            };
        }
        put!(trajectories, trajectory);
        put!(map_points, points);
        put!(map_lines, lines);
        put!(tracking, tracking);
        put!(iterations, iterations);
    }
}
