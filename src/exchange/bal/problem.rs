//! A problem of Bundle Adjustment in the Large, with the numbers of its file.

use nalgebra::{Point3, Vector6};

use super::radial::Radial;
use crate::geometry::Pose;

/// A camera of BAL; every image has one of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BalCamera {
    /// Rotation vector of `R`, radians.
    pub rotation: [f64; 3],
    /// Translation `t`.
    pub translation: [f64; 3],
    /// Focal length, pixels.
    pub focal: f64,
    /// Radial coefficients k1, k2.
    pub radial: [f64; 2],
}

/// A point seen in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BalObservation {
    /// Place of the camera.
    pub camera: usize,
    /// Place of the point.
    pub point: usize,
    /// Pixel, x to the right and y up from the middle of the image.
    pub pixel: [f64; 2],
}

/// A problem of BAL, with every digit of its file; also the way to adjust it as it was meant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BalProblem {
    /// Cameras.
    pub cameras: Vec<BalCamera>,
    /// Points in the world.
    pub points: Vec<[f64; 3]>,
    /// Observations.
    pub observations: Vec<BalObservation>,
}

impl BalCamera {
    /// Its numbers in the order of a file: rotation vector, translation, focal length, k1, k2.
    #[must_use]
    pub fn numbers(&self) -> [f64; 9] {
        let ([a, b, c], [x, y, z], [k1, k2]) = (self.rotation, self.translation, self.radial);
        [a, b, c, x, y, z, self.focal, k1, k2]
    }

    /// A camera from its numbers in the order of a file.
    #[must_use]
    pub fn from_numbers([a, b, c, x, y, z, focal, k1, k2]: [f64; 9]) -> Self {
        Self { rotation: [a, b, c], translation: [x, y, z], focal, radial: [k1, k2] }
    }

    /// `x ↦ R x + t`: the pose of the world in the camera, whose z points backwards and y up.
    #[must_use]
    pub fn camera_from_world(&self) -> Pose {
        let [x, y, z] = self.rotation;
        let turn = Pose::exp(&Vector6::new(x, y, z, 0.0, 0.0, 0.0));
        Pose::new(turn.rotation(), self.translation.into())
    }

    /// `f r(p) p`: where a point of the world appears, pixels.
    ///
    /// `None` for a point in the plane of the camera, or a pixel that is not finite. A point behind the camera has an
    /// image too: BAL does not ask.
    #[must_use]
    pub fn project(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let seen = self.camera_from_world() * Point3::from(point);
        let flat = [-seen.x / seen.z, -seen.y / seen.z];
        let pixel = Radial(self.radial).distort(flat).map(|part| self.focal * part);
        pixel.iter().all(|part| part.is_finite()).then_some(pixel)
    }
}

impl BalProblem {
    /// Projected minus measured pixel of an observation; `None` where there is no image or no such camera or point.
    #[must_use]
    pub fn residual(&self, observation: &BalObservation) -> Option<[f64; 2]> {
        let camera = self.cameras.get(observation.camera)?;
        let [u, v] = camera.project(*self.points.get(observation.point)?)?;
        Some([u - observation.pixel[0], v - observation.pixel[1]])
    }

    /// Half the sum of squared residuals, px², over the observations that have one.
    #[must_use]
    pub fn cost(&self) -> f64 {
        let squares = self.observations.iter().filter_map(|seen| self.residual(seen));
        squares.map(|[u, v]| 0.5 * (u * u + v * v)).sum()
    }
}
