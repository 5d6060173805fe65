//! TartanAir, first version: numbered files, depth as arrays, poses north-east-down.

use std::fmt::Write;
use std::path::PathBuf;

use super::tum::image_down;
use super::{Dataset, Posed, Shot, files};
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::{Camera, PoseRow};

/// What stands in a depth map where there is no surface, metres: the largest 16-bit floating point number,
/// which the dataset's renderer leaves in the sky.
const SKY_M: f32 = 65504.0;
/// The `world` of a scene, whose z points up, in north-east-down: half a turn about x, `(x, y, z) ↦ (x, −y, −z)`.
const NED_FROM_WORLD: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
/// The dataset's camera (x forward, y right, z down) in `camera` (x right, y down, z forward).
const CAMERA_FROM_BODY: [f64; 4] = [-0.5, -0.5, -0.5, 0.5];

/// The layout of TartanAir V1 (Wang et al. 2020), the left camera of it.
///
/// Files are numbered from 0 in the order of rendering, and line k of `pose_left.txt` belongs to number k.
/// A line is `tx ty tz qx qy qz qw`, the camera in a north-east-down world, its x forward and z down.
pub(super) struct TartanAir {
    folder: PathBuf,
    poses: String,
    count: usize,
}

impl TartanAir {
    pub(super) const fn new(folder: PathBuf) -> Self {
        Self { folder, poses: String::new(), count: 0 }
    }
}

impl Dataset for TartanAir {
    fn begin(&mut self, camera: &Camera, _: &[Posed<'_>]) -> Result<(), Error> {
        image_down(camera, "TartanAir")?;
        for name in ["image_left", "depth_left"] {
            files::folder(&self.folder.join(name))?;
        }
        Ok(())
    }

    fn frame(&mut self, posed: &Posed<'_>, shot: &Shot) -> Result<(), Error> {
        let number = format!("{:06}", self.count);
        let (picture, depth) = rayon::join(
            || files::picture(&self.folder.join(format!("image_left/{number}_left.png")), shot),
            || {
                let path = self.folder.join(format!("depth_left/{number}_left_depth.npy"));
                files::depth_array(&path, shot, SKY_M)
            },
        );
        picture.and(depth)?;
        let ned_from_body = ned_from_body(&posed.pose)?;
        let _ = writeln!(self.poses, "{}", ned_from_body.numbers().map(scientific).join(" "));
        self.count += 1;
        Ok(())
    }

    fn finish(&mut self, _: &[Posed<'_>]) -> Result<(), Error> {
        files::text(&self.folder.join("pose_left.txt"), &self.poses)
    }
}

/// The pose as the dataset says it.
pub(super) fn ned_from_body(world_from_camera: &PoseRow) -> Result<PoseRow, Error> {
    let pose = || {
        let turn = |rotation_xyzw| Pose::from_components([0.0; 3], rotation_xyzw);
        let world_from_camera = world_from_camera.pose()?;
        Ok(turn(NED_FROM_WORLD)? * world_from_camera * turn(CAMERA_FROM_BODY)?)
    };
    pose()
        .map(|pose| PoseRow::from(&pose))
        .map_err(|source| Error::Geometry { place: "pose of a frame".to_owned(), source })
}

/// A number as NumPy's `savetxt` writes it: `-1.284026908874511719e+01`.
fn scientific(number: f64) -> String {
    let text = format!("{number:.18e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let (sign, exponent) = exponent.strip_prefix('-').map_or(('+', exponent), |exponent| ('-', exponent));
    format!("{digits}e{sign}{exponent:0>2}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn numbers_look_like_those_of_the_dataset() {
        assert_eq!(scientific(-12.840_269_088_745_117), "-1.284026908874511719e+01");
        assert_eq!(scientific(0.0), "0.000000000000000000e+00");
        assert_eq!(scientific(1e-5), "1.000000000000000082e-05");
    }

    #[test]
    fn a_camera_that_looks_north_and_level_has_no_rotation() {
        // x of the camera to −y of the world, y down, z along x: north.
        let world_from_camera =
            PoseRow { translation: [1.0, 2.0, 3.0], rotation_xyzw: [-0.5, 0.5, -0.5, 0.5] };
        let pose = world_from_camera.pose().unwrap();
        assert!((pose.transform_vector(&Vector3::z()) - Vector3::x()).norm() < 1e-15);
        assert!((pose.transform_vector(&Vector3::y()) + Vector3::z()).norm() < 1e-15);
        let found = ned_from_body(&world_from_camera).unwrap();
        assert_eq!(found.translation, [1.0, -2.0, -3.0]);
        let ahead = found.pose().unwrap() * Point3::new(5.0, 0.0, 0.0);
        assert!((ahead - Point3::new(6.0, -2.0, -3.0)).norm() < 1e-15, "{ahead}");
        assert!((found.rotation_xyzw[3].abs() - 1.0).abs() < 1e-15, "{found:?}");
    }
}
