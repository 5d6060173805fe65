//! The world and the cameras as viewers expect them: right-handed, x right, y down, z forward.

use ::foxglove::messages::{Pose, Quaternion, Vector3};
use nalgebra::Point3;

use crate::structure::{Camera, Manifest, PoseRow, registry};

/// The spaces in which a sequence is shown.
///
/// Cameras with `right-down-forward` axes are shown as they are. For `right-up-forward` (ICL-NUIM) no turn
/// of the camera gives what viewers expect: right, up, forward is a left-handed triple, so the world of
/// such a sequence is left-handed too. Both are therefore mirrored for viewers, the camera in y and the
/// world in x: `Sw · world_from_camera · Sc`, `Sw = diag(−1, 1, 1)`, `Sc = diag(1, −1, 1)`. That is a proper
/// pose again, `fy` becomes positive, every landmark keeps its pixel, and what was up (y or z) stays up.
/// The world's frame then has another name, so that nobody takes its numbers for those of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::format) struct ViewerSpace {
    mirrored: bool,
}

impl ViewerSpace {
    /// The spaces for a sequence: mirrored if all of its cameras ask for it. One mirror must do for the
    /// whole world, so a sequence with both kinds is shown as it is, negative `fy` included.
    pub(in crate::format) fn of(manifest: &Manifest) -> Self {
        let cameras = &manifest.cameras;
        Self { mirrored: !cameras.is_empty() && cameras.iter().all(|camera| camera.fy < 0.0) }
    }

    /// Name of the world's coordinate frame.
    pub(in crate::format) const fn world(self) -> &'static str {
        if self.mirrored { "world_with_x_negated" } else { "world" }
    }

    /// A point of the world, metres.
    pub(in crate::format) fn point(self, point: Point3<f64>) -> [f64; 3] {
        [if self.mirrored { -point.x } else { point.x }, point.y, point.z]
    }

    /// Position, and rotation as x y z w, of a camera in the world; `None` when the stored ones are no pose.
    pub(in crate::format) fn position_and_rotation(
        self,
        world_from_camera: &PoseRow,
    ) -> Option<([f64; 3], [f64; 4])> {
        let (position, [x, y, z, w]) = world_from_camera.pose().ok()?.components();
        // Sw R Sc = Rx(π) R Rx(π)⁻¹ Rz(π), which only swaps the numbers of the quaternion.
        let rotation = if self.mirrored { [-y, -x, w, z] } else { [x, y, z, w] };
        Some((self.point(Point3::from(position)), rotation))
    }

    /// A pose of a camera in the world; `None` when the stored one is no pose.
    pub(in crate::format) fn pose(self, world_from_camera: &PoseRow) -> Option<Pose> {
        let ([x, y, z], [qx, qy, qz, qw]) = self.position_and_rotation(world_from_camera)?;
        Some(Pose {
            position: Some(Vector3 { x, y, z }),
            orientation: Some(Quaternion { x: qx, y: qy, z: qz, w: qw }),
        })
    }

    /// `fx, fy, cx, cy` of a camera, pixels from the corner of the image, see [`from_corner`].
    pub(in crate::format) fn intrinsics(self, camera: &Camera) -> [f64; 4] {
        let fy = if self.mirrored { -camera.fy } else { camera.fy };
        let [cx, cy] = from_corner(camera, [camera.cx, camera.cy]);
        [camera.fx, fy, cx, cy]
    }
}

/// A pixel position counted from the outer corner of the top-left pixel, as viewers draw it.
pub(in crate::format) fn from_corner(camera: &Camera, [u, v]: [f64; 2]) -> [f64; 2] {
    let shift = if camera.pixel_origin == registry::PIXEL_CENTER { 0.5 } else { 0.0 };
    [u + shift, v + shift]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PinholeCamera;
    use crate::structure::CameraId;
    use nalgebra::{UnitQuaternion, Vector3 as Vector};

    fn camera(fy: f64) -> Camera {
        let pinhole = PinholeCamera { fx: 481.2, fy, cx: 319.5, cy: 239.5, width: 640, height: 480 };
        Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CENTER)
    }

    #[test]
    fn a_landmark_keeps_its_pixel_in_the_mirrored_world() {
        let stored = camera(-480.0);
        let manifest = Manifest { cameras: vec![stored.clone()], ..Manifest::default() };
        let space = ViewerSpace::of(&manifest);
        assert_eq!(space.world(), "world_with_x_negated");
        let row = PoseRow { translation: [1.0, -2.0, 0.5], rotation_xyzw: [0.1, -0.7, 0.3, 0.2] };
        let world_from_camera = row.pose().unwrap();
        let shown = space.pose(&row).unwrap();
        let (at, turned) = (shown.position.unwrap(), shown.orientation.unwrap());
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            turned.w, turned.x, turned.y, turned.z,
        ));
        let [fx, fy, cx, cy] = space.intrinsics(&stored);
        assert!(fy > 0.0);
        for in_camera in [[0.3, -0.2, 2.0], [-1.0, 0.7, 5.0]] {
            let in_world = world_from_camera * Point3::from(in_camera);
            let stored_px = stored.projection().project(Point3::from(in_camera)).unwrap();
            let shown_point = Vector::from(space.point(in_world)) - Vector::new(at.x, at.y, at.z);
            let seen = rotation.inverse() * shown_point;
            let shown_px = [fx * seen.x / seen.z + cx, fy * seen.y / seen.z + cy];
            assert!((shown_px[0] - stored_px.x - 0.5).abs() < 1e-9, "{shown_px:?} {stored_px}");
            assert!((shown_px[1] - stored_px.y - 0.5).abs() < 1e-9, "{shown_px:?} {stored_px}");
        }
    }

    #[test]
    fn one_upright_camera_keeps_the_world_as_it_is() {
        let manifest = Manifest { cameras: vec![camera(-480.0), camera(480.0)], ..Manifest::default() };
        let space = ViewerSpace::of(&manifest);
        assert_eq!(space.world(), "world");
        assert_eq!(space.point(Point3::new(1.0, 2.0, 3.0)), [1.0, 2.0, 3.0]);
    }
}
