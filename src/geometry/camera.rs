//! The pinhole camera.

use super::Error;
use nalgebra::{Matrix3, Point2, Point3, Vector3};

/// Nearer than this (metres, along the optical axis) nothing has an image.
pub(super) const NEAREST_Z: f64 = 1e-9;

/// A camera without distortion: `u = fx x/z + cx`, `v = fy y/z + cy`.
///
/// Pixels have their origin at the centre of the top-left pixel. `fy` may be negative, as it is for ICL-NUIM, whose camera has +y
/// image-up; every formula here holds for either sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PinholeCamera {
    /// Focal length along u, pixels; not zero.
    pub fx: f64,
    /// Focal length along v, pixels; not zero, negative where the camera's y points up in the image.
    pub fy: f64,
    /// Principal point, u, pixels.
    pub cx: f64,
    /// Principal point, v, pixels.
    pub cy: f64,
    /// Columns of the image, pixels.
    pub width: u32,
    /// Rows of the image, pixels.
    pub height: u32,
}

impl PinholeCamera {
    /// A camera whose numbers were looked at.
    ///
    /// * `fx`, `fy`, `cx`, `cy` — pixels; `width`, `height` — pixels.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a number that is NaN or infinite, [`Error::OutOfRange`] for a focal length of zero or an image
    /// without pixels.
    pub fn new(fx: f64, fy: f64, cx: f64, cy: f64, width: u32, height: u32) -> Result<Self, Error> {
        Error::check_finite("camera", &[fx, fy, cx, cy])?;
        for (what, found) in [("fx", fx), ("fy", fy)] {
            if found == 0.0 {
                return Err(Error::OutOfRange { what, expected: "a focal length that is not zero", found });
            }
        }
        for (what, found) in [("width", width), ("height", height)] {
            if found == 0 {
                return Err(Error::OutOfRange { what, expected: "at least one pixel", found: 0.0 });
            }
        }
        Ok(Self { fx, fy, cx, cy, width, height })
    }

    /// The image of a point, pixels, inside the image or not.
    ///
    /// * `point_in_camera` — metres.
    ///
    /// `None` when the point is not in front of the camera (z over 1e-9 m), or the pixel is not finite.
    #[must_use]
    pub fn project(&self, point_in_camera: Point3<f64>) -> Option<Point2<f64>> {
        let Point3 { coords: p } = point_in_camera;
        if p.z.is_nan() || p.z <= NEAREST_Z {
            return None;
        }
        let pixel = Point2::new(self.fx * (p.x / p.z) + self.cx, self.fy * (p.y / p.z) + self.cy);
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// The point seen at a pixel, in the camera, metres.
    ///
    /// * `depth_z` — its z in the camera (not its distance), metres.
    #[must_use]
    pub fn back_project(&self, pixel: Point2<f64>, depth_z: f64) -> Point3<f64> {
        Point3::from(self.normalised(pixel) * depth_z)
    }

    /// The direction in which a pixel looks, a unit vector in the camera.
    #[must_use]
    pub fn ray(&self, pixel: Point2<f64>) -> Vector3<f64> {
        self.normalised(pixel).normalize()
    }

    /// The direction in which a pixel looks, scaled to `z = 1`.
    pub(super) fn normalised(&self, pixel: Point2<f64>) -> Vector3<f64> {
        Vector3::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy, 1.0)
    }

    /// `K̃`, which takes the moment of a line in the camera to the coefficients of its image: `l = K̃ n`, `lᵀ (u, v, 1) = 0`.
    ///
    /// ```text
    ///      ⎡  fy       0      0   ⎤
    /// K̃ =  ⎢   0      fx      0   ⎥
    ///      ⎣ −fy cx  −fx cy  fx fy⎦
    /// ```
    ///
    /// The matrix of cofactors of `K`, so that `K̃ (a × b) = K a × K b` for focal lengths of either sign.
    #[must_use]
    pub fn line_matrix(&self) -> Matrix3<f64> {
        let Self { fx, fy, cx, cy, .. } = *self;
        Matrix3::new(fy, 0.0, 0.0, 0.0, fx, 0.0, -fy * cx, -fx * cy, fx * fy)
    }

    /// Whether a pixel lies in the image or at most `margin_px` outside it.
    ///
    /// Pixels are squares about their centres, so the image reaches from −0.5 to `width − 0.5`.
    #[must_use]
    pub fn contains(&self, pixel: Point2<f64>, margin_px: f64) -> bool {
        let low = -0.5 - margin_px;
        let inside =
            |coordinate: f64, size: u32| (low..=f64::from(size) - 0.5 + margin_px).contains(&coordinate);
        inside(pixel.x, self.width) && inside(pixel.y, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{camera, vector};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn back_projection_undoes_projection(camera in camera(), p in vector(5.0)) {
            let point = Point3::new(p.x, p.y, p.z.abs() + 0.1);
            let pixel = camera.project(point).unwrap();
            // Metres; pixels reach 25 000, so their rounding is 4e-12 px over 400 px of focal length.
            prop_assert!((camera.back_project(pixel, point.z) - point).norm() < 1e-12);
            prop_assert!((camera.ray(pixel) - point.coords.normalize()).norm() < 1e-12);
        }

        #[test]
        fn the_line_matrix_takes_the_plane_of_two_points_to_the_line_of_their_pixels(
            camera in camera(), a in vector(5.0), b in vector(5.0),
        ) {
            let k = Matrix3::new(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
            let (found, expected) = (camera.line_matrix() * a.cross(&b), (k * a).cross(&(k * b)));
            // Relative to the largest products that are formed.
            let scale = k.norm_squared() * a.norm() * b.norm();
            prop_assert!((found - expected).norm() <= 1e-14 * scale);
        }
    }

    #[test]
    fn what_is_not_in_front_has_no_image() {
        let camera = PinholeCamera::new(500.0, 500.0, 319.5, 239.5, 640, 480).unwrap();
        for z in [0.0, -1.0, 1e-9, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(camera.project(Point3::new(0.1, 0.1, z)), None, "{z}");
        }
        assert_eq!(camera.project(Point3::new(f64::NAN, 0.0, 1.0)), None);
        assert_eq!(camera.project(Point3::new(f64::MAX, 0.0, 1.0)), None);
        assert_eq!(camera.project(Point3::new(0.0, 0.0, 1.0)), Some(Point2::new(319.5, 239.5)));
    }

    #[test]
    fn a_negative_fy_turns_the_image_upside_down() {
        let camera = PinholeCamera::new(481.2, -480.0, 319.5, 239.5, 640, 480).unwrap();
        let pixel = camera.project(Point3::new(0.0, 1.0, 2.0)).unwrap();
        assert_eq!(pixel, Point2::new(319.5, -0.5));
    }

    #[test]
    fn the_image_ends_half_a_pixel_outside_its_outer_centres() {
        let camera = PinholeCamera::new(500.0, 500.0, 319.5, 239.5, 640, 480).unwrap();
        assert!(camera.contains(Point2::new(-0.5, 479.5), 0.0));
        assert!(!camera.contains(Point2::new(-0.6, 0.0), 0.0));
        assert!(!camera.contains(Point2::new(0.0, 479.6), 0.0));
        assert!(camera.contains(Point2::new(642.5, -3.5), 3.0));
        assert!(!camera.contains(Point2::new(642.6, 0.0), 3.0));
        assert!(!camera.contains(Point2::new(f64::NAN, 0.0), 3.0));
    }

    #[test]
    fn numbers_that_are_no_camera_are_refused() {
        let found = PinholeCamera::new(f64::NAN, 1.0, 0.0, 0.0, 1, 1);
        assert!(matches!(found, Err(Error::NotFinite { what: "camera", .. })));
        let found = PinholeCamera::new(1.0, 0.0, 0.0, 0.0, 1, 1);
        assert!(matches!(found, Err(Error::OutOfRange { what: "fy", .. })));
        let found = PinholeCamera::new(1.0, 1.0, 0.0, 0.0, 1, 0);
        assert!(matches!(found, Err(Error::OutOfRange { what: "height", .. })));
    }
}
