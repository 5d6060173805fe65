//! Every table of a sequence: first what the others refer to, then the others side by side.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::correspondences::{Claims, Correspondence, correspondences, hold};
use super::estimates::{iterations, map_lines, map_points, tracking, trajectories};
use super::finding::{Detail, Findings};
use super::fit::Evaluation;
use super::frame_rows::FrameCount;
use super::frame_statistics::frame_statistics;
use super::frames::{FrameIndex, frames};
use super::graphs::graphs;
use super::groups::{GroupsOfLine, groups};
use super::landmarks::{self, Landmarks, LineEntry};
use super::line_rows::lines;
use super::manifest::{Known, open};
use super::noise::Declared;
use super::point_rows::{Seen, points};
use super::rules::RuleId;
use super::tables::{Outcome, Shared};
use super::truth::{Kind, judge};
use super::world::World;
use crate::structure::{
    FrameStatistics, LineCorrespondence, LineLandmark, LineMeasurement, LineObservation, PointCorrespondence,
    PointLandmark, PointMeasurement, PointObservation, Record, StructuralGroup,
};

/// What was found in all tables.
pub(crate) struct Tables {
    pub(crate) findings: Findings,
    pub(crate) outcomes: BTreeMap<&'static str, Outcome>,
    /// Stamps of the first and the last frame.
    pub(crate) stamps: Option<(i64, i64)>,
}

/// Names of open families that tables hold.
#[derive(Clone, Default)]
struct Names {
    estimates: BTreeSet<String>,
    group_kinds: BTreeSet<String>,
    factor_kinds: BTreeSet<String>,
    tracking_states: BTreeSet<String>,
}

/// What was learnt of the landmarks.
struct Truth {
    points: Landmarks<Point3<f64>>,
    lines: Landmarks<LineEntry>,
    groups: GroupsOfLine,
}

/// Checks every table.
pub(crate) fn run(shared: &Shared<'_>, known: &Known, mut findings: Findings) -> Tables {
    let mut outcomes: BTreeMap<&'static str, Outcome> = BTreeMap::new();
    let mut names = Names::default();
    let (index, outcome) = frames(shared, known.cameras.as_deref(), &mut findings);
    let frames_known = outcome.whole;
    outcomes.insert("frames", outcome);

    let truth = landmark_tables(shared, &mut names, &mut outcomes, &mut findings);
    let whole = |table: &str, outcomes: &BTreeMap<&'static str, Outcome>| {
        outcomes.get(table).is_some_and(|outcome| outcome.whole)
    };
    let world = World {
        frames: &index,
        views: &known.views,
        points: whole(PointLandmark::TABLE.name, &outcomes).then_some(&truth.points),
        lines: whole(LineLandmark::TABLE.name, &outcomes).then_some(&truth.lines),
        groups: &truth.groups,
        noise: Declared::new(known.noise.as_ref()),
    };

    let read = side_by_side(shared, &world, &names, &mut findings);
    outcomes.extend(judge_together(shared, &world, read, &mut names, &mut findings));

    let measured = [PointMeasurement::TABLE.name, LineMeasurement::TABLE.name]
        .iter()
        .map(|table| outcomes.get(table).map_or(0, |outcome| outcome.rows))
        .sum::<u64>();
    if measured > 0 && known.silent_on_noise {
        findings.add(RuleId::NoiseDeclared, None, || {
            let expected = "the noise of the measurements in the manifest";
            Detail::new(expected, format!("none, for {measured} measurements"))
        });
    }
    open("estimate", &names.estimates, &mut findings);
    open("group kind", &names.group_kinds, &mut findings);
    open("factor kind", &names.factor_kinds, &mut findings);
    open("tracking state", &names.tracking_states, &mut findings);
    forget(shared, frames_known, &outcomes, &mut findings);
    Tables { findings, outcomes, stamps: index.first_and_last_stamp.filter(|_| frames_known) }
}

/// What was read of the tables that do not wait for each other.
struct Read {
    measured_points: Seen<3>,
    observed_points: Seen<3>,
    measured_lines: Seen<4>,
    observed_lines: Seen<4>,
    point_claims: Claimed,
    line_claims: Claimed,
    names: Names,
    others: Vec<(&'static str, Outcome)>,
}

/// Reads all tables but those that others refer to, on as many threads as there are.
fn side_by_side(shared: &Shared<'_>, world: &World<'_>, names: &Names, findings: &mut Findings) -> Read {
    let counted = shared.source.has::<FrameStatistics>();
    let hashed_points = shared.source.has::<PointCorrespondence>();
    let hashed_lines = shared.source.has::<LineCorrespondence>();
    let blank = findings.fresh();
    let measured_points =
        || apart(&blank, |found| points::<PointMeasurement>(shared, world, hashed_points, counted, found));
    let observed_points =
        || apart(&blank, |found| points::<PointObservation>(shared, world, hashed_points, counted, found));
    let measured_lines =
        || apart(&blank, |found| lines::<LineMeasurement>(shared, world, hashed_lines, counted, found));
    let observed_lines =
        || apart(&blank, |found| lines::<LineObservation>(shared, world, hashed_lines, counted, found));
    let claims = || apart(&blank, |found| claims(shared, world.frames, found));
    let others = || apart(&blank, |found| other_tables(shared, world.frames, names, found));
    let ((measured_points, measured_lines), ((observed_points, observed_lines), (claims, others))) =
        rayon::join(
            || rayon::join(measured_points, measured_lines),
            || rayon::join(|| rayon::join(observed_points, observed_lines), || rayon::join(claims, others)),
        );
    // In one order, whichever was ready first.
    for found in
        [measured_points.1, measured_lines.1, observed_points.1, observed_lines.1, claims.1, others.1]
    {
        findings.merge(found);
    }
    let ((point_claims, line_claims), (names, others)) = (claims.0, others.0);
    Read {
        measured_points: measured_points.0,
        observed_points: observed_points.0,
        measured_lines: measured_lines.0,
        observed_lines: observed_lines.0,
        point_claims,
        line_claims,
        names,
        others,
    }
}

/// Judges what only several tables together show; gives the outcomes of the tables read.
fn judge_together(
    shared: &Shared<'_>,
    world: &World<'_>,
    read: Read,
    names: &mut Names,
    findings: &mut Findings,
) -> Vec<(&'static str, Outcome)> {
    let Read { mut measured_points, mut observed_points, mut measured_lines, mut observed_lines, .. } = read;
    let seen = [&measured_points, &observed_points];
    hold_claims::<PointCorrespondence, 3>(shared, &read.point_claims, seen, findings);
    let seen = [&measured_lines, &observed_lines];
    hold_claims::<LineCorrespondence, 4>(shared, &read.line_claims, seen, findings);
    if let Some(known) = world.points {
        let ids = known.index.ids();
        judge(&POINTS, ids, &mut observed_points, &mut measured_points, &world.noise, findings);
    }
    if let Some(known) = world.lines {
        let ids = known.index.ids();
        judge(&LINES, ids, &mut observed_lines, &mut measured_lines, &world.noise, findings);
    }
    let point_counts = counts(&measured_points, &observed_points);
    let line_counts = counts(&measured_lines, &observed_lines);
    let statistics = frame_statistics(shared, world, point_counts, line_counts, findings);
    *names = read.names;
    let mut outcomes = read.others;
    outcomes.extend([
        (FrameStatistics::TABLE.name, statistics),
        (PointCorrespondence::TABLE.name, read.point_claims.1),
        (LineCorrespondence::TABLE.name, read.line_claims.1),
        (PointMeasurement::TABLE.name, measured_points.outcome),
        (PointObservation::TABLE.name, observed_points.outcome),
        (LineMeasurement::TABLE.name, measured_lines.outcome),
        (LineObservation::TABLE.name, observed_lines.outcome),
    ]);
    outcomes
}

/// Does work with findings of its own.
fn apart<T>(blank: &Findings, work: impl FnOnce(&mut Findings) -> T) -> (T, Findings) {
    let mut found = blank.fresh();
    let result = work(&mut found);
    (result, found)
}

fn landmark_tables(
    shared: &Shared<'_>,
    names: &mut Names,
    outcomes: &mut BTreeMap<&'static str, Outcome>,
    findings: &mut Findings,
) -> Truth {
    let blank = findings.fresh();
    let (((points, point_outcome), found), ((lines, line_outcome), line_found)) = rayon::join(
        || apart(&blank, |found| landmarks::points(shared, found)),
        || apart(&blank, |found| landmarks::lines(shared, found)),
    );
    findings.merge(found);
    findings.merge(line_found);
    let known_lines = line_outcome.whole.then_some(&lines);
    let (groups, outcome) = groups(shared, known_lines, &mut names.group_kinds, findings);
    outcomes.insert(PointLandmark::TABLE.name, point_outcome);
    outcomes.insert(LineLandmark::TABLE.name, line_outcome);
    outcomes.insert(StructuralGroup::TABLE.name, outcome);
    Truth { points, lines, groups }
}

type Claimed = (Claims, Outcome);

fn claims(shared: &Shared<'_>, index: &FrameIndex, findings: &mut Findings) -> (Claimed, Claimed) {
    let points = correspondences::<PointCorrespondence>(shared, index, findings);
    (points, correspondences::<LineCorrespondence>(shared, index, findings))
}

/// Holds what correspondences claim of each table that they name against what it shows.
fn hold_claims<R: Correspondence, const N: usize>(
    shared: &Shared<'_>,
    (claims, outcome): &Claimed,
    seen: [&Seen<N>; 2],
    findings: &mut Findings,
) {
    for ((named, claimed), seen) in R::TABLES.iter().filter_map(|named| {
        let place = R::TABLES.iter().position(|other| other == named)?;
        Some(((*named, *claims.get(named)?), seen[place]))
    }) {
        // A table that is not there shows nothing; one that cannot be read cannot be held against anything.
        let readable = outcome.whole && (seen.outcome.whole || !shared.has_table(named));
        if let (true, Some(there)) = (readable, seen.books.hash) {
            hold::<R>(shared, named, claimed, there, findings);
        }
    }
}

fn other_tables(
    shared: &Shared<'_>,
    index: &FrameIndex,
    names: &Names,
    findings: &mut Findings,
) -> (Names, Vec<(&'static str, Outcome)>) {
    let mut names = names.clone();
    let mut outcomes = graphs(shared, index, &mut names.factor_kinds, findings);
    outcomes.push(("trajectories", trajectories(shared, index, &mut names.estimates, findings)));
    outcomes.push(("map_points", map_points(shared, &mut names.estimates, findings)));
    outcomes.push(("map_lines", map_lines(shared, &mut names.estimates, findings)));
    let tracked = tracking(shared, index, &mut names.estimates, &mut names.tracking_states, findings);
    outcomes.push(("tracking", tracked));
    outcomes.push(("iterations", iterations(shared, &mut names.estimates, findings)));
    (names, outcomes)
}

/// What each frame shows: of the measurements, or of the observations where nothing is measured.
fn counts<'a, const N: usize>(measured: &'a Seen<N>, observed: &'a Seen<N>) -> Option<&'a [FrameCount]> {
    let chosen = if measured.outcome.rows > 0 { measured } else { observed };
    let readable = |seen: &Seen<N>| (seen.outcome.whole || !seen.outcome.there) && seen.outcome.ordered;
    if readable(measured) && readable(chosen) { chosen.books.counts.as_deref() } else { None }
}

/// Drops findings that only echo a table that could not be read.
fn forget(
    shared: &Shared<'_>,
    frames_known: bool,
    outcomes: &BTreeMap<&'static str, Outcome>,
    findings: &mut Findings,
) {
    if !frames_known {
        findings.forget(RuleId::FrameKnown, |_| true);
        findings.forget(RuleId::FrameStatisticsAgree, |_| true);
    }
    let unread =
        |table: &str| shared.has_table(table) && outcomes.get(table).is_none_or(|outcome| !outcome.whole);
    if ["graph_poses", "graph_points", "graph_lines"].into_iter().any(unread) {
        findings.forget(RuleId::GraphVerticesKnown, |_| true);
    }
    if unread(StructuralGroup::TABLE.name) {
        findings.forget(RuleId::FrameStatisticsAgree, |_| true);
    }
    let per_frame = [
        PointMeasurement::TABLE.name,
        PointObservation::TABLE.name,
        LineMeasurement::TABLE.name,
        LineObservation::TABLE.name,
    ];
    if per_frame.into_iter().any(unread) {
        findings.forget(RuleId::LandmarkSeen, |_| true);
    }
}

const POINTS: Kind<3> = Kind {
    word: "point",
    table: PointLandmark::TABLE.name,
    triangulates: RuleId::PointLandmarksTriangulate,
    reprojects: RuleId::PointObservationsReproject,
    moved: point_moved,
    observations: PointObservation::TABLE.name,
    measurements: PointMeasurement::TABLE.name,
};

fn point_moved(found: &Evaluation<3>) -> String {
    format!("{:.4} m", found.step.norm())
}

const LINES: Kind<4> = Kind {
    word: "line",
    table: LineLandmark::TABLE.name,
    triangulates: RuleId::LineLandmarksTriangulate,
    reprojects: RuleId::LineObservationsReproject,
    moved: line_moved,
    observations: LineObservation::TABLE.name,
    measurements: LineMeasurement::TABLE.name,
};

fn line_moved(found: &Evaluation<4>) -> String {
    let (shift, turn) = (found.step[0].hypot(found.step[1]), found.step[2].hypot(found.step[3]));
    format!("{shift:.4} m at its middle and {turn:.4} m more at its ends")
}
