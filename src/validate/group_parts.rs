//! Groups that are made of parallel groups: which, and at which angles.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use nalgebra::Vector3;

use super::finding::{Detail, Findings};
use super::rules::RuleId;
use crate::structure::{GroupId, LineId, StructuralGroup, registry};

const TABLE: Option<&str> = Some("structural_groups");
/// Largest deviation of two directions from being parallel or perpendicular, radians.
const ANGLE: f64 = 1e-3;

/// A group of kind `parallel`.
struct Parallel {
    direction: Option<Vector3<f64>>,
    lines: usize,
}

/// Parallel groups, and the groups that are made of them, in the order of their rows.
#[derive(Default)]
pub(super) struct Parts {
    parallel: BTreeMap<GroupId, Parallel>,
    group_of: HashMap<LineId, GroupId>,
    whole: Vec<(u64, StructuralGroup)>,
}

impl Parts {
    /// Takes a group.
    pub(super) fn add(&mut self, group: &StructuralGroup, row: u64) {
        if group.is_made_of_groups() {
            self.whole.push((row, group.clone()));
        } else if group.kind == registry::PARALLEL {
            let mut lines = 0;
            for line in &group.line_ids {
                if *self.group_of.entry(*line).or_insert(group.group_id) == group.group_id {
                    lines += 1;
                }
            }
            let direction = group.direction().and_then(|direction| direction.try_normalize(0.5));
            self.parallel.insert(group.group_id, Parallel { direction, lines });
        }
    }

    /// Checks what is made of groups.
    pub(super) fn check(&self, findings: &mut Findings) {
        for (row, group) in &self.whole {
            let mut broken = |rule, expected: String, found: String| {
                findings.add(rule, TABLE, || Detail::new(expected, found).row(*row).id(group.group_id));
            };
            let mut parts: BTreeMap<GroupId, usize> = BTreeMap::new();
            let mut loose = None;
            for line in group.line_ids.iter().collect::<BTreeSet<_>>() {
                match self.group_of.get(line) {
                    Some(part) => *parts.entry(*part).or_default() += 1,
                    None => loose = loose.or(Some(*line)),
                }
            }
            if let Some(line) = loose {
                let found = format!("{line}, which is in none");
                broken(RuleId::GroupOfGroups, "lines of parallel groups".to_owned(), found);
            }
            for (part, here) in &parts {
                let all = self.parallel[part].lines;
                if *here < all {
                    let found = format!("{here} of {all} lines of {part}");
                    broken(
                        RuleId::GroupOfGroups,
                        "every line of a parallel group, or none".to_owned(),
                        found,
                    );
                }
            }
            let (enough, expected) = if group.kind == registry::MANHATTAN {
                (parts.len() == 3, "three parallel groups")
            } else {
                (parts.len() >= 3, "three or more parallel groups")
            };
            if !enough {
                broken(RuleId::GroupOfGroups, expected.to_owned(), format!("{}", parts.len()));
            }
            for (expected, found) in self.angles(group, &parts) {
                broken(RuleId::GroupDirectionsOrthogonal, expected, found);
            }
        }
    }

    /// What is wrong with the directions of a group's parts, as expected and found.
    fn angles(&self, group: &StructuralGroup, parts: &BTreeMap<GroupId, usize>) -> Vec<(String, String)> {
        let mut wrong = Vec::new();
        let Some(own) = group.direction().and_then(|direction| direction.try_normalize(0.5)) else {
            return wrong;
        };
        let known: Vec<(GroupId, Vector3<f64>)> =
            parts.keys().filter_map(|part| Some((*part, self.parallel[part].direction?))).collect();
        if known.len() < parts.len() || known.is_empty() {
            return wrong;
        }
        // Angles between endless lines, from 0 to a right angle.
        let angle = |a: &Vector3<f64>, b: &Vector3<f64>| a.cross(b).norm().atan2(a.dot(b).abs());
        let told = |angle: f64| format!("{angle:.6} rad ({:.3}°)", angle.to_degrees());
        let right = std::f64::consts::FRAC_PI_2;
        let nearest = known.iter().min_by(|a, b| angle(&own, &a.1).total_cmp(&angle(&own, &b.1)));
        let Some((upright, _)) = nearest.filter(|(_, direction)| angle(&own, direction) <= ANGLE) else {
            let least = known.iter().map(|(_, direction)| angle(&own, direction)).fold(right, f64::min);
            let expected = "the direction of one of its parallel groups within 1e-3 rad".to_owned();
            wrong.push((expected, format!("{} from the nearest", told(least))));
            return wrong;
        };
        for (index, (part, direction)) in known.iter().enumerate() {
            for (other, other_direction) in &known[index + 1..] {
                let tied = group.kind == registry::MANHATTAN || [part, other].contains(&upright);
                let found = angle(direction, other_direction);
                if tied && right - found > ANGLE {
                    let expected = format!("{part} perpendicular to {other} within 1e-3 rad");
                    wrong.push((expected, told(found)));
                }
            }
        }
        wrong
    }
}
