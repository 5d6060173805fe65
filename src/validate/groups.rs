//! Structural groups: their lines, and the direction that the lines share.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use nalgebra::Vector3;

use super::finding::{Detail, Findings};
use super::group_parts::Parts;
use super::landmarks::{Landmarks, LineEntry};
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::structure::{GroupId, LineId, StructuralGroup, registry};

const TABLE: Option<&str> = Some("structural_groups");
/// Largest angle between a line and its group's direction, radians; registered text files have 1e-6.
const PARALLEL_ANGLE: f64 = 1e-3;
/// Largest deviation of a direction's length from one.
const UNIT_TOLERANCE: f64 = 1e-6;

/// The groups of each line, for counting constraints.
pub(crate) type GroupsOfLine = HashMap<i64, Vec<i64>>;

/// Checks the table `structural_groups`; `lines` is `None` when there is no table of line landmarks.
pub(crate) fn groups(
    shared: &Shared<'_>,
    lines: Option<&Landmarks<LineEntry>>,
    kinds: &mut BTreeSet<String>,
    findings: &mut Findings,
) -> (GroupsOfLine, Outcome) {
    let mut groups_of: GroupsOfLine = HashMap::new();
    let mut first_group: HashMap<(String, LineId), GroupId> = HashMap::new();
    let mut parts = Parts::default();
    let outcome = check::<StructuralGroup>(shared, findings, |batch, first_row, _, findings| {
        for (row, group) in (first_row..).zip(batch) {
            kinds.insert(group.kind.clone());
            members(group, row, &mut first_group, findings);
            if !group.is_made_of_groups() {
                for line in &group.line_ids {
                    groups_of.entry(line.0).or_default().push(group.group_id.0);
                }
            }
            let directions: BTreeMap<LineId, Vector3<f64>> = known_lines(group, row, lines, findings);
            direction(group, row, lines.is_some(), &directions, findings);
            parts.add(group, row);
        }
    });
    parts.check(findings);
    (groups_of, outcome)
}

fn members(
    group: &StructuralGroup,
    row: u64,
    first_group: &mut HashMap<(String, LineId), GroupId>,
    findings: &mut Findings,
) {
    let mut broken = |expected: &str, found: String| {
        findings.add(RuleId::GroupLinesUnique, TABLE, || {
            Detail::new(expected, found).row(row).id(group.group_id)
        });
    };
    if group.line_ids.is_empty() {
        broken("at least one line", "none".to_owned());
    }
    let mut neighbours = group.line_ids.iter().zip(group.line_ids.iter().skip(1));
    if let Some((line, next)) = neighbours.find(|(line, next)| line >= next) {
        broken("lines ascending without repetition", format!("{line} before {next}"));
    }
    let own: BTreeSet<LineId> = group.line_ids.iter().copied().collect();
    for line in own {
        if let Some(other) = first_group.get(&(group.kind.clone(), line)) {
            let expected = format!("{line} in one group of kind `{}`", group.kind);
            broken(&expected, format!("it is in {other} already"));
        } else {
            first_group.insert((group.kind.clone(), line), group.group_id);
        }
    }
}

/// Directions of the group's lines that have a landmark; says which have none.
fn known_lines(
    group: &StructuralGroup,
    row: u64,
    lines: Option<&Landmarks<LineEntry>>,
    findings: &mut Findings,
) -> BTreeMap<LineId, Vector3<f64>> {
    let mut directions = BTreeMap::new();
    let Some(lines) = lines else { return directions };
    for line in &group.line_ids {
        match lines.index.get(line.0) {
            Some(place) => {
                if let Some(direction) = lines.places[place].direction {
                    directions.insert(*line, direction);
                }
            }
            None => findings.add(RuleId::GroupLinesKnown, TABLE, || {
                let found = format!("not there, named by {}", group.group_id);
                Detail::new(format!("{line} in line_landmarks"), found).row(row).id(line)
            }),
        }
    }
    directions
}

fn direction(
    group: &StructuralGroup,
    row: u64,
    lines_known: bool,
    directions: &BTreeMap<LineId, Vector3<f64>>,
    findings: &mut Findings,
) {
    let mut broken = |expected: &str, found: String| {
        findings
            .add(RuleId::GroupDirection, TABLE, || Detail::new(expected, found).row(row).id(group.group_id));
    };
    let parts = [group.direction_x, group.direction_y, group.direction_z];
    let present = parts.iter().flatten().count();
    let Some(stored) = group.direction() else {
        if present > 0 {
            broken("all three parts of the direction, or none", format!("{present} of them"));
        } else if (group.kind == registry::PARALLEL || group.is_made_of_groups())
            && lines_known
            && !directions.is_empty()
        {
            let found = format!("none, though {} of its lines have a landmark", directions.len());
            broken("a direction", found);
        }
        return;
    };
    let length = stored.norm();
    if !length.is_finite() {
        return;
    }
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        broken("a direction of length 1 within 1e-6", format!("length {length:.9}"));
    }
    if group.kind != registry::PARALLEL || length < 0.5 {
        return;
    }
    for (line, direction) in directions {
        let angle = stored.cross(direction).norm().atan2(stored.dot(direction).abs());
        if angle > PARALLEL_ANGLE {
            findings.add(RuleId::GroupLinesParallel, TABLE, || {
                let expected = format!("within 1e-3 rad of the direction of {}", group.group_id);
                let found = format!("{angle:.6} rad ({:.3}°) from it", angle.to_degrees());
                Detail::new(expected, found).row(row).id(line)
            });
        }
    }
}
