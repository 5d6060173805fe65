//! Rows of a file of observations, sorted and checked, whether they will turn out to be truth or measurement.

use super::ledger::Ledger;
use super::poses::is_frame;
use crate::text_release::Association;
use nalgebra::Point2;
use open_structure::structure::{
    FrameId, LineId, LineMeasurement, LineObservation, PointId, PointMeasurement, PointObservation,
};

/// The rows of one file.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// The file.
    pub(super) file: String,
    /// Points, by frame and landmark.
    pub(super) points: Vec<PointMeasurement>,
    /// Lines, by frame and landmark.
    pub(super) lines: Vec<LineMeasurement>,
}

const AGAIN: &str = "landmark comes again in the frame; the first row is kept";
const BAD_ID: &str = "frame or landmark id is negative or too large";

impl Rows {
    /// Takes the rows of a file; of several of one landmark in one frame the first.
    pub(super) fn of(association: &Association, ledger: &mut Ledger) -> Self {
        let file = association.file.clone();
        let mut points: Vec<(u32, PointMeasurement)> = Vec::new();
        for row in &association.rows.point_observations {
            if !is_frame(row.frame) || row.point < 0 {
                ledger.exclude(&file, BAD_ID, Some(row.row));
                continue;
            }
            let (frame_id, point_id) = (FrameId(row.frame), PointId(row.point));
            points.push((row.row, PointMeasurement { frame_id, point_id, u: row.u, v: row.v, depth: None }));
        }
        let mut lines: Vec<(u32, LineMeasurement)> = Vec::new();
        for row in &association.rows.line_observations {
            if !is_frame(row.frame) || row.line < 0 {
                ledger.exclude(&file, BAD_ID, Some(row.row));
                continue;
            }
            let mut depth = |value: f64| {
                if value > 0.0 {
                    return Some(value);
                }
                ledger.exclude(&file, "depth is not positive; the row is kept without it", Some(row.row));
                None
            };
            let [start_depth, end_depth] = [depth(row.start[2]), depth(row.end[2])];
            lines.push((
                row.row,
                LineMeasurement {
                    frame_id: FrameId(row.frame),
                    line_id: LineId(row.line),
                    start_u: row.start[0],
                    start_v: row.start[1],
                    start_depth,
                    end_u: row.end[0],
                    end_v: row.end[1],
                    end_depth,
                },
            ));
        }
        points.sort_by_key(|(line, row)| (row.frame_id, row.point_id, *line));
        lines.sort_by_key(|(line, row)| (row.frame_id, row.line_id, *line));
        let points = distinct(points, |row| (row.frame_id, row.point_id), &file, ledger);
        let lines = distinct(lines, |row| (row.frame_id, row.line_id), &file, ledger);
        Self { file, points, lines }
    }

    /// Every pixel position.
    pub(super) fn pixels(&self) -> impl Iterator<Item = Point2<f64>> {
        let points = self.points.iter().map(|row| Point2::new(row.u, row.v));
        let ends = self
            .lines
            .iter()
            .flat_map(|row| [Point2::new(row.start_u, row.start_v), Point2::new(row.end_u, row.end_v)]);
        points.chain(ends)
    }
}

/// The first of each key of sorted rows.
fn distinct<T, K: PartialEq>(
    rows: Vec<(u32, T)>,
    key: impl Fn(&T) -> K,
    file: &str,
    ledger: &mut Ledger,
) -> Vec<T> {
    let mut kept: Vec<T> = Vec::with_capacity(rows.len());
    for (line, row) in rows {
        if kept.last().is_some_and(|last| key(last) == key(&row)) {
            ledger.exclude(file, AGAIN, Some(line));
        } else {
            kept.push(row);
        }
    }
    kept
}

/// A row that turned out to be without noise.
pub(super) fn point_observation(row: &PointMeasurement) -> PointObservation {
    let PointMeasurement { frame_id, point_id, u, v, depth } = *row;
    PointObservation { frame_id, point_id, u, v, depth }
}

/// A row that turned out to be without noise.
pub(super) fn line_observation(row: &LineMeasurement) -> LineObservation {
    let LineMeasurement { frame_id, line_id, start_u, start_v, start_depth, end_u, end_v, end_depth } = *row;
    LineObservation { frame_id, line_id, start_u, start_v, start_depth, end_u, end_v, end_depth }
}
