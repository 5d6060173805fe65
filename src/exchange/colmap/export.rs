//! From a factor graph to a COLMAP model.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::model::{ColmapCamera, ColmapImage, ColmapModel, ColmapPoint, ColmapPoint2};
use crate::exchange::remark::Remarks;
use crate::exchange::{Error, Remark};
use crate::structure::{Camera, FactorGraph, PoseRow, registry};

/// Colour of all points, which have none.
const GREY: [u8; 3] = [128; 3];
/// The largest id of a camera or an image; COLMAP holds them in 32 bits, of which the last means none.
const LARGEST_ID: i64 = (1 << 32) - 2;

/// The points of a factor graph as a COLMAP model: ids stay, images are named `frame_000012.png`.
///
/// Pixels and principal points of `pixel-center` cameras move by half a pixel, to COLMAP's origin; those of
/// `pixel-corner` are COLMAP's already.
///
/// COLMAP has no camera with `fy` below 0 (ICL-NUIM: y up in the camera). A graph of such cameras is mirrored as a
/// whole: `fy` becomes positive, y of every camera and y of the world are negated. So `R' = D R D`, `t' = D t`, `X' = D X`
/// with `D = diag(1, −1, 1)`; every pixel stays where it is, and so does every residual. The model is then the mirror image
/// of the sequence, which a remark says. A graph with cameras of both kinds cannot be mirrored and is refused.
///
/// Depth, lines, information and fixed poses have no place in a model; remarks count them.
///
/// # Errors
/// [`Error::Unfit`] for a graph without a point that is seen, a pose that is no rigid transform, a frame without camera,
/// cameras with `fy` of both signs, a factor whose vertices are not there or that lacks its numbers, or an id of
/// a camera or a frame that 32 bits do not hold.
pub fn to_colmap(graph: &FactorGraph) -> Result<(ColmapModel, Vec<Remark>), Error> {
    let mut remarks = Remarks::default();
    let mut model = ColmapModel::default();
    let used: BTreeSet<_> =
        graph.poses.iter().filter_map(|row| graph.camera_of_frame.get(&row.frame_id)).copied().collect();
    let cameras: BTreeMap<_, &Camera> = graph
        .cameras
        .iter()
        .filter(|camera| used.contains(&camera.camera_id))
        .map(|camera| (camera.camera_id, camera))
        .collect();
    let up = cameras.values().filter(|camera| camera.fy < 0.0).count();
    if up != 0 && up != cameras.len() {
        let expected = "cameras with fy of one sign, for a model with y up must be mirrored as a whole";
        let found = format!("{up} below 0 of {}", cameras.len());
        return Err(Error::unfit(format!("graph `{}`", graph.name), expected, found));
    }
    let mirror = up != 0;
    // −y rather than 0 − y, and +0 stays: nothing is written as −0.0 without need.
    let flip = |y: f64| if mirror && y != 0.0 { -y } else { y };
    for camera in cameras.values() {
        let what = camera.camera_id.to_string();
        let id = checked_id(camera.camera_id.0, &what)?;
        if ![camera.fx, camera.fy, camera.cx, camera.cy].iter().all(|number| number.is_finite()) {
            return Err(Error::unfit(what, "finite intrinsics", "others"));
        }
        let half = to_corner(camera);
        model.cameras.push(ColmapCamera {
            id,
            model: "PINHOLE".to_owned(),
            width: camera.width,
            height: camera.height,
            parameters: vec![camera.fx, camera.fy.abs(), camera.cx + half, camera.cy + half],
        });
    }
    let mut image_places = BTreeMap::new();
    let mut poses = Vec::new();
    for row in &graph.poses {
        let what = || format!("{} of graph `{}`", row.frame_id, graph.name);
        let id = checked_id(row.frame_id.0, &what())?;
        let camera = graph.camera_of_frame.get(&row.frame_id).and_then(|id| cameras.get(id).copied());
        let camera = camera.ok_or_else(|| Error::unfit(what(), "a camera", "none"))?;
        let world_from_camera = row
            .world_from_camera()
            .pose()
            .map_err(|error| Error::unfit(what(), "a rigid transform", error))?;
        let camera_from_world = world_from_camera.inverse();
        let PoseRow { translation: [tx, ty, tz], rotation_xyzw: [x, y, z, w] } =
            PoseRow::from(&camera_from_world);
        image_places.insert(row.frame_id, model.images.len());
        poses.push((camera_from_world, camera));
        // A turn seen in a mirror across y turns the other way about x and z.
        model.images.push(ColmapImage {
            id,
            rotation_wxyz: [w, flip(x), y, flip(z)],
            translation: [tx, flip(ty), tz],
            camera: camera.camera_id.0,
            name: format!("frame_{id:06}.png"),
            points: Vec::new(),
        });
    }
    let mut point_places = BTreeMap::new();
    for row in &graph.points {
        let what = || format!("{} of graph `{}`", row.point_id, graph.name);
        if row.point_id.0 < 0 || ![row.x, row.y, row.z].iter().all(|number| number.is_finite()) {
            return Err(Error::unfit(what(), "an id of at least 0 and finite numbers", "others"));
        }
        point_places.insert(row.point_id, model.points.len());
        let (id, position) = (row.point_id.0, [row.x, flip(row.y), row.z]);
        model.points.push(ColmapPoint { id, position, colour: GREY, error: -1.0, track: Vec::new() });
    }
    // Sum and number of reprojection errors by point, for the ERROR of the file.
    let mut errors = vec![(0.0, 0_u32); model.points.len()];
    let mut seen = 0;
    for factor in graph.factors.iter().filter(|factor| factor.kind == registry::POINT_REPROJECTION) {
        let what = || format!("factor {} of graph `{}`", factor.factor_id, graph.name);
        let image = factor.frame_id.and_then(|frame| image_places.get(&frame).copied());
        let point = factor.point_id.and_then(|point| point_places.get(&point).copied());
        let Some((image, place)) = image.zip(point) else {
            return Err(Error::unfit(what(), "a pose and a point of the graph", "none"));
        };
        let [u, v, rest @ ..] = factor.measurement.as_slice() else {
            return Err(Error::unfit(what(), "2 or 3 numbers", factor.measurement.len()));
        };
        if !(u.is_finite() && v.is_finite()) {
            return Err(Error::unfit(what(), "a finite pixel", format!("{u:?}, {v:?}")));
        }
        let (camera_from_world, camera) = poses[image];
        let row = &graph.points[place];
        let predicted = camera.projection().project(camera_from_world * Point3::new(row.x, row.y, row.z));
        if let Some(predicted) = predicted {
            let (du, dv) = (predicted.x - u, predicted.y - v);
            errors[place].0 += (du * du + dv * dv).sqrt();
            errors[place].1 += 1;
        }
        let half = to_corner(camera);
        let image = &mut model.images[image];
        let point = &mut model.points[place];
        point.track.push((image.id, image.points.len()));
        image.points.push(ColmapPoint2 { pixel: [u + half, v + half], point: Some(point.id) });
        seen += 1;
        remarks.lost(usize::from(!rest.is_empty()), "depths are left out: a model has pixels alone");
        remarks.lost(
            usize::from(factor.information.is_some()),
            "information matrices are left out: a model weighs all pixels alike",
        );
    }
    for (point, (sum, count)) in model.points.iter_mut().zip(errors) {
        if count > 0 {
            point.error = sum / f64::from(count);
        }
    }
    if seen == 0 {
        return Err(Error::unfit(format!("graph `{}`", graph.name), "points seen in frames", "none"));
    }
    remarks.lost(
        graph.factors.len() - seen,
        "factors of other kinds than points are left out: a model has none",
    );
    remarks.lost(graph.lines.len(), "lines are left out: a model has none");
    let fixed = graph.poses.iter().filter(|row| row.fixed).count();
    remarks.said(fixed, "fixed poses are free in a model: it has no gauge");
    let mirrored =
        "cameras had fy below 0: the model is mirrored, y of the world and of every camera negated";
    remarks.said(up, mirrored);
    Ok((model, remarks.into_vec()))
}

/// What leads from the pixels of a camera to COLMAP's.
fn to_corner(camera: &Camera) -> f64 {
    if camera.pixel_origin == registry::PIXEL_CORNER { 0.0 } else { 0.5 }
}

fn checked_id(id: i64, what: &str) -> Result<i64, Error> {
    if (0..=LARGEST_ID).contains(&id) {
        return Ok(id);
    }
    Err(Error::unfit(what, format!("an id of 0 to {LARGEST_ID}"), id))
}
