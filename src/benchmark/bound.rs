//! The bound: how accurate any method could be on what was measured.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

use super::measured::given;
use super::run::adjust_options;
use super::{Error, Method, Plan, Progress, Store};
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
    /// Whether the alignment scales: for methods whose scale is free.
    pub is_scaled: bool,
}

/// The bounds of a sequence, by method; trackers and `structural-ba` share theirs.
pub(super) fn bounds(
    sequence: &Sequence,
    plan: &Plan,
    store: &Store,
    tell: &(dyn Fn(&Progress<'_>) + Sync),
) -> Result<(), Error> {
    let title = &sequence.manifest.name;
    // What all measurements allow is shown whatever is run, and is the bound of estimates from elsewhere.
    let mut methods = plan.methods.clone();
    if !methods.contains(&Method::StructuralBa) {
        methods.push(Method::StructuralBa);
    }
    let known = store.bound(title)?;
    if known.is_some_and(|known| methods.iter().all(|method| known.contains_key(method.name()))) {
        return Ok(());
    }
    let seed = plan.seeds.first().copied().unwrap_or(0);
    let sequence = given(sequence, plan, seed);
    let mut found = BTreeMap::new();
    let mut bounds: BTreeMap<Method, Option<Bound>> = BTreeMap::new();
    for method in &methods {
        // Trackers may use all that the structural adjustment uses.
        let basis = if method.is_adjustment() { *method } else { Method::StructuralBa };
        let bound = bounds.entry(basis).or_insert_with(|| match bound_of(&sequence, basis) {
            Ok(bound) => Some(bound),
            Err(reason) => {
                tell(&Progress::NoBound { sequence: title, method: basis.name(), reason: &reason });
                None
            }
        });
        found.extend(bound.map(|bound| (method.name().to_owned(), bound)));
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
    let map_point = |(point_id, at): (PointId, Point3<f64>)| MapPoint::new(name.clone(), point_id, &at);
    let mut lines: BTreeMap<LineId, MapLine> = sequence
        .line_landmarks
        .iter()
        .map(|row| (row.line_id, MapLine::new(name.clone(), row.line_id, &row.segment())))
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
    let truth = truth(sequence);
    let groups = &sequence.structural_groups;
    let noise = MeasurementNoise::declared(&sequence.manifest);
    let (frames, cameras) = (MeasuredFrame::of(sequence), &sequence.manifest.cameras);
    reprojection_graph(&frames, &truth, cameras, noise, groups, &GraphOptions::default())
        .map(|(graph, _)| graph)
        .map_err(|cause| cause.to_string())
}

/// The bound of a method on the measurements of a sequence, at its true poses and landmarks.
///
/// For a method whose scale is free, after Sim(3) alignment; for the others after SE(3) alignment. Groups count as far as their lines
/// are parallel as they were measured.
///
/// * `sequence` — measurements as a plan gives them; true poses and landmarks.
///
/// # Errors
/// In words, where no graph can be built, or the measurements leave something open.
pub fn bound_of(sequence: &Sequence, method: Method) -> Result<Bound, String> {
    let graph = graph(sequence)?;
    let monocular = is_monocular(method);
    let alignment = if monocular { adjust::Alignment::Sim3 } else { adjust::Alignment::Se3 };
    let found =
        adjust::bound(&graph, &adjust_options(method), alignment).map_err(|cause| cause.to_string())?;
    Ok(Bound {
        translation_rms_m: found.translation_rms_m,
        rotation_rms_rad: found.rotation_rms_rad,
        is_scaled: monocular,
    })
}
