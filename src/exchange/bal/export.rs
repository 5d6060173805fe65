//! From a factor graph to a problem of BAL.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::import::half_turn;
use super::problem::{BalCamera, BalObservation, BalProblem};
use super::radial::Radial;
use crate::exchange::remark::Remarks;
use crate::exchange::{Error, Remark};
use crate::geometry::Pose;
use crate::structure::{Camera, FactorGraph, registry};

/// The points of a factor graph as a problem of BAL: cameras by ascending frame, points by ascending id.
///
/// BAL has one focal length, `fx` here. A pixel is `fx` times the position at z = 1 that it stands for, so that every
/// point projects as before; where `|fy|` is another, residuals in v are `fx/|fy|` times as large as before, which a remark
/// says. A camera whose removed distortion is radial with two coefficients gets it back, and its pixels too. `fy` below 0
/// needs nothing else: the position at z = 1 has the sign already.
///
/// Depth, lines, information and fixed poses have no place in BAL; remarks count them.
///
/// # Errors
/// [`Error::Unfit`] for a graph without a point that is seen, a pose that is no rigid transform, a frame without camera, a
/// camera that is no pinhole, or a factor whose vertices are not there or that lacks its numbers.
pub fn to_bal(graph: &FactorGraph) -> Result<(BalProblem, Vec<Remark>), Error> {
    let mut remarks = Remarks::default();
    let mut problem = BalProblem::default();
    let mut camera_places = BTreeMap::new();
    let mut cameras: Vec<&Camera> = Vec::new();
    for row in &graph.poses {
        let what = || format!("{} of graph `{}`", row.frame_id, graph.name);
        let id = graph.camera_of_frame.get(&row.frame_id);
        let camera = id.and_then(|id| graph.cameras.iter().find(|camera| camera.camera_id == *id));
        let camera = camera.ok_or_else(|| Error::unfit(what(), "a camera", "none"))?;
        if ![camera.fx, camera.fy].iter().all(|f| f.is_finite() && *f != 0.0) || camera.fx <= 0.0 {
            let found = format!("{:?} and {:?}", camera.fx, camera.fy);
            return Err(Error::unfit(what(), "focal lengths fx above 0 and fy not 0", found));
        }
        let world_from_camera = row
            .world_from_camera()
            .pose()
            .map_err(|error| Error::unfit(what(), "a rigid transform", error))?;
        let camera_from_world = half_turn() * world_from_camera.inverse();
        let turn = Pose::new(camera_from_world.rotation(), Vector3::zeros()).log();
        camera_places.insert(row.frame_id, problem.cameras.len());
        problem.cameras.push(BalCamera {
            rotation: [turn[0], turn[1], turn[2]],
            translation: camera_from_world.translation().into(),
            focal: camera.fx,
            radial: radial(camera),
        });
        cameras.push(camera);
    }
    let mut point_places = BTreeMap::new();
    for row in &graph.points {
        if ![row.x, row.y, row.z].iter().all(|number| number.is_finite()) {
            return Err(Error::unfit(row.point_id.to_string(), "finite numbers", "others"));
        }
        point_places.insert(row.point_id, problem.points.len());
        problem.points.push([row.x, row.y, row.z]);
    }
    for factor in graph.factors.iter().filter(|factor| factor.kind == registry::POINT_REPROJECTION) {
        let what = || format!("factor {} of graph `{}`", factor.factor_id, graph.name);
        let camera = factor.frame_id.and_then(|frame| camera_places.get(&frame).copied());
        let point = factor.point_id.and_then(|point| point_places.get(&point).copied());
        let Some((camera, point)) = camera.zip(point) else {
            return Err(Error::unfit(what(), "a pose and a point of the graph", "none"));
        };
        let [u, v, rest @ ..] = factor.measurement.as_slice() else {
            return Err(Error::unfit(what(), "2 or 3 numbers", factor.measurement.len()));
        };
        let of = cameras[camera];
        let flat = [(u - of.cx) / of.fx, -(v - of.cy) / of.fy];
        let pixel = Radial(problem.cameras[camera].radial).distort(flat).map(|part| of.fx * part);
        if !pixel.iter().all(|part| part.is_finite()) {
            return Err(Error::unfit(what(), "a finite pixel", format!("{u:?}, {v:?}")));
        }
        problem.observations.push(BalObservation { camera, point, pixel });
        remarks.lost(usize::from(!rest.is_empty()), "depths are left out: BAL has pixels alone");
        let weighted = factor.information.is_some() && Radial(problem.cameras[camera].radial).is_none();
        remarks.lost(usize::from(weighted), "information matrices are left out: BAL weighs all pixels alike");
        let ratio = of.fx / of.fy.abs();
        remarks.said(
            usize::from(ratio != 1.0),
            format!("pixels have their v scaled by fx/|fy| = {ratio:.5}: BAL has one focal length"),
        );
    }
    let graph_name = || format!("graph `{}`", graph.name);
    if problem.observations.is_empty() {
        return Err(Error::unfit(graph_name(), "points seen in frames", "none"));
    }
    let others = graph.factors.len() - problem.observations.len();
    remarks.lost(others, "factors of other kinds than points are left out: BAL has none");
    remarks.lost(graph.lines.len(), "lines are left out: BAL has none");
    let fixed = graph.poses.iter().filter(|row| row.fixed).count();
    remarks.said(fixed, "fixed poses are free in BAL: it has no gauge");
    Ok((problem, remarks.into_vec()))
}

/// The removed distortion of a camera where BAL can say it, otherwise none.
fn radial(camera: &Camera) -> [f64; 2] {
    match &camera.removed_distortion {
        Some(removed) if removed.model == registry::BROWN_CONRADY => match removed.coefficients.as_slice() {
            [k1, k2, 0.0, 0.0, 0.0] if k1.is_finite() && k2.is_finite() => [*k1, *k2],
            _ => [0.0; 2],
        },
        _ => [0.0; 2],
    }
}
