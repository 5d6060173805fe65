//! The table `frame_statistics`, held against what the frames show.

use super::finding::{Detail, Findings};
use super::frame_rows::FrameCount;
use super::frames::FrameIndex;
use super::ids::Unknown;
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::structure::{FrameStatistics, Record};

/// Checks the table; `points` and `lines` are `None` where their tables could not be counted.
pub(crate) fn frame_statistics(
    shared: &Shared<'_>,
    frames: &FrameIndex,
    points: Option<&[FrameCount]>,
    lines: Option<&[FrameCount]>,
    findings: &mut Findings,
) -> Outcome {
    let table = FrameStatistics::TABLE.name;
    let mut unknown = Unknown::default();
    let mut described = vec![false; frames.len()];
    let mut hint = 0;
    let outcome = check::<FrameStatistics>(shared, findings, |batch, first_row, _, findings| {
        for (row, statistics) in (first_row..).zip(batch) {
            let Some(place) = frames.find(statistics.frame_id.0, &mut hint) else {
                unknown.add(statistics.frame_id.0, row);
                continue;
            };
            described[place] = true;
            if let (Some(points), Some(lines)) = (points, lines) {
                hold(statistics, &points[place], &lines[place], row, findings);
            }
        }
    });
    unknown.report(RuleId::FrameKnown, table, "frame", "frames", findings);
    if shared.source.has::<FrameStatistics>() && outcome.whole {
        for (place, _) in described.iter().enumerate().filter(|(_, described)| !**described) {
            findings.add(RuleId::FrameStatisticsAgree, Some(table), || {
                Detail::new("a row for each frame", "none").id(format!("frame {}", frames.ids()[place]))
            });
        }
    }
    outcome
}

fn hold(
    statistics: &FrameStatistics,
    points: &FrameCount,
    lines: &FrameCount,
    row: u64,
    findings: &mut Findings,
) {
    let count = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
    for (column, found, expected) in [
        ("point_count", statistics.point_count, count(points.rows)),
        ("line_count", statistics.line_count, count(lines.rows)),
        ("occupied_cells", statistics.occupied_cells, count(union(&points.cells, &lines.cells))),
        ("structural_constraints", statistics.structural_constraints, lines.constraints),
    ] {
        if found != expected {
            findings.add(RuleId::FrameStatisticsAgree, Some(FrameStatistics::TABLE.name), || {
                let found = format!("{column} {found}");
                Detail::new(format!("{column} {expected}"), found).row(row).id(statistics.frame_id)
            });
        }
    }
}

/// Number of different cells in two ascending lists.
fn union(left: &[u32], right: &[u32]) -> u64 {
    let (mut left, mut right) = (left.iter().peekable(), right.iter().peekable());
    let mut count = 0;
    loop {
        match (left.peek(), right.peek()) {
            (None, None) => return count,
            (Some(a), Some(b)) => {
                let (a, b) = (**a, **b);
                if a <= b {
                    left.next();
                }
                if b <= a {
                    right.next();
                }
            }
            (Some(_), None) => drop(left.next()),
            (None, Some(_)) => drop(right.next()),
        }
        count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::union;

    #[test]
    fn cells_of_points_and_lines_count_once() {
        assert_eq!(union(&[], &[]), 0);
        assert_eq!(union(&[1, 2, 3], &[]), 3);
        assert_eq!(union(&[1, 2, 9], &[0, 2, 9, 10]), 5);
    }
}
