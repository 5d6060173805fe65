//! Rows gathered while a file is read, then sorted out: blocks that repeat, ids and observations that come twice.

use super::model::{
    Block, GroupLine, LineObservationLine, PointLine, PointObservationLine, PoseLine, Row, Rows, SegmentLine,
};
use super::parse::Tag;
use super::problem::{FileProblems, ProblemKind};
use std::collections::{HashMap, HashSet};

/// Rows of one tag, and where a run of them was taken up again after other rows.
#[derive(Debug)]
struct Runs<T> {
    rows: Vec<T>,
    starts: Vec<usize>,
}

impl<T> Default for Runs<T> {
    fn default() -> Self {
        Self { rows: Vec::new(), starts: Vec::new() }
    }
}

/// Takes rows in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Collector {
    last: Option<Tag>,
    vertices: Runs<PoseLine>,
    points: Runs<PointLine>,
    lines: Runs<SegmentLine>,
    point_observations: Vec<PointObservationLine>,
    line_observations: Vec<LineObservationLine>,
    groups: Vec<GroupLine>,
}

impl Collector {
    pub(super) fn vertex(&mut self, row: PoseLine) {
        let again = self.last.replace(Tag::Vertex) != Some(Tag::Vertex);
        self.vertices.push(row, again);
    }

    pub(super) fn point(&mut self, row: PointLine) {
        let again = self.last.replace(Tag::Point) != Some(Tag::Point);
        self.points.push(row, again);
    }

    pub(super) fn line(&mut self, row: SegmentLine) {
        let again = self.last.replace(Tag::Line) != Some(Tag::Line);
        self.lines.push(row, again);
    }

    pub(super) fn point_observation(&mut self, row: PointObservationLine) {
        self.last = Some(Tag::PointObservation);
        self.point_observations.push(row);
    }

    pub(super) fn line_observation(&mut self, row: LineObservationLine) {
        self.last = Some(Tag::LineObservation);
        self.line_observations.push(row);
    }

    pub(super) fn group(&mut self, row: GroupLine) {
        self.last = Some(Tag::Group);
        self.groups.push(row);
    }

    pub(super) fn finish(self, problems: &mut FileProblems) -> Rows {
        check_observations(
            &self.point_observations,
            |row| (row.point, row.frame, row.row),
            "point",
            problems,
        );
        check_observations(&self.line_observations, |row| (row.line, row.frame, row.row), "line", problems);
        check_groups(&self.groups, problems);
        Rows {
            vertices: self.vertices.into_blocks(Tag::Vertex, problems),
            points: self.points.into_blocks(Tag::Point, problems),
            lines: self.lines.into_blocks(Tag::Line, problems),
            point_observations: self.point_observations,
            line_observations: self.line_observations,
            groups: self.groups,
        }
    }
}

impl<T: Row> Runs<T> {
    fn push(&mut self, row: T, taken_up_again: bool) {
        if taken_up_again {
            self.starts.push(self.rows.len());
        }
        self.rows.push(row);
    }

    /// Joins runs while they share no id; a run that comes back with an id of the block begins the next one.
    fn into_blocks(self, tag: Tag, problems: &mut FileProblems) -> Vec<Block<T>> {
        let mut blocks: Vec<Block<T>> = Vec::new();
        let mut ids = HashSet::new();
        let mut rows = self.rows.into_iter();
        for (run, &start) in self.starts.iter().enumerate() {
            let stop = self.starts.get(run + 1).map_or(usize::MAX, |&next| next) - start;
            let taken: Vec<T> = rows.by_ref().take(stop).collect();
            let repeats = taken.iter().any(|row| ids.contains(&row.id()));
            if repeats {
                let kind = ProblemKind::RepeatedBlock { tag: tag.name(), rows: taken.len() };
                problems.note(taken.first().map(Row::row), kind, String::new);
                // Not `clear`, whose time goes with the capacity: many small blocks may follow a large one.
                ids = HashSet::new();
            }
            for row in &taken {
                if !ids.insert(row.id()) {
                    let detail = || format!("{} {}", tag.name(), row.id());
                    problems.note(Some(row.row()), ProblemKind::DuplicateId, detail);
                }
            }
            match blocks.last_mut() {
                Some(block) if !repeats => block.rows.extend(taken),
                _ => {
                    let number = u32::try_from(blocks.len()).unwrap_or(u32::MAX);
                    blocks.push(Block { number, rows: taken });
                }
            }
        }
        blocks
    }
}

/// Finds landmarks observed twice in a frame. Files sorted by landmark and frame, as they come, take one glance.
fn check_observations<T>(
    rows: &[T],
    key: impl Fn(&T) -> (i64, i64, u32),
    landmark: &str,
    problems: &mut FileProblems,
) {
    let pair = |row: &T| {
        let (id, frame, _) = key(row);
        (id, frame)
    };
    if rows.is_sorted_by(|a, b| pair(a) < pair(b)) {
        return;
    }
    let mut keys: Vec<_> = rows.iter().map(key).collect();
    keys.sort_unstable();
    let mut repeated: Vec<_> = keys
        .windows(2)
        .filter(|two| (two[0].0, two[0].1) == (two[1].0, two[1].1))
        .map(|two| (two[1].2, two[1].0, two[1].1))
        .collect();
    repeated.sort_unstable();
    for (row, id, frame) in repeated {
        let detail = || format!("{landmark} {id} in frame {frame}");
        problems.note(Some(row), ProblemKind::DuplicateObservation, detail);
    }
}

fn check_groups(groups: &[GroupLine], problems: &mut FileProblems) {
    let mut ids = HashSet::new();
    let mut group_of: HashMap<i64, usize> = HashMap::new();
    for (place, group) in groups.iter().enumerate() {
        if !ids.insert(group.group) {
            let detail = || format!("{} {}", Tag::Group.name(), group.group);
            problems.note(Some(group.row), ProblemKind::DuplicateId, detail);
        }
        for line in &group.lines {
            match group_of.insert(*line, place) {
                Some(before) if before == place => {
                    let detail = || format!("line {line} in group {}", group.group);
                    problems.note(Some(group.row), ProblemKind::RepeatedMember, detail);
                }
                Some(before) => {
                    let other = groups[before].group;
                    let detail = || format!("line {line} in groups {other} and {}", group.group);
                    problems.note(Some(group.row), ProblemKind::LineInSeveralGroups, detail);
                }
                None => {}
            }
        }
    }
}
