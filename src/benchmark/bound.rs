//! The bound: how accurate any method could be on what was measured.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

use super::run::adjust_options;
use super::{Error, Method, Plan, Store, measured};
use crate::adjust;
use crate::covisibility::{GraphOptions, reprojection_graph};
use crate::geometry::{PinholeCamera, Pose, triangulate_point};
use crate::structure::{
    Estimate, FactorGraph, FrameId, LineId, MapLine, MapPoint, MeasuredFrame, MeasurementNoise, PointId,
    Sequence, TrajectoryPose, registry,
};

/// What the measurements allow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// Root mean square of the absolute error of translation after alignment, metres.
    pub translation_rms_m: f64,
    /// Root mean square of the absolute error of rotation after alignment, radians.
    pub rotation_rms_rad: f64,
}

/// The bounds of a sequence, by method; trackers and `structural-ba` share theirs.
pub(super) fn bounds(sequence: &Sequence, plan: &Plan, store: &Store) -> Result<(), Error> {
    let title = &sequence.manifest.name;
    if store.bound(title)?.is_some() {
        return Ok(());
    }
    let seed = plan.seeds.first().copied().unwrap_or(0);
    let sequence = measured(sequence, &plan.noise, seed);
    let mut found = BTreeMap::new();
    if let Ok(bound) = bound_of(&sequence, Method::StructuralBa) {
        for method in plan.methods.iter().filter(|method| !is_monocular(**method)) {
            found.insert(method.name().to_owned(), bound);
        }
    }
    store.keep_bound(title, &found)
}

/// Whether a method uses pixels alone, so that its scale is free.
const fn is_monocular(method: Method) -> bool {
    matches!(method, Method::PointBa | Method::PointLineBa)
}

/// The truth as an estimate: true poses, and landmarks where their measurements see them.
///
/// A line that was turned after it was observed is taken as it was observed (estimate `unrefined`). A point without landmark is
/// triangulated through the true poses.
fn truth(sequence: &Sequence) -> Estimate {
    let name = "truth".to_owned();
    let trajectory: Vec<TrajectoryPose> = sequence
        .frames
        .iter()
        .filter_map(|row| Some(TrajectoryPose::new(name.clone(), row.frame_id, row.world_from_camera()?)))
        .collect();
    let mut points: BTreeMap<PointId, Point3<f64>> =
        sequence.point_landmarks.iter().map(|row| (row.point_id, Point3::new(row.x, row.y, row.z))).collect();
    points.extend(triangulated(sequence, &points));
    let map_point = |(point_id, at): (PointId, Point3<f64>)| MapPoint {
        estimate: name.clone(),
        point_id,
        x: at.x,
        y: at.y,
        z: at.z,
        covariance: None,
    };
    let mut lines: BTreeMap<LineId, MapLine> = sequence
        .line_landmarks
        .iter()
        .map(|row| {
            let line = MapLine {
                estimate: name.clone(),
                line_id: row.line_id,
                start_x: row.start_x,
                start_y: row.start_y,
                start_z: row.start_z,
                end_x: row.end_x,
                end_y: row.end_y,
                end_z: row.end_z,
                covariance: None,
            };
            (row.line_id, line)
        })
        .collect();
    let unrefined = sequence.map_lines.iter().filter(|row| row.estimate == registry::UNREFINED);
    lines.extend(unrefined.map(|row| (row.line_id, row.clone())));
    Estimate {
        trajectory,
        points: points.into_iter().map(map_point).collect(),
        lines: lines.into_values().collect(),
        name,
        ..Estimate::default()
    }
}

/// Points that were measured and have no landmark.
fn triangulated(sequence: &Sequence, known: &BTreeMap<PointId, Point3<f64>>) -> Vec<(PointId, Point3<f64>)> {
    let cameras: BTreeMap<FrameId, (PinholeCamera, Pose)> = sequence
        .frames
        .iter()
        .filter_map(|row| {
            let camera = sequence.manifest.camera(row.camera_id)?.projection();
            Some((row.frame_id, (camera, row.world_from_camera()?.pose().ok()?.inverse())))
        })
        .collect();
    let mut views: BTreeMap<PointId, Vec<_>> = BTreeMap::new();
    for row in sequence.point_measurements.iter().filter(|row| !known.contains_key(&row.point_id)) {
        if let Some((camera, camera_from_world)) = cameras.get(&row.frame_id) {
            let view = (*camera, *camera_from_world, Point2::new(row.u, row.v));
            views.entry(row.point_id).or_default().push(view);
        }
    }
    views.into_iter().filter_map(|(id, views)| Some((id, triangulate_point(&views)?.point))).collect()
}

/// The graph of what was measured, at the truth.
fn graph(sequence: &Sequence) -> Result<FactorGraph, String> {
    let (cameras, groups) = (&sequence.manifest.cameras, &sequence.structural_groups);
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let frames = MeasuredFrame::of(sequence);
    reprojection_graph(&frames, &truth(sequence), cameras, noise, groups, &GraphOptions::default())
        .map(|(graph, _)| graph)
        .map_err(|cause| cause.to_string())
}

/// TEMPORARY
pub fn bound_of(sequence: &Sequence, _method: Method) -> Result<Bound, String> {
    let _ = graph(sequence)?;
    Err("none".into())
}
