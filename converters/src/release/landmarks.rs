//! Published landmarks, checked; of several with one id the first is kept.

use super::ledger::Ledger;
use crate::text_release::{PointFile, PointLine, SegmentFile, SegmentLine};
use nalgebra::Point3;
use open_structure::geometry::Segment;
use open_structure::structure::{LineId, PointId};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

const AGAIN: &str = "landmark comes again; the first is kept";
const BAD_ID: &str = "landmark id is negative";

/// Points by id.
pub(super) type Points = BTreeMap<PointId, Point3<f64>>;
/// Segments by id.
pub(super) type Segments = BTreeMap<LineId, Segment>;

/// The points of some rows.
pub(super) fn points(rows: &[PointLine], file: &str, ledger: &mut Ledger) -> Points {
    let mut points = Points::new();
    for row in rows {
        if row.id < 0 {
            ledger.exclude(file, BAD_ID, Some(row.row));
        } else if let Entry::Vacant(place) = points.entry(PointId(row.id)) {
            place.insert(Point3::from(row.position));
        } else {
            ledger.exclude(file, AGAIN, Some(row.row));
        }
    }
    points
}

/// The segments of some rows.
pub(super) fn segments(rows: &[SegmentLine], file: &str, ledger: &mut Ledger) -> Segments {
    let mut segments = Segments::new();
    for row in rows {
        if row.id < 0 {
            ledger.exclude(file, BAD_ID, Some(row.row));
        } else if let Entry::Vacant(place) = segments.entry(LineId(row.id)) {
            place.insert(Segment { start: Point3::from(row.start), end: Point3::from(row.end) });
        } else {
            ledger.exclude(file, AGAIN, Some(row.row));
        }
    }
    segments
}

/// The published points.
pub(super) fn point_landmarks(file: Option<&PointFile>, ledger: &mut Ledger) -> Points {
    file.map(|file| points(&file.points, &file.file, ledger)).unwrap_or_default()
}

/// The published lines of one file or several; those without length cannot be landmarks.
pub(super) fn line_landmarks(files: &[SegmentFile], ledger: &mut Ledger) -> Segments {
    let mut landmarks = Segments::new();
    for file in files {
        for (id, segment) in segments(&file.segments, &file.file, ledger) {
            let line = file.segments.iter().find(|row| row.id == id.0).map(|row| row.row);
            if segment.plucker().is_err() {
                ledger.exclude(&file.file, "line landmark has no length", line);
                continue;
            }
            match landmarks.get(&id) {
                None => {
                    landmarks.insert(id, segment);
                }
                Some(first) if *first == segment => {}
                Some(_) => ledger.exclude(&file.file, "another file gives this line otherwise", line),
            }
        }
    }
    landmarks
}
