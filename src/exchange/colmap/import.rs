//! From a COLMAP model to a sequence.

use std::collections::{BTreeMap, BTreeSet};

use super::model::{ColmapCamera, ColmapModel};
use crate::exchange::Error;
use crate::exchange::imported::{Draft, ImportNames, Imported};
use crate::geometry::PinholeCamera;
use crate::structure::{Camera, CameraId, FrameId, PointId, PoseRow, registry};

/// A COLMAP model as a sequence: a frame for each image, a point for each point, a factor for each observation.
///
/// Ids are those of the model, and pixels keep their digits: our `pixel-corner` is COLMAP's origin. Names of images,
/// colours, and points that were matched with none have no place here; remarks count them. Frames are a second apart.
///
/// # Errors
/// [`Error::Unfit`] for a camera model other than `PINHOLE` and `SIMPLE_PINHOLE` (`colmap image_undistorter` makes one),
/// an id that is given twice, an image of a camera that is not there, an observation of a point that is not there, a
/// track that its images do not confirm, or a pose that is no rigid transform.
pub fn from_colmap(model: &ColmapModel, names: &ImportNames) -> Result<Imported, Error> {
    let mut draft = Draft { graph: names.graph.clone(), ..Draft::default() };
    let mut camera_ids = BTreeSet::new();
    for camera in &model.cameras {
        let what = format!("cameras.txt: camera {}", camera.id);
        if !camera_ids.insert(camera.id) {
            return Err(Error::unfit(what, "one of this id", "two"));
        }
        draft.cameras.push(pinhole(camera, &what)?);
    }
    draft.cameras.sort_by_key(|camera| camera.camera_id);
    let point_ids: BTreeSet<i64> = model.points.iter().map(|point| point.id).collect();
    if point_ids.len() < model.points.len() {
        return Err(Error::unfit("points3D.txt", "points of different ids", "some twice"));
    }
    let mut images = BTreeMap::new();
    for image in &model.images {
        let what = || format!("images.txt: image {}", image.id);
        if !camera_ids.contains(&image.camera) {
            return Err(Error::unfit(what(), format!("camera {}", image.camera), "none"));
        }
        if images.insert(image.id, image).is_some() {
            return Err(Error::unfit(what(), "one of this id", "two"));
        }
        let [w, x, y, z] = image.rotation_wxyz;
        let stored = PoseRow { translation: image.translation, rotation_xyzw: [x, y, z, w] };
        let camera_from_world =
            stored.pose().map_err(|error| Error::unfit(what(), "a rigid transform", error))?;
        draft.camera_of_frame.insert(FrameId(image.id), CameraId(image.camera));
        draft.add_pose(image.id, false, PoseRow::from(&camera_from_world.inverse()))?;
    }
    for point in &model.points {
        for (image, place) in &point.track {
            let seen = images.get(image).and_then(|image| image.points.get(*place));
            if seen.is_none_or(|seen| seen.point != Some(point.id)) {
                let what = format!("points3D.txt: point {}", point.id);
                return Err(Error::unfit(
                    what,
                    format!("itself in image {image} at place {place}"),
                    "another",
                ));
            }
        }
        draft.add_point(point.id, point.position);
    }
    let mut unmatched = 0;
    for (id, image) in &images {
        for seen in &image.points {
            let Some(point) = seen.point else {
                unmatched += 1;
                continue;
            };
            if !point_ids.contains(&point) {
                let what = format!("images.txt: image {id}");
                return Err(Error::unfit(what, format!("point {point} in points3D.txt"), "none"));
            }
            draft.add_view(FrameId(*id), PointId(point), seen.pixel.to_vec(), None);
        }
    }
    draft.remarks.lost(unmatched, "positions in images that show no point are left out");
    Ok(draft.finish("colmap", names))
}

fn pinhole(camera: &ColmapCamera, what: &str) -> Result<Camera, Error> {
    let (fx, fy, cx, cy) = match (camera.model.as_str(), camera.parameters.as_slice()) {
        ("PINHOLE", [fx, fy, cx, cy]) => (*fx, *fy, *cx, *cy),
        ("SIMPLE_PINHOLE", [f, cx, cy]) => (*f, *f, *cx, *cy),
        (model @ ("PINHOLE" | "SIMPLE_PINHOLE"), numbers) => {
            let count = if model == "PINHOLE" { 4 } else { 3 };
            return Err(Error::unfit(what, format!("{count} numbers for {model}"), numbers.len()));
        }
        (model, _) => {
            let expected = "PINHOLE or SIMPLE_PINHOLE, such as `colmap image_undistorter` makes";
            return Err(Error::unfit(what, expected, model));
        }
    };
    if fx <= 0.0 || fy <= 0.0 {
        return Err(Error::unfit(what, "focal lengths above 0", format!("{fx:?} and {fy:?}")));
    }
    let pinhole = PinholeCamera { fx, fy, cx, cy, width: camera.width, height: camera.height };
    Ok(Camera::pinhole(CameraId(camera.id), &pinhole, registry::PIXEL_CORNER))
}
