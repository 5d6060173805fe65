//! Rows and landmarks put into their tables, with what can be recovered of them.

use super::judged::Judged;
use super::landmarks::{Points, Segments};
use super::ledger::Ledger;
use super::poses::Poses;
use super::recover::{
    count_unfit, recover_depths, recover_line_landmarks, recover_points, recover_unrefined,
};
use super::residual::{by_line, by_point};
use super::rows::{Rows, line_observation, point_observation};
use open_structure::geometry::PinholeCamera;
use open_structure::structure::{LineLandmark, PointLandmark, Recovery, Sequence};

/// What is known of the world.
pub(super) struct Scene<'a> {
    pub(super) truth: &'a Poses,
    pub(super) camera: &'a PinholeCamera,
    pub(super) points: &'a Points,
    pub(super) lines: &'a Segments,
}

/// Puts points into their tables.
pub(super) fn add_points(
    observations: Option<&Rows>,
    measurements: Option<&Rows>,
    scene: &Scene<'_>,
    sequence: &mut Sequence,
    ledger: &mut Ledger,
) -> Vec<Recovery> {
    let Scene { truth, camera, points, .. } = *scene;
    let mut recovered = Vec::new();
    sequence.point_landmarks = points.iter().map(|(id, at)| PointLandmark::new(*id, *at)).collect();
    if let Some(rows) = measurements {
        sequence.point_measurements.clone_from(&rows.points);
    }
    if let Some(rows) = observations {
        sequence.point_observations = rows.points.iter().map(point_observation).collect();
        recovered.extend(recover_depths(&mut sequence.point_observations, truth, camera, points));
        let tracks = by_point(&rows.points);
        let (found, recovery) = recover_points(&tracks, points, truth, camera, &rows.file, ledger);
        sequence.point_landmarks.extend(found);
        recovered.extend(recovery);
    }
    recovered
}

/// Puts lines into their tables. Lines are fitted to rows without noise where there are any.
pub(super) fn add_lines(
    observations: Option<&Judged>,
    measurements: Option<&Judged>,
    scene: &Scene<'_>,
    sequence: &mut Sequence,
    ledger: &mut Ledger,
) -> Vec<Recovery> {
    let Scene { truth, camera, lines, .. } = *scene;
    let mut recovered = Vec::new();
    sequence.line_landmarks =
        lines.iter().filter_map(|(id, segment)| LineLandmark::from_segment(*id, segment).ok()).collect();
    if let Some(judged) = measurements {
        sequence.line_measurements.clone_from(&judged.rows.lines);
    }
    if let Some(Judged { rows, fits, .. }) = observations {
        sequence.line_observations = rows.lines.iter().map(line_observation).collect();
        let (found, recovery) = recover_line_landmarks(fits, lines);
        sequence.line_landmarks.extend(found);
        recovered.extend(recovery);
        count_unfit(fits, |id| !lines.contains_key(id), &rows.file, ledger);
    }
    if let Some(Judged { rows, fits, lines: judgement, .. }) = observations.or(measurements) {
        let sigma_px = judgement.and_then(|judgement| judgement.own).map_or(1.0, |own| own.sigma);
        let tracks = by_line(&rows.lines);
        let (found, recovery) = recover_unrefined(&tracks, fits, lines, truth, camera, sigma_px);
        if recovery.is_some() {
            count_unfit(fits, |id| lines.contains_key(id), &rows.file, ledger);
        }
        sequence.map_lines.extend(found);
        recovered.extend(recovery);
    }
    recovered
}
