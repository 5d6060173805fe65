//! The table `frame_statistics`, held against what the frames show.

use super::finding::{Detail, Findings};
use super::frame_rows::FrameCount;
use super::ids::Unknown;
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use super::world::World;
use crate::structure::{FrameStatistics, ImageCells, Record};

/// Checks the table; `points` and `lines` are `None` where their tables could not be counted.
pub(crate) fn frame_statistics(
    shared: &Shared<'_>,
    world: &World<'_>,
    points: Option<&[FrameCount]>,
    lines: Option<&[FrameCount]>,
    findings: &mut Findings,
) -> Outcome {
    let (table, frames) = (FrameStatistics::TABLE.name, world.frames);
    let mut images: Vec<Option<ImageCells>> = world.views.iter().map(|_| None).collect();
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
                let mut wrong = |column: &str, found: String, expected: String| {
                    findings.add(RuleId::FrameStatisticsAgree, Some(table), || {
                        let found = format!("{column} {found}");
                        Detail::new(format!("{column} {expected}"), found).row(row).id(statistics.frame_id)
                    });
                };
                hold(statistics, &points[place], &lines[place], &mut wrong);
                hold_covered(
                    statistics,
                    &points[place],
                    &lines[place],
                    (world, place, &mut images),
                    &mut wrong,
                );
                hold_step(statistics, &points[place], &lines[place], (world, place), &mut wrong);
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

/// Says that a column is wrong: its name, what was found, what was expected.
type Wrong<'a> = dyn FnMut(&str, String, String) + 'a;

/// How far angles and lengths may be off: double precision leaves 1e-8 to an angle taken from a cosine.
const TOLERANCE: f64 = 1e-6;

fn hold(statistics: &FrameStatistics, points: &FrameCount, lines: &FrameCount, wrong: &mut Wrong<'_>) {
    for (column, found, expected) in [
        ("point_count", statistics.point_count, count(points.rows)),
        ("line_count", statistics.line_count, count(lines.rows)),
        ("occupied_cells", statistics.occupied_cells, count(union(&points.cells, &lines.cells))),
        ("structural_constraints", statistics.structural_constraints, lines.constraints),
    ] {
        if found != expected {
            wrong(column, found.to_string(), expected.to_string());
        }
    }
}

/// Holds the covered cells, where they are given, against the pixels of the frame.
fn hold_covered(
    statistics: &FrameStatistics,
    points: &FrameCount,
    lines: &FrameCount,
    (world, place, images): (&World<'_>, usize, &mut [Option<ImageCells>]),
    wrong: &mut Wrong<'_>,
) {
    let Some(found) = statistics.covered_cells else { return };
    let Some(camera) = world.frames.entry(place).camera else { return };
    let Some(view) = &world.views[camera] else { return };
    if images[camera].is_none() {
        images[camera] = ImageCells::new(view.pinhole.width, view.pinhole.height);
    }
    let Some(image) = &mut images[camera] else {
        return wrong("covered_cells", found.to_string(), "absent for so large an image".to_owned());
    };
    image.clear();
    for [column, row] in points.cells.iter().map(|cell| [cell >> 16, cell & 0xffff]) {
        image.cover(i64::from(column), i64::from(row));
    }
    for [start, end] in &lines.segments {
        image.cover_segment(*start, *end);
    }
    let expected = count(image.covered() as u64);
    if found != expected {
        wrong("covered_cells", found.to_string(), expected.to_string());
    }
}

/// Holds what is said of a frame and the one before it, where it is given.
fn hold_step(
    statistics: &FrameStatistics,
    points: &FrameCount,
    lines: &FrameCount,
    (world, place): (&World<'_>, usize),
    wrong: &mut Wrong<'_>,
) {
    let frames = world.frames;
    if !frames.ordered {
        return;
    }
    let before = place.checked_sub(1);
    for (column, found, expected) in [
        ("points_shared_with_previous", statistics.points_shared_with_previous, points.shared),
        ("lines_shared_with_previous", statistics.lines_shared_with_previous, lines.shared),
    ] {
        let expected = before.map(|_| count(expected));
        if found.is_some() && found != expected {
            wrong(column, text(found), text(expected));
        }
    }
    // What a pose or a camera that cannot be used would give is another rule's finding.
    let usable = |place: usize| {
        let entry = frames.entry(place);
        let camera = entry.camera.is_some_and(|camera| world.views[camera].is_some());
        (entry.pose.is_some() || entry.without_pose, camera)
    };
    let (posed, sighted) = match before.map(usable).zip(Some(usable(place))) {
        Some((before, here)) => (before.0 && here.0, before.1 && here.1),
        None => (true, true),
    };
    if !posed {
        return;
    }
    let poses = before.and_then(|before| frames.entry(before).pose.zip(frames.entry(place).pose));
    let rotation = poses.map(|(before, here)| {
        let turn = before.rotation * here.rotation.transpose();
        let axis = [turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12];
        let sine = axis.iter().map(|part| part * part).sum::<f64>().sqrt();
        libm::atan2(sine, turn.trace() - 1.0)
    });
    let centres =
        poses.map(|(before, here)| [before, here].map(|pose| pose.rotation.tr_mul(&pose.translation)));
    let translation = centres.map(|[before, here]| (here - before).norm());
    // Far from the origin a difference of places has their rounding.
    let rounding = centres.map_or(0.0, |[before, here]| 1e-12 * (before.norm() + here.norm()));
    let mut hold = |column: &str, found: Option<f64>, expected: Option<f64>, tolerance: f64| {
        // What is not finite is another rule's finding.
        let Some(found) = found.filter(|found| found.is_finite()) else { return };
        if expected.is_none_or(|expected| (found - expected).abs() > tolerance) {
            wrong(column, found.to_string(), text(expected));
        }
    };
    hold("rotation_since_previous", statistics.rotation_since_previous, rotation, TOLERANCE);
    let moved = statistics.translation_since_previous;
    hold("translation_since_previous", moved, translation, TOLERANCE + rounding);
    if sighted {
        let parallax = statistics.median_parallax_to_previous;
        hold("median_parallax_to_previous", parallax, points.parallax, TOLERANCE);
    }
}

fn count(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

fn text(number: Option<impl ToString>) -> String {
    number.map_or_else(|| "absent".to_owned(), |number| number.to_string())
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
