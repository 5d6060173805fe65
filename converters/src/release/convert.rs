//! The conversion of one sequence, step by step.

use super::decide::{Assignment, Judgement, Origin, Verdict, assign, judge_lines, judge_points};
use super::describe::{Findings, manifest};
use super::estimates::{Estimates, Known, add_estimates, estimates, frames as estimate_frames};
use super::graph::{Vertices, add_graph};
use super::groups::groups;
use super::landmarks::{Points, Segments, line_landmarks, point_landmarks};
use super::ledger::Ledger;
use super::line_fit::{Fits, fit_lines};
use super::noise::FoundNoise;
use super::poses::{Poses, is_coarse, largest_angle, largest_distance, poses};
use super::recover::{
    count_unfit, recover_depths, recover_line_landmarks, recover_points, recover_unrefined,
};
use super::residual::{DepthMiss, by_line, by_point, line_depths, line_distances, line_views};
use super::rows::{Rows, line_observation, point_observation};
use crate::family::{Choice, Clues, Sight, choose, sight};
use crate::text_release::TextSequence;
use open_structure::geometry::{PinholeCamera, PluckerLine};
use open_structure::structure::{
    CameraId, Frame, FrameId, LineId, LineLandmark, PointLandmark, Recovery, Sequence, frame_statistics,
    line_correspondences, point_correspondences, registry,
};
use std::collections::{BTreeMap, BTreeSet};

/// Frame rate of the clock that is made for the release, which has no time stamps; hertz.
pub(super) const RATE_HZ: i64 = 30;

/// Rows by which a family is chosen.
const SAMPLED_SIGHTS: usize = 4000;

/// Ground truth that is printed again may differ by its rounding, metres and radians.
const REPEATED_TRUTH: f64 = 2e-3;

/// How a sequence is converted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// The camera, instead of the one that fits best.
    pub camera: Option<PinholeCamera>,
}

/// A converted sequence.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The sequence, sorted, with its manifest.
    pub sequence: Sequence,
    /// What was found on the way.
    pub findings: Findings,
}

/// Why a sequence cannot be converted.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// Nothing names a frame.
    #[error("{name}: expected poses or observations of at least one frame, found none")]
    NoFrames {
        /// The sequence.
        name: String,
    },
}

/// The rows of one file with what was found about them.
struct Judged {
    rows: Rows,
    fits: Fits,
    points: Option<Judgement>,
    lines: Option<Judgement>,
}

/// Converts one sequence.
///
/// # Errors
/// [`Error::NoFrames`]. Everything else that cannot be used is counted in the manifest.
pub fn convert(text: &TextSequence, options: &Options) -> Result<Converted, Error> {
    let mut ledger = Ledger::default();
    ledger.take_problems(&text.problems);

    let truth = true_poses(text, &mut ledger);
    let points = point_landmarks(text.point_landmarks.as_ref(), &mut ledger);
    let lines = line_landmarks(&text.line_landmarks, &mut ledger);
    let association = text.association.as_ref().map(|file| Rows::of(file, &mut ledger)).unwrap_or_default();
    let mut quiet = Ledger::default();
    let graph = text.graph.as_ref().map(|file| Rows::of(file, &mut quiet)).unwrap_or_default();
    let vertices = text.graph.as_ref().map(|file| Vertices::of(file, &mut ledger)).unwrap_or_default();
    let known = Known { truth: &truth, points: &points, lines: &lines, graph: &vertices };
    let results = estimates(text, &known, &mut ledger);

    let choice = choose(&Clues {
        name: &text.name,
        sights: &sights(&association, &graph, &truth, &points, &vertices),
        pixels: &association.pixels().chain(graph.pixels()).collect::<Vec<_>>(),
        coarse_poses: is_coarse(&truth),
        given: options.camera,
    });
    let camera = choice.camera;

    let same_points = association.points == graph.points;
    let same_lines = association.lines == graph.lines;
    let directions = plucker(&lines);
    let judge = |rows: Rows| judged(rows, &truth, &camera, &points, &directions);
    let association = judge(association);
    let graph = if same_points && same_lines {
        Judged { rows: graph, fits: association.fits.clone(), ..association }
    } else {
        judge(graph)
    };
    let point_tables =
        assign(verdict(association.points.as_ref()), verdict(graph.points.as_ref()), same_points);
    let line_tables = assign(verdict(association.lines.as_ref()), verdict(graph.lines.as_ref()), same_lines);
    let of = |origin: Origin| if origin == Origin::Association { &association } else { &graph };
    // Rows that went nowhere but into factors have their flaws counted there.
    if [point_tables, line_tables].iter().any(|tables| {
        tables.measurements == Some(Origin::Graph) || tables.observations == Some(Origin::Graph)
    }) {
        ledger.take(quiet);
    }

    let mut sequence = Sequence::default();
    let mut recovered: Vec<Recovery> = Vec::new();

    if let Some(origin) = point_tables.observations {
        let rows = &of(origin).rows;
        sequence.point_observations = rows.points.iter().map(point_observation).collect();
        recovered.extend(recover_depths(&mut sequence.point_observations, &truth, &camera, &points));
    }
    if let Some(origin) = point_tables.measurements {
        sequence.point_measurements.clone_from(&of(origin).rows.points);
    }
    if let Some(origin) = line_tables.observations {
        sequence.line_observations = of(origin).rows.lines.iter().map(line_observation).collect();
    }
    if let Some(origin) = line_tables.measurements {
        sequence.line_measurements.clone_from(&of(origin).rows.lines);
    }

    sequence.point_landmarks = points.iter().map(|(id, at)| PointLandmark::new(*id, *at)).collect();
    if let Some(origin) = point_tables.observations {
        let rows = &of(origin).rows;
        let (found, recovery) =
            recover_points(&by_point(&rows.points), &points, &truth, &camera, &rows.file, &mut ledger);
        sequence.point_landmarks.extend(found);
        recovered.extend(recovery);
    }
    sequence.line_landmarks =
        lines.iter().filter_map(|(id, segment)| LineLandmark::from_segment(*id, segment).ok()).collect();
    // Lines are fitted to rows without noise where there are any.
    if let Some(origin) = line_tables.observations.or(line_tables.measurements) {
        let Judged { rows, fits, lines: judgement, .. } = of(origin);
        let exact = line_tables.observations.is_some();
        if exact {
            let (found, recovery) = recover_line_landmarks(fits, &lines);
            sequence.line_landmarks.extend(found);
            recovered.extend(recovery);
            count_unfit(fits, |id| !lines.contains_key(id), &rows.file, &mut ledger);
        }
        let sigma_px = judgement.and_then(|judgement| judgement.own).map_or(1.0, |own| own.sigma);
        let tracks = by_line(&rows.lines);
        let (found, recovery) = recover_unrefined(&tracks, fits, &lines, &truth, &camera, sigma_px);
        if recovery.is_some() {
            count_unfit(fits, |id| lines.contains_key(id), &rows.file, &mut ledger);
        }
        sequence.map_lines.extend(found);
        recovered.extend(recovery);
    }
    sequence.sort();

    sequence.structural_groups =
        groups(text.association.as_ref(), text.graph.as_ref(), &sequence.line_landmarks, &mut ledger);
    if let Some(file) = &text.graph {
        add_graph(file, &vertices, &mut sequence, &mut ledger);
    }
    add_estimates(&results, &mut sequence);

    sequence.frames = frames(&truth, [&association.rows, &graph.rows], &vertices.poses, &results);
    if sequence.frames.is_empty() {
        return Err(Error::NoFrames { name: text.name.clone() });
    }
    sequence.point_correspondences =
        point_correspondences(&sequence.point_measurements, &sequence.point_observations);
    sequence.line_correspondences =
        line_correspondences(&sequence.line_measurements, &sequence.line_observations);
    sequence.sort();
    sequence.frame_statistics = frame_statistics(&sequence);

    let depths = line_tables
        .measurements
        .map(|origin| depth_misses(of(origin), &association, &directions, &truth, &camera));
    let judgement = |tables: Assignment, of_kind: fn(&Judged) -> Option<&Judgement>| {
        tables.measurements.and_then(|origin| of_kind(of(origin)))
    };
    let noise = FoundNoise::of(
        judgement(point_tables, |judged| judged.points.as_ref()),
        judgement(line_tables, |judged| judged.lines.as_ref()),
        depths.as_deref().unwrap_or_default(),
    );
    remark(text, &choice, [point_tables, line_tables], &truth, &sequence, &results, &vertices, &mut ledger);

    let (excluded, notes) = ledger.finish();
    let findings = Findings {
        choice,
        association_points: association.points,
        association_lines: association.lines,
        graph_points: graph.points,
        graph_lines: graph.lines,
        noise,
        recovered,
        excluded,
        notes,
    };
    sequence.manifest = manifest(text, &sequence, &findings, options);
    Ok(Converted { sequence, findings })
}

/// The true poses: of the file with all digits, or of one that prints them again.
fn true_poses(text: &TextSequence, ledger: &mut Ledger) -> Poses {
    let repeated = || text.repeated_ground_truth.iter();
    let first = text.ground_truth.as_ref().or_else(|| {
        let most = repeated().map(|file| file.poses.len()).max();
        repeated().find(|file| Some(file.poses.len()) == most)
    });
    let Some(first) = first else { return Poses::new() };
    let mut truth = poses(&first.poses, &first.file, ledger);
    for file in repeated().filter(|file| file.file != first.file) {
        let again = poses(&file.poses, &file.file, ledger);
        let (distance, _) = largest_distance(&truth, &again);
        let angle = largest_angle(&truth, &again);
        if distance > REPEATED_TRUTH || angle > REPEATED_TRUTH {
            let reason = format!(
                "ground truth differs from {} by up to {distance:.4} m, {angle:.4} rad; the latter is kept",
                first.file
            );
            ledger.exclude_many(&file.file, &reason, again.len() as u64, None);
            continue;
        }
        let before = truth.len();
        for (id, pose) in again {
            truth.entry(id).or_insert(pose);
        }
        if truth.len() > before {
            ledger.note(format!("{} true poses are in {} alone", truth.len() - before, file.file));
        }
    }
    truth
}

/// Landmarks in their cameras: of the truth, or of the graph where it alone has landmarks.
fn sights(
    association: &Rows,
    graph: &Rows,
    truth: &Poses,
    landmarks: &Points,
    vertices: &Vertices,
) -> Vec<Sight> {
    let tries = [
        (association, truth, landmarks),
        (graph, truth, landmarks),
        (graph, &vertices.poses, &vertices.points),
        (association, &vertices.poses, &vertices.points),
    ];
    for (rows, poses, points) in tries {
        let stride = rows.points.len().div_ceil(SAMPLED_SIGHTS).max(1);
        let found: Vec<Sight> = rows
            .points
            .iter()
            .step_by(stride)
            .filter_map(|row| {
                let pose = poses.get(&row.frame_id)?;
                Some(sight(&pose.camera_from_world, *points.get(&row.point_id)?, row.u, row.v))
            })
            .collect();
        if !found.is_empty() {
            return found;
        }
    }
    Vec::new()
}

fn plucker(lines: &Segments) -> BTreeMap<LineId, PluckerLine> {
    lines.iter().filter_map(|(id, segment)| Some((*id, segment.plucker().ok()?))).collect()
}

fn judged(
    rows: Rows,
    truth: &Poses,
    camera: &PinholeCamera,
    points: &Points,
    lines: &BTreeMap<LineId, PluckerLine>,
) -> Judged {
    let tracks = by_line(&rows.lines);
    let fits = fit_lines(&tracks, truth, camera);
    let judged_lines = (!rows.lines.is_empty()).then(|| judge_lines(&tracks, &fits, truth, camera, lines));
    let judged_points = (!rows.points.is_empty()).then(|| judge_points(&rows.points, truth, camera, points));
    drop(tracks);
    Judged { rows, fits, points: judged_points, lines: judged_lines }
}

fn verdict(judgement: Option<&Judgement>) -> Option<Verdict> {
    judgement.map(|judgement| judgement.verdict)
}

/// Every frame that anything names, stamped by a clock of 30 Hz.
fn frames(truth: &Poses, rows: [&Rows; 2], graph: &Poses, results: &Estimates) -> Vec<Frame> {
    let mut ids: BTreeSet<FrameId> = truth.keys().chain(graph.keys()).copied().collect();
    ids.extend(estimate_frames(results));
    for rows in rows {
        ids.extend(rows.points.iter().map(|row| row.frame_id));
        ids.extend(rows.lines.iter().map(|row| row.frame_id));
    }
    ids.into_iter()
        .map(|id| Frame::new(id, stamp_nanos(id), CameraId(0), truth.get(&id).map(|pose| pose.row)))
        .collect()
}

/// `round(id / 30 s)`, nanoseconds, without overflow for any id that is a frame's.
fn stamp_nanos(FrameId(id): FrameId) -> i64 {
    let (seconds, rest) = (id / RATE_HZ, id % RATE_HZ);
    seconds * 1_000_000_000 + (rest * 1_000_000_000 + RATE_HZ / 2) / RATE_HZ
}

/// The depths of measured line ends against the best lines at hand: fitted to noise-free rows; published, where the rows lie on
/// them; fitted to the noisy rows themselves.
fn depth_misses(
    measured: &Judged,
    association: &Judged,
    published: &BTreeMap<LineId, PluckerLine>,
    truth: &Poses,
    camera: &PinholeCamera,
) -> Vec<DepthMiss> {
    let exact = verdict(association.lines.as_ref()) == Some(Verdict::NoiseFree);
    let fitted = |judged: &Judged, id: &LineId| Some(judged.fits.get(id)?.as_ref().ok()?.line);
    by_line(&measured.rows.lines)
        .iter()
        .filter_map(|(id, track)| {
            let of_exact = exact.then(|| fitted(association, id)).flatten();
            let line = of_exact.or_else(|| match (published.get(id).copied(), fitted(measured, id)) {
                // Published lines may have been turned, or be wrong.
                (Some(published), Some(own)) => {
                    let views = line_views(track, truth, camera);
                    let squares =
                        |line: &PluckerLine| line_distances(&views, line).iter().map(|d| d * d).sum::<f64>();
                    Some(if squares(&published) < 1.2 * squares(&own) { published } else { own })
                }
                (published, own) => published.or(own),
            })?;
            Some(line_depths(track, truth, camera, &line))
        })
        .flatten()
        .collect()
}

/// Remarks for people that no figure of the manifest carries.
#[expect(clippy::too_many_arguments, reason = "looks at everything once, at the end")]
fn remark(
    text: &TextSequence,
    choice: &Choice,
    tables: [Assignment; 2],
    truth: &Poses,
    sequence: &Sequence,
    results: &Estimates,
    vertices: &Vertices,
    ledger: &mut Ledger,
) {
    if choice.is_doubtful() {
        ledger.note(format!(
            "no known camera fits: the best ({}) misses by {:.1} px in the median; give the right one with --camera",
            choice.family_name(),
            choice.residual_px.unwrap_or_default()
        ));
    } else if choice.family.is_none() && choice.by != "given" {
        ledger.note("neither rows nor name tell the camera; that of the simulated sequences is assumed, give the right one with --camera".to_owned());
    }
    if choice.beyond_image > 0 {
        let PinholeCamera { width, height, .. } = choice.camera;
        ledger.note(format!(
            "{} positions lie far beyond the image of {width}x{height} px",
            choice.beyond_image
        ));
    }
    for (kind, tables) in ["points", "lines"].into_iter().zip(tables) {
        if tables.graph_apart {
            ledger.note(format!(
                "{kind}: the noisy rows of the association are the measurements; the graph has other ones, which stand in its factors"
            ));
        }
    }
    let blind = sequence.frames.len() - truth.len().min(sequence.frames.len());
    if blind > 0 {
        ledger.note(format!("{blind} frames have no true pose"));
    }
    if let Some(estimate) = results.get(registry::MAP_TO_FRAME) {
        let (distance, common) = largest_distance(&estimate.poses, &vertices.poses);
        if common > 0 && distance > REPEATED_TRUTH {
            ledger.note(format!(
                "poses of the graph and of {} are up to {distance:.3} m apart: two runs",
                registry::MAP_TO_FRAME
            ));
        }
    }
    if text.association.is_none() {
        ledger.note("no association: measurements are those of the graph".to_owned());
    }
    let lines: BTreeSet<LineId> = sequence.line_landmarks.iter().map(|line| line.line_id).collect();
    let shown: BTreeSet<LineId> = sequence
        .line_observations
        .iter()
        .map(|row| row.line_id)
        .chain(sequence.line_measurements.iter().map(|row| row.line_id))
        .collect();
    let unknown = shown.difference(&lines).count();
    if unknown > 0 && !lines.is_empty() {
        ledger.note(format!("{unknown} lines are seen and have no landmark"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_follow_a_clock_of_thirty_hertz() {
        assert_eq!(
            [0, 1, 2, 3, 30].map(|id| stamp_nanos(FrameId(id))),
            [0, 33_333_333, 66_666_667, 100_000_000, 1_000_000_000]
        );
        assert!(stamp_nanos(FrameId(super::super::poses::LARGEST_FRAME)) > 0);
    }
}
