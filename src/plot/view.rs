//! From where a scene is looked at.

use nalgebra::Vector3;

use super::error::Error;
use crate::structure::{Camera, Frame, registry};

/// Direction from which a scene is looked at, with parallel rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewFrom {
    /// Angle about the upward axis, degrees.
    pub azimuth_degrees: f64,
    /// Angle over the horizon, degrees; 90 looks straight down.
    pub elevation_degrees: f64,
}

impl ViewFrom {
    /// From above.
    pub const TOP: Self = Self { azimuth_degrees: -90.0, elevation_degrees: 90.0 };
    /// From the side.
    pub const SIDE: Self = Self { azimuth_degrees: -90.0, elevation_degrees: 0.0 };
    /// From above at an angle.
    pub const OBLIQUE: Self = Self { azimuth_degrees: -60.0, elevation_degrees: 35.0 };
}

/// The plane of the picture: right and up, in `world`.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    pub(super) right: Vector3<f64>,
    pub(super) up: Vector3<f64>,
}

impl Plane {
    /// The plane that is seen from somewhere.
    ///
    /// * `upward` — a unit vector of `world` that points up; see [`upward`].
    ///
    /// # Errors
    /// [`Error::View`] for angles that are none.
    pub fn new(view: ViewFrom, upward: Vector3<f64>) -> Result<Self, Error> {
        let ViewFrom { azimuth_degrees, elevation_degrees } = view;
        if !(azimuth_degrees.is_finite() && elevation_degrees.abs() <= 90.0) {
            return Err(Error::View { azimuth_degrees, elevation_degrees });
        }
        // Two horizontal axes that turn to the third, upward one.
        let first = if upward.z.abs() > 0.5 { Vector3::x() } else { Vector3::z() };
        let second = upward.cross(&first);
        let (azimuth, elevation) = (azimuth_degrees.to_radians(), elevation_degrees.to_radians());
        let outward = first * libm::cos(azimuth) + second * libm::sin(azimuth);
        let right = second * libm::cos(azimuth) - first * libm::sin(azimuth);
        let up = upward * libm::cos(elevation) - outward * libm::sin(elevation);
        Ok(Self { right, up })
    }

    /// Where a place is in the picture: to the right and up, metres; `None` for one that is not finite.
    #[must_use]
    pub fn place(&self, place: Vector3<f64>) -> Option<[f64; 2]> {
        let flat = [self.right.dot(&place), self.up.dot(&place)];
        flat.iter().all(|coordinate| coordinate.is_finite()).then_some(flat)
    }

    /// What is to the right and what is up: an axis of `world`, as `x` or `−z`, where there is one along it.
    #[must_use]
    pub fn names(&self) -> [String; 2] {
        let named = |way: &Vector3<f64>, otherwise: &str| {
            let axis = way.iamax();
            // Cosines of right angles are zero to rounding.
            if way[axis].abs() < 1.0 - 1e-9 {
                return otherwise.to_owned();
            }
            format!("{}{}", if way[axis] < 0.0 { "−" } else { "" }, ["x", "y", "z"][axis])
        };
        [named(&self.right, "right"), named(&self.up, "up")]
    }
}

/// The axis of `world` that points up: the one that the cameras' upward directions are nearest to; z without poses.
#[must_use]
pub fn upward(cameras: &[Camera], frames: &[Frame]) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for frame in frames {
        let Some(Ok(pose)) = frame.world_from_camera().map(|pose| pose.pose()) else { continue };
        let camera = cameras.iter().find(|camera| camera.camera_id == frame.camera_id);
        let y_is_up = camera.is_some_and(|camera| camera.axes == registry::RIGHT_UP_FORWARD);
        sum += pose.transform_vector(&if y_is_up { Vector3::y() } else { -Vector3::y() });
    }
    let axis = sum.iamax();
    if sum[axis].abs() > 1e-9 { Vector3::ith(axis, sum[axis].signum()) } else { Vector3::z() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{CameraId, FrameId, PoseRow};

    fn near(found: Vector3<f64>, expected: Vector3<f64>) {
        // Cosines of right angles are zero to rounding.
        assert!((found - expected).norm() < 1e-15, "{found}");
    }

    #[test]
    fn from_above_the_world_lies_as_on_a_map() {
        let plane = Plane::new(ViewFrom::TOP, Vector3::z()).unwrap();
        near(plane.right, Vector3::x());
        near(plane.up, Vector3::y());
        assert_eq!(plane.names(), ["x", "y"]);
        let plane = Plane::new(ViewFrom::SIDE, Vector3::z()).unwrap();
        near(plane.up, Vector3::z());
        assert_eq!(Plane::new(ViewFrom::TOP, -Vector3::y()).unwrap().names(), ["z", "−x"]);
        assert_eq!(Plane::new(ViewFrom::OBLIQUE, Vector3::z()).unwrap().names(), ["right", "up"]);
    }

    #[test]
    fn right_and_up_are_a_unit_square_whichever_way_is_up() {
        for upward in [Vector3::x(), -Vector3::y(), Vector3::z(), -Vector3::z()] {
            let plane = Plane::new(ViewFrom::OBLIQUE, upward).unwrap();
            near(
                Vector3::new(plane.right.norm(), plane.up.norm(), plane.right.dot(&plane.up)),
                Vector3::new(1.0, 1.0, 0.0),
            );
            assert!(plane.up.dot(&upward) > 0.5 && plane.right.dot(&upward).abs() < 1e-15);
        }
        assert!(
            Plane::new(ViewFrom { azimuth_degrees: f64::NAN, elevation_degrees: 0.0 }, Vector3::z()).is_err()
        );
        assert!(
            Plane::new(ViewFrom { azimuth_degrees: 0.0, elevation_degrees: 91.0 }, Vector3::z()).is_err()
        );
    }

    #[test]
    fn up_is_where_the_cameras_heads_are() {
        // Turned by a quarter about x: the camera's y is the world's z, and its head points along −z.
        let half = 0.5_f64.sqrt();
        let pose = PoseRow { translation: [0.0; 3], rotation_xyzw: [half, 0.0, 0.0, half] };
        let frame = Frame::new(FrameId(0), 0, CameraId(0), Some(pose));
        near(upward(&[], &[frame]), -Vector3::z());
        near(upward(&[], &[]), Vector3::z());
    }
}
