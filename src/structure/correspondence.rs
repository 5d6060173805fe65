//! Which rows show the same landmark: the observation lists turned round.

use std::hash::Hash;

use super::id::{FrameId, LineId, PointId};
use super::landmark_rows::{LandmarkRows, RowsOfLandmark};
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

macro_rules! from_rows {
    ($record:ident, $id:ident: $type:ident, $($table:literal),+) => {
        impl $record {
            #[doc = concat!("The row of a landmark, for the rows of the table ", $("`", $table, "` ",)+ "that show it.")]
            #[must_use]
            pub fn new(table: &str, ($id, frame_ids, rows): RowsOfLandmark<$type>) -> Self {
                Self { table: table.to_owned(), $id, frame_ids, rows }
            }
        }
    };
}
from_rows!(PointCorrespondence, point_id: PointId, "point_measurements", "point_observations");
from_rows!(LineCorrespondence, line_id: LineId, "line_measurements", "line_observations");

/// Rows by landmark, ascending by id; rows of one frame stand together.
fn turned<Id: Copy + Ord + Hash>(rows: impl Iterator<Item = (Id, FrameId)>) -> Vec<RowsOfLandmark<Id>> {
    let rows: Vec<(Id, FrameId)> = rows.collect();
    let mut gathered = LandmarkRows::default();
    for run in rows.chunk_by(|left, right| left.1 == right.1) {
        gathered.push_frame(run[0].1, run.iter().map(|row| row.0));
    }
    gathered.pieces(u64::MAX).flatten().collect()
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
        .flat_map(|(table, lists)| lists.into_iter().map(move |rows| PointCorrespondence::new(table, rows)))
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
        .flat_map(|(table, lists)| lists.into_iter().map(move |rows| LineCorrespondence::new(table, rows)))
        .collect()
}
