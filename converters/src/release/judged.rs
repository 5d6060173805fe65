//! The rows of one file with what residuals say about them.

use super::decide::{Judgement, Verdict, judge_lines, judge_points};
use super::estimates::Known;
use super::landmarks::{Points, Segments};
use super::line_fit::{Fits, fit_lines};
use super::poses::Poses;
use super::residual::{DepthMiss, by_line, line_depths, line_distances, line_views};
use super::rows::Rows;
use crate::family::{Sight, sight};
use open_structure::geometry::{PinholeCamera, PluckerLine};
use open_structure::structure::LineId;
use std::collections::BTreeMap;

/// Rows by which a family is chosen.
const SAMPLED_SIGHTS: usize = 4000;

/// The rows of one file with what was found about them.
pub(super) struct Judged {
    pub(super) rows: Rows,
    pub(super) fits: Fits,
    pub(super) points: Option<Judgement>,
    pub(super) lines: Option<Judgement>,
}

/// Landmarks in their cameras: of the truth, or of the graph where it alone has landmarks.
pub(super) fn sights(association: &Rows, graph: &Rows, known: &Known<'_>) -> Vec<Sight> {
    let Known { truth, points: landmarks, graph: vertices, .. } = *known;
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

/// The endless lines of segments.
pub(super) fn plucker(lines: &Segments) -> BTreeMap<LineId, PluckerLine> {
    lines.iter().filter_map(|(id, segment)| Some((*id, segment.plucker().ok()?))).collect()
}

/// Fits and judges the rows of a file.
pub(super) fn judged(
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

/// What rows are; `None` where there are none.
pub(super) fn verdict(judgement: Option<&Judgement>) -> Option<Verdict> {
    judgement.map(|judgement| judgement.verdict)
}

/// The depths of measured line ends against the best lines at hand: fitted to noise-free rows; published, where the rows lie on
/// them; fitted to the noisy rows themselves.
pub(super) fn depth_misses(
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
