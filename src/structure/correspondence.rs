//! Which rows show the same landmark: the observation lists turned round.

use super::id::{FrameId, LineId, PointId};
use super::record::record;
use super::{LineMeasurement, LineObservation, PointMeasurement, PointObservation};

record! {
    /// All rows of one table that show one point.
    pub struct PointCorrespondence in point_correspondences (Whole, Optional, key: [table, point_id]) {
        /// Table of the rows: `point_measurements` or `point_observations`.
        ["1", "-"]
        table: String,
        /// Point that the rows show.
        ["1", "-"]
        point_id: PointId,
        /// Frames of the rows, ascending.
        ["1", "-"]
        frame_ids: Vec<FrameId>,
        /// Row numbers in the table, counted from 0, one per frame.
        ["1", "-"]
        rows: Vec<i64>,
    }
}

record! {
    /// All rows of one table that show one line.
    pub struct LineCorrespondence in line_correspondences (Whole, Optional, key: [table, line_id]) {
        /// Table of the rows: `line_measurements` or `line_observations`.
        ["1", "-"]
        table: String,
        /// Line that the rows show.
        ["1", "-"]
        line_id: LineId,
        /// Frames of the rows, ascending.
        ["1", "-"]
        frame_ids: Vec<FrameId>,
        /// Row numbers in the table, counted from 0, one per frame.
        ["1", "-"]
        rows: Vec<i64>,
    }
}

/// Rows by landmark: `(id, frames, rows)`, ascending by id.
fn turned<Id: Copy + Ord>(pairs: impl Iterator<Item = (Id, FrameId)>) -> Vec<(Id, Vec<FrameId>, Vec<i64>)> {
    let mut keyed: Vec<(Id, FrameId, i64)> =
        (0..).zip(pairs).map(|(row, (id, frame))| (id, frame, row)).collect();
    keyed.sort_unstable();
    keyed
        .chunk_by(|left, right| left.0 == right.0)
        .map(|run| {
            (run[0].0, run.iter().map(|entry| entry.1).collect(), run.iter().map(|entry| entry.2).collect())
        })
        .collect()
}

/// Correspondences of the points in whichever of the two tables has rows, ordered as they are stored.
#[must_use]
pub fn point_correspondences(
    measurements: &[PointMeasurement],
    observations: &[PointObservation],
) -> Vec<PointCorrespondence> {
    let measured = turned(measurements.iter().map(|row| (row.point_id, row.frame_id)));
    let observed = turned(observations.iter().map(|row| (row.point_id, row.frame_id)));
    [("point_measurements", measured), ("point_observations", observed)]
        .into_iter()
        .flat_map(|(table, lists)| {
            lists.into_iter().map(move |(point_id, frame_ids, rows)| PointCorrespondence {
                table: table.to_owned(),
                point_id,
                frame_ids,
                rows,
            })
        })
        .collect()
}

/// Correspondences of the lines in whichever of the two tables has rows, ordered as they are stored.
#[must_use]
pub fn line_correspondences(
    measurements: &[LineMeasurement],
    observations: &[LineObservation],
) -> Vec<LineCorrespondence> {
    let measured = turned(measurements.iter().map(|row| (row.line_id, row.frame_id)));
    let observed = turned(observations.iter().map(|row| (row.line_id, row.frame_id)));
    [("line_measurements", measured), ("line_observations", observed)]
        .into_iter()
        .flat_map(|(table, lists)| {
            lists.into_iter().map(move |(line_id, frame_ids, rows)| LineCorrespondence {
                table: table.to_owned(),
                line_id,
                frame_ids,
                rows,
            })
        })
        .collect()
}
