//! Correspondences: the rows of each landmark, held against the tables they point into.

use std::collections::BTreeMap;

use super::finding::{Detail, Findings};
use super::frames::FrameIndex;
use super::ids::Unknown;
use super::mix::{Mix, shown};
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::structure::{
    LineCorrespondence, LineMeasurement, LineObservation, PointCorrespondence, PointMeasurement,
    PointObservation, Record,
};

/// Most rows of a table that are held in memory to say which entry is wrong.
const MOST_ROWS: u64 = 1 << 26;

/// A row that lists the rows of a landmark.
pub(crate) trait Correspondence: Record {
    /// The tables that may be named.
    const TABLES: [&'static str; 2];
    /// Word for the landmark.
    const WORD: &'static str;
    fn table(&self) -> &str;
    fn landmark(&self) -> i64;
    fn frames(&self) -> impl ExactSizeIterator<Item = i64>;
    fn rows(&self) -> &[i64];
    /// Frame and landmark of every row of a table, in table order.
    fn shown(shared: &Shared<'_>, table: &str) -> Vec<(i64, i64)>;
}

macro_rules! correspondence {
    ($name:ident, $id:ident, $word:literal, $measurements:ident, $observations:ident) => {
        impl Correspondence for $name {
            const TABLES: [&'static str; 2] = [$measurements::TABLE.name, $observations::TABLE.name];
            const WORD: &'static str = $word;
            fn table(&self) -> &str {
                &self.table
            }
            fn landmark(&self) -> i64 {
                self.$id.0
            }
            fn frames(&self) -> impl ExactSizeIterator<Item = i64> {
                self.frame_ids.iter().map(|frame| frame.0)
            }
            fn rows(&self) -> &[i64] {
                &self.rows
            }
            fn shown(shared: &Shared<'_>, table: &str) -> Vec<(i64, i64)> {
                let mut rows = Vec::new();
                let read = if table == Self::TABLES[0] {
                    shared.source.each_batch::<$measurements>(|batch, _| {
                        rows.extend(batch.iter().map(|row| (row.frame_id.0, row.$id.0)));
                    })
                } else {
                    shared.source.each_batch::<$observations>(|batch, _| {
                        rows.extend(batch.iter().map(|row| (row.frame_id.0, row.$id.0)));
                    })
                };
                // A table that cannot be read was reported by its own check.
                drop(read);
                rows
            }
        }
    };
}
correspondence!(PointCorrespondence, point_id, "point", PointMeasurement, PointObservation);
correspondence!(LineCorrespondence, line_id, "line", LineMeasurement, LineObservation);

/// What the entries of each named table say, as a hash of all of them.
pub(crate) type Claims = BTreeMap<&'static str, (Mix, u64)>;

/// Checks the shape of a table of correspondences, and gathers what it claims.
pub(crate) fn correspondences<R: Correspondence>(
    shared: &Shared<'_>,
    frames: &FrameIndex,
    findings: &mut Findings,
) -> (Claims, Outcome) {
    let table = R::TABLE.name;
    let mut claims = Claims::new();
    let mut unknown = Unknown::default();
    let mut hint = 0;
    let outcome = check::<R>(shared, findings, |batch, first_row, _, findings| {
        for (row, entry) in (first_row..).zip(batch) {
            let id = || format!("{} {}", R::WORD, entry.landmark());
            let Some(named) = R::TABLES.into_iter().find(|named| *named == entry.table()) else {
                findings.add(RuleId::CorrespondencesAgree, Some(table), || {
                    let expected = format!("table `{}` or `{}`", R::TABLES[0], R::TABLES[1]);
                    Detail::new(expected, format!("`{}`", entry.table())).row(row).id(id())
                });
                continue;
            };
            let (frame_count, row_count) = (entry.frames().len(), entry.rows().len());
            if frame_count != row_count {
                findings.add(RuleId::CorrespondencesAgree, Some(table), || {
                    let expected = format!("{frame_count} rows, one for each frame");
                    Detail::new(expected, row_count.to_string()).row(row).id(id())
                });
            }
            let (sum, count) = claims.entry(named).or_default();
            for (frame, shown_row) in entry.frames().zip(entry.rows()) {
                if frames.find(frame, &mut hint).is_none() {
                    unknown.add(frame, row);
                }
                sum.add(shown(*shown_row, entry.landmark(), frame));
                *count += 1;
            }
        }
    });
    unknown.report(RuleId::FrameKnown, table, "frame", "frames", findings);
    (claims, outcome)
}

/// Holds the claims about one table against what it shows; reads both again only when they differ.
pub(crate) fn hold<R: Correspondence>(
    shared: &Shared<'_>,
    named: &'static str,
    claimed: (Mix, u64),
    there: (Mix, u64),
    findings: &mut Findings,
) {
    if claimed == there {
        return;
    }
    let table = R::TABLE.name;
    if there.1 > MOST_ROWS {
        findings.add(RuleId::CorrespondencesAgree, Some(table), || {
            Detail::new(
                format!("the {} rows of {named}", there.1),
                format!("{} entries that differ", claimed.1),
            )
        });
        return;
    }
    let rows = R::shown(shared, named);
    let mut listed = vec![false; rows.len()];
    let mut number = 0_u64;
    // Read before, with whatever was wrong reported then.
    let _ = shared.source.each_batch::<R>(|batch, _| {
        for entry in batch {
            if entry.table() == named {
                for (frame, shown_row) in entry.frames().zip(entry.rows()) {
                    entry_holds(entry, (frame, *shown_row), named, number, &rows, &mut listed, findings);
                }
            }
            number += 1;
        }
    });
    for (row, _) in listed.iter().enumerate().filter(|(_, listed)| !**listed) {
        let (frame, landmark) = rows[row];
        findings.add(RuleId::CorrespondencesAgree, Some(table), || {
            let expected = format!("an entry for row {row} of {named} (frame {frame})");
            Detail::new(expected, "none").id(format!("{} {landmark}", R::WORD))
        });
    }
}

fn entry_holds<R: Correspondence>(
    entry: &R,
    (frame, shown_row): (i64, i64),
    named: &str,
    number: u64,
    rows: &[(i64, i64)],
    listed: &mut [bool],
    findings: &mut Findings,
) {
    let landmark = entry.landmark();
    let place = usize::try_from(shown_row).ok().filter(|place| *place < rows.len());
    let found = match place {
        None => format!("row {shown_row}, of {} rows", rows.len()),
        Some(place) if rows[place] != (frame, landmark) => {
            let (frame, landmark) = rows[place];
            format!("row {shown_row}, which shows {} {landmark} in frame {frame}", R::WORD)
        }
        Some(place) if std::mem::replace(&mut listed[place], true) => {
            format!("row {shown_row} for the second time")
        }
        Some(_) => return,
    };
    findings.add(RuleId::CorrespondencesAgree, Some(R::TABLE.name), || {
        let expected = format!("a row of {named} that shows {} {landmark} in frame {frame}", R::WORD);
        Detail::new(expected, found).row(number).id(format!("{} {landmark}", R::WORD))
    });
}
