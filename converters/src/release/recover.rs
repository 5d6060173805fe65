//! What the release lost and the rest of it determines: depths of points, unrefined lines, lines never published.

use super::landmarks::{Points, Segments};
use super::ledger::Ledger;
use super::line_fit::{Fits, Unfit, directed};
use super::poses::Poses;
use super::residual::{line_distances, line_views};
use nalgebra::{Point2, Vector3};
use open_structure::geometry::{PinholeCamera, PluckerLine, triangulate_point};
use open_structure::structure::{
    LineId, LineLandmark, LineMeasurement, MapLine, PointId, PointLandmark, PointMeasurement,
    PointObservation, Recovery,
};
use std::collections::{BTreeMap, BTreeSet};

/// Name of the estimate that holds lines as they were before they were made parallel.
pub const UNREFINED: &str = "unrefined";

/// A point observation farther than this from its landmark's image takes no depth from it, pixels.
const AGREEING_PX: f64 = 0.5;

/// A published line has certainly been turned when its squared misses exceed those of the fitted line by so many sigmas squared.
const TURNED_CHI2: f64 = 60.0;

/// Gives noise-free point observations the depth of their landmark, where it lies where they say.
pub(super) fn recover_depths(
    rows: &mut [PointObservation],
    poses: &Poses,
    camera: &PinholeCamera,
    landmarks: &Points,
) -> Option<Recovery> {
    let mut count = 0;
    for row in rows {
        let (Some(pose), Some(landmark)) = (poses.get(&row.frame_id), landmarks.get(&row.point_id)) else {
            continue;
        };
        let in_camera = pose.camera_from_world * *landmark;
        let agrees = camera
            .project(in_camera)
            .is_some_and(|found| (found - Point2::new(row.u, row.v)).norm() <= AGREEING_PX);
        if row.depth.is_none() && agrees {
            row.depth = Some(in_camera.z);
            count += 1;
        }
    }
    (count > 0).then(|| Recovery {
        table: "point_observations".to_owned(),
        columns: vec!["depth".to_owned()],
        rows: count,
        method: format!(
            "z of the published landmark in the camera of the true pose, where its image lies within {AGREEING_PX} px of the observation"
        ),
        ids: Vec::new(),
    })
}

/// Points that noise-free rows show and that were not published: triangulated.
pub(super) fn recover_points(
    tracks: &BTreeMap<PointId, Vec<&PointMeasurement>>,
    published: &Points,
    poses: &Poses,
    camera: &PinholeCamera,
    file: &str,
    ledger: &mut Ledger,
) -> (Vec<PointLandmark>, Option<Recovery>) {
    let mut found = Vec::new();
    let mut lost = 0;
    for (id, track) in tracks.iter().filter(|(id, _)| !published.contains_key(id)) {
        let views: Vec<_> = track
            .iter()
            .filter_map(|row| {
                Some((*camera, poses.get(&row.frame_id)?.camera_from_world, Point2::new(row.u, row.v)))
            })
            .collect();
        match triangulate_point(&views) {
            Some(triangulated) => found.push(PointLandmark::new(*id, triangulated.point)),
            None => lost += 1,
        }
    }
    ledger.exclude_many(file, "point without landmark cannot be triangulated", lost, None);
    let recovery = (!found.is_empty()).then(|| Recovery {
        table: "point_landmarks".to_owned(),
        columns: Vec::new(),
        rows: found.len() as u64,
        method: "triangulated from the landmark's noise-free rows with the true poses".to_owned(),
        ids: found.iter().map(|point: &PointLandmark| point.point_id.0).collect(),
    });
    (found, recovery)
}

/// Lines that were never published and that noise-free rows determine.
pub(super) fn recover_line_landmarks(
    fits: &Fits,
    published: &Segments,
) -> (Vec<LineLandmark>, Option<Recovery>) {
    let found: Vec<LineLandmark> = fits
        .iter()
        .filter(|(id, _)| !published.contains_key(id))
        .filter_map(|(id, fit)| LineLandmark::from_segment(*id, &fit.as_ref().ok()?.segment).ok())
        .collect();
    let recovery = (!found.is_empty()).then(|| Recovery {
        table: "line_landmarks".to_owned(),
        columns: Vec::new(),
        rows: found.len() as u64,
        method: "endless line with the least squared distances of its own rows' ends, through the true poses; ends are the outermost places that the rows show; not turned to be parallel to its group".to_owned(),
        ids: found.iter().map(|line| line.line_id.0).collect(),
    });
    (found, recovery)
}

/// Lines as they were observed, where the published ones were turned afterwards.
///
/// None when every published line agrees with its rows: there is nothing that was lost.
///
/// * `sigma_px` — noise of the rows, pixels.
pub(super) fn recover_unrefined(
    tracks: &BTreeMap<LineId, Vec<&LineMeasurement>>,
    fits: &Fits,
    published: &Segments,
    poses: &Poses,
    camera: &PinholeCamera,
    sigma_px: f64,
) -> (Vec<MapLine>, Option<Recovery>) {
    let turned = tracks.iter().any(|(id, track)| {
        let (Some(Ok(fit)), Some(landmark)) = (fits.get(id), published.get(id)) else { return false };
        let views = line_views(track, poses, camera);
        let squares = |line: &PluckerLine| line_distances(&views, line).iter().map(|d| d * d).sum::<f64>();
        landmark
            .plucker()
            .is_ok_and(|line| squares(&line) - squares(&fit.line) > TURNED_CHI2 * sigma_px.max(0.05).powi(2))
    });
    if !turned {
        return (Vec::new(), None);
    }
    let rows: Vec<MapLine> = fits
        .iter()
        .filter_map(|(id, fit)| {
            let direction: Vector3<f64> = published.get(id)?.direction()?;
            Some(MapLine::new(UNREFINED.to_owned(), *id, &directed(fit.as_ref().ok()?.segment, &direction)))
        })
        .collect();
    let recovery = (!rows.is_empty()).then(|| Recovery {
        table: "map_lines".to_owned(),
        columns: Vec::new(),
        rows: rows.len() as u64,
        method: format!(
            "estimate `{UNREFINED}`: the lines before they were turned to be parallel; endless line with the least squared distances of its own rows' ends, through the true poses; ends are the outermost places that the rows show"
        ),
        ids: rows.iter().map(|line| line.line_id.0).collect(),
    });
    (rows, recovery)
}

/// Counts the lines that cannot be fitted.
pub(super) fn count_unfit(fits: &Fits, wanted: impl Fn(&LineId) -> bool, file: &str, ledger: &mut Ledger) {
    let mut counts: BTreeMap<Unfit, u64> = BTreeMap::new();
    let mut ids: BTreeMap<Unfit, BTreeSet<i64>> = BTreeMap::new();
    for (id, fit) in fits.iter().filter(|(id, _)| wanted(id)) {
        if let Err(unfit) = fit {
            *counts.entry(*unfit).or_default() += 1;
            ids.entry(*unfit).or_default().insert(id.0);
        }
    }
    for (unfit, count) in counts {
        let ids: Vec<String> = ids[&unfit].iter().take(20).map(i64::to_string).collect();
        let more = if count > 20 { ", …" } else { "" };
        ledger.exclude_many(
            file,
            &format!("{} (lines {}{more})", unfit.reason(), ids.join(", ")),
            count,
            None,
        );
    }
}
