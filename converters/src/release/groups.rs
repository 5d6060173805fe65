//! Groups of parallel lines.

use super::ledger::Ledger;
use crate::text_release::{Association, GroupLine};
use nalgebra::Vector3;
use open_structure::structure::{GroupId, LineId, LineLandmark, StructuralGroup, registry};
use std::collections::{BTreeMap, BTreeSet};

/// Lines by group, as a file lists them; a line belongs to the first group that lists it.
fn members(rows: &[GroupLine], file: &str, ledger: &mut Ledger) -> BTreeMap<GroupId, BTreeSet<LineId>> {
    let mut groups: BTreeMap<GroupId, BTreeSet<LineId>> = BTreeMap::new();
    let mut group_of: BTreeMap<LineId, GroupId> = BTreeMap::new();
    for row in rows {
        if row.group < 0 {
            ledger.exclude(file, "group id is negative", Some(row.row));
            continue;
        }
        if row.lines.is_empty() {
            ledger.exclude(file, "group lists no line", Some(row.row));
            continue;
        }
        let group = GroupId(row.group);
        for line in &row.lines {
            if *line < 0 {
                ledger.exclude(file, "group lists a line with a negative id", Some(row.row));
                continue;
            }
            match *group_of.entry(LineId(*line)).or_insert(group) {
                first if first != group => {
                    ledger.exclude(file, "line is in another group already", Some(row.row));
                }
                // A line that is listed twice is still one member.
                _ => {
                    groups.entry(group).or_default().insert(LineId(*line));
                }
            }
        }
    }
    groups
}

/// The groups of a sequence: the association's, or the graph's where it lists none.
pub(super) fn groups(
    association: Option<&Association>,
    graph: Option<&Association>,
    landmarks: &[LineLandmark],
    ledger: &mut Ledger,
) -> Vec<StructuralGroup> {
    let of = |file: Option<&Association>, ledger: &mut Ledger| {
        file.map(|file| members(&file.rows.groups, &file.file, ledger)).unwrap_or_default()
    };
    let mut found = of(association, ledger);
    let from_graph = of(graph, ledger);
    if found.is_empty() {
        found = from_graph;
    } else if let Some(graph) = graph
        && !from_graph.is_empty()
        && from_graph != found
    {
        let first = graph.rows.groups.first().map(|row| row.row);
        let reason = "groups differ from those of the association, which are kept";
        ledger.exclude_many(&graph.file, reason, from_graph.len() as u64, first);
    }
    let directions: BTreeMap<LineId, Vector3<f64>> =
        landmarks.iter().map(|line| (line.line_id, line.plucker().direction)).collect();
    found
        .into_iter()
        .map(|(group_id, lines)| {
            let direction = mean_direction(lines.iter().filter_map(|line| directions.get(line)));
            StructuralGroup {
                group_id,
                kind: registry::PARALLEL.to_owned(),
                direction_x: direction.map(|d| d.x),
                direction_y: direction.map(|d| d.y),
                direction_z: direction.map(|d| d.z),
                line_ids: lines.into_iter().collect(),
            }
        })
        .collect()
}

/// The mean of directions whose signs are arbitrary, with the sign of the first.
fn mean_direction<'a>(mut directions: impl Iterator<Item = &'a Vector3<f64>>) -> Option<Vector3<f64>> {
    let first = *directions.next()?;
    let sum = directions.fold(first, |sum, next| if sum.dot(next) < 0.0 { sum - next } else { sum + next });
    sum.try_normalize(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text_release::Rows;

    #[test]
    fn signs_are_aligned_to_the_first_line() {
        let directions =
            [Vector3::x(), -Vector3::x(), Vector3::new(-1.0, 0.1, 0.0), Vector3::new(1.0, 0.1, 0.0)];
        let mean = mean_direction(directions.iter()).unwrap();
        assert!((mean - Vector3::x()).norm() < 1e-15, "{mean}");
        assert_eq!(mean_direction(std::iter::empty()), None);
    }

    #[test]
    fn what_cannot_be_a_group_is_counted() {
        let row = |group, lines: &[i64], row| GroupLine { group, lines: lines.to_vec(), row };
        let groups_of = vec![row(3, &[5, 2, 5], 10), row(4, &[2, 7], 11), row(-1, &[1], 12), row(9, &[], 13)];
        let file = Association {
            file: "association.txt".into(),
            rows: Rows { groups: groups_of, ..Rows::default() },
        };
        let mut ledger = Ledger::default();
        let found = groups(Some(&file), None, &[], &mut ledger);
        let found: Vec<_> = found.iter().map(|g| (g.group_id.0, g.line_ids.clone())).collect();
        assert_eq!(found, [(3, vec![LineId(2), LineId(5)]), (4, vec![LineId(7)])]);
        let (excluded, _) = ledger.finish();
        let found: Vec<_> = excluded.iter().map(|e| (e.reason.as_str(), e.count, e.first_line)).collect();
        let expected = [
            ("group id is negative", 1, Some(12)),
            ("group lists no line", 1, Some(13)),
            ("line is in another group already", 1, Some(11)),
        ];
        assert_eq!(found, expected);
    }
}
