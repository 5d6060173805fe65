//! ICL-NUIM: the version that is read like TUM RGB-D, and the one that its ray tracer wrote.

use std::fmt::Write;
use std::path::PathBuf;

use nalgebra::Vector3;

use super::tum::{DEPTH_PER_METRE, numbers};
use super::{Dataset, Posed, Shot, files};
use crate::simulate::Error;
use crate::structure::Camera;

/// The layout of ICL-NUIM's PNG version (Handa et al. 2014).
///
/// Pictures and poses are numbered by the frame's id: `rgb/N.png`, `depth/N.png`, in `associations.txt` the
/// depth map first, and `NAME.gt.freiburg` with every frame of the sequence. Y of the camera points up in the
/// image: the poses go with the dataset's negative `fy`, and are `world_from_camera` with it. The
/// benchmark's own files begin their poses with number 1; here 0 has one as well.
pub(super) struct Icl {
    folder: PathBuf,
    name: String,
    associations: String,
}

impl Icl {
    pub(super) fn new(folder: PathBuf, name: &str) -> Self {
        Self { folder, name: name.to_owned(), associations: String::new() }
    }
}

impl Dataset for Icl {
    fn begin(&mut self, camera: &Camera, _: &[Posed<'_>]) -> Result<(), Error> {
        image_up(camera)?;
        for name in ["rgb", "depth"] {
            files::folder(&self.folder.join(name))?;
        }
        Ok(())
    }

    fn frame(&mut self, posed: &Posed<'_>, shot: &Shot) -> Result<(), Error> {
        let id = posed.frame.frame_id.0;
        let [depth_name, name] = ["depth", "rgb"].map(|kind| format!("{kind}/{id}.png"));
        let (picture, depth) = rayon::join(
            || files::picture(&self.folder.join(&name), shot),
            || files::depth_picture(&self.folder.join(&depth_name), shot, DEPTH_PER_METRE),
        );
        picture.and(depth)?;
        let _ = writeln!(self.associations, "{id} {depth_name} {id} {name}");
        Ok(())
    }

    fn finish(&mut self, all: &[Posed<'_>]) -> Result<(), Error> {
        files::text(&self.folder.join("associations.txt"), &self.associations)?;
        let mut truth = String::new();
        for posed in all {
            let _ = writeln!(truth, "{} {}", posed.frame.frame_id.0, numbers(&posed.pose));
        }
        files::text(&self.folder.join(format!("{}.gt.freiburg", self.name)), &truth)
    }
}

/// The layout of ICL-NUIM as its ray tracer wrote it.
///
/// `scene_00_NNNN.png`, `.depth` and `.txt`: the distance along the ray of each pixel, metres, row by row in
/// one line (0 where there is no surface), and the camera as its vectors in the ray tracer's words. The
/// principal point is the middle of the image, for those words have no other.
pub(super) struct IclOriginal {
    folder: PathBuf,
    camera: Option<Camera>,
}

impl IclOriginal {
    pub(super) const fn new(folder: PathBuf) -> Self {
        Self { folder, camera: None }
    }
}

impl Dataset for IclOriginal {
    fn begin(&mut self, camera: &Camera, _: &[Posed<'_>]) -> Result<(), Error> {
        image_up(camera)?;
        let middle = [camera.width, camera.height].map(|size| (f64::from(size) - 1.0) / 2.0);
        if [camera.cx, camera.cy] != middle {
            let expected = format!("the middle of the image, {} and {} px", middle[0], middle[1]);
            let found = format!("{} and {} px", camera.cx, camera.cy);
            return Err(Error::value("camera.cx, camera.cy", expected, found));
        }
        self.camera = Some(camera.clone());
        Ok(())
    }

    fn frame(&mut self, posed: &Posed<'_>, shot: &Shot) -> Result<(), Error> {
        let Some(camera) = &self.camera else { return Ok(()) };
        let place =
            |ending: &str| self.folder.join(format!("scene_00_{:04}.{ending}", posed.frame.frame_id.0));
        let (picture, depth) = rayon::join(
            || files::picture(&place("png"), shot),
            || files::text(&place("depth"), &ranges(camera, shot)),
        );
        picture.and(depth)?;
        files::text(&place("txt"), &words(camera, posed)?)
    }

    fn finish(&mut self, _: &[Posed<'_>]) -> Result<(), Error> {
        Ok(())
    }
}

/// Distances along the rays of pixels, from depths.
fn ranges(camera: &Camera, shot: &Shot) -> String {
    let mut text = String::new();
    for (index, depth) in shot.depth_m.iter().enumerate() {
        let (column, row) = (index % shot.width as usize, index / shot.width as usize);
        let x = (column as f64 - camera.cx) / camera.fx;
        let y = (row as f64 - camera.cy) / camera.fy;
        let range = if depth.is_finite() { depth * (x * x + y * y + 1.0).sqrt() } else { 0.0 };
        let _ = write!(text, "{range:.6} ");
    }
    text.push('\n');
    text
}

/// The camera in the ray tracer's words.
fn words(camera: &Camera, posed: &Posed<'_>) -> Result<String, Error> {
    let pose = posed
        .pose
        .pose()
        .map_err(|source| Error::Geometry { place: "pose of a frame".to_owned(), source })?;
    let rotation = pose.rotation_matrix();
    let list = |vector: Vector3<f64>| format!("[{:?}, {:?}, {:?}]'", vector.x, vector.y, vector.z);
    let direction: Vector3<f64> = rotation.column(2).into();
    let right: Vector3<f64> = rotation.column(0) * (f64::from(camera.width) / camera.fx);
    let up: Vector3<f64> = rotation.column(1) * (f64::from(camera.height) / -camera.fy);
    let [position, direction, up, right] = [pose.translation(), direction, up, right].map(list);
    let degrees = 2.0 * libm::atan(f64::from(camera.width) / 2.0 / camera.fx).to_degrees();
    Ok(format!(
        "cam_pos      = {position};\ncam_dir      = {direction};\ncam_up       = {up};\ncam_lookat   = {direction};\n\
         cam_sky      = {up};\ncam_right    = {right};\ncam_fpoint   = [0, 0, 10]';\ncam_angle    = {degrees:?};\n"
    ))
}

/// Refuses a camera whose y points down in the image, which the layout does not know.
fn image_up(camera: &Camera) -> Result<(), Error> {
    if camera.fy > 0.0 {
        let expected = "a negative focal length, for y of ICL-NUIM's camera points up (preset icl-nuim)";
        return Err(Error::value("camera.fy", expected, camera.fy));
    }
    Ok(())
}
