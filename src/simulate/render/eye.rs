//! A camera at a pose, as a source of rays.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::PinholeCamera;
use crate::simulate::Error;
use crate::structure::{Camera, PoseRow, registry};

/// A camera at a pose, from which rays go through pixels.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    camera: PinholeCamera,
    /// Image position of the middle of the pixel in column 0 and row 0, on either axis, pixels.
    origin_px: f64,
    rotation: Matrix3<f64>,
    center: Point3<f64>,
}

impl Eye {
    /// The eye of a camera at a pose.
    ///
    /// The value of column i, row j belongs to the image position (i, j) where pixels are counted from their
    /// centres, and to (i + 0.5, j + 0.5) where they are counted from their corners.
    ///
    /// # Errors
    /// [`Error::Geometry`] for numbers that are no pose.
    pub fn new(camera: &Camera, world_from_camera: &PoseRow) -> Result<Self, Error> {
        let pose = world_from_camera
            .pose()
            .map_err(|source| Error::Geometry { place: "pose of a frame".to_owned(), source })?;
        Ok(Self {
            camera: camera.projection(),
            origin_px: if camera.pixel_origin == registry::PIXEL_CORNER { 0.5 } else { 0.0 },
            rotation: pose.rotation_matrix(),
            center: pose.translation().into(),
        })
    }

    /// Where rays begin, `world`, metres.
    #[must_use]
    pub const fn center(&self) -> Point3<f64> {
        self.center
    }

    /// Columns and rows of the image, pixels.
    #[must_use]
    pub const fn size(&self) -> (u32, u32) {
        (self.camera.width, self.camera.height)
    }

    /// The direction through a place in the image, in `world`, as long as one metre of depth (z).
    ///
    /// * `column`, `row` — whole at the middle of a pixel.
    #[must_use]
    pub fn direction(&self, column: f64, row: f64) -> Vector3<f64> {
        let PinholeCamera { fx, fy, cx, cy, .. } = self.camera;
        let (u, v) = (column + self.origin_px, row + self.origin_px);
        self.rotation * Vector3::new((u - cx) / fx, (v - cy) / fy, 1.0)
    }

    /// Size of a pixel at a depth of one metre, metres.
    #[must_use]
    pub fn pixel_m(&self) -> f64 {
        1.0 / self.camera.fx.abs().min(self.camera.fy.abs())
    }
}
