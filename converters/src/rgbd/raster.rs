//! From the pixels of an image file to the `image` space of a camera, and back.

use nalgebra::{Point2, Point3, Vector2};
use open_structure::geometry::PinholeCamera;
use open_structure::structure::{Camera, registry};

use super::BrownConrady;

/// Where the pixels of an image file lie in the `image` space of a camera.
///
/// Two kinds of positions: *raster* positions count pixels of the file, the middle of the top-left one being (0, 0), as
/// OpenCV does; *image* positions are those of the camera, from which distortion is removed and whose origin may be a
/// pixel's corner.
#[derive(Clone, Copy, Debug)]
pub struct Raster {
    camera: PinholeCamera,
    lens: Option<BrownConrady>,
    /// Image position of the middle of the top-left pixel, in both directions, pixels.
    first: f64,
}

impl Raster {
    /// The raster of images of a camera, as large as its image.
    #[must_use]
    pub fn new(camera: &Camera, lens: Option<BrownConrady>) -> Self {
        let first = if camera.pixel_origin == registry::PIXEL_CORNER { 0.5 } else { 0.0 };
        Self { camera: camera.projection(), lens, first }
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }

    /// The image positions within the image: least u, greatest u, least v, greatest v; the greatest are outside.
    #[must_use]
    pub fn bounds(&self) -> [f64; 4] {
        let from = self.first - 0.5;
        [from, from + f64::from(self.camera.width), from, from + f64::from(self.camera.height)]
    }

    /// Image position of a raster position; `None` where the lens has none.
    #[must_use]
    pub fn image(&self, raster: Point2<f64>) -> Option<Point2<f64>> {
        let pixel = raster + Vector2::repeat(self.first);
        let Some(lens) = &self.lens else { return Some(pixel) };
        let PinholeCamera { fx, fy, cx, cy, .. } = self.camera;
        let ideal = lens.undistort(Vector2::new((pixel.x - cx) / fx, (pixel.y - cy) / fy))?;
        Some(Point2::new(fx * ideal.x + cx, fy * ideal.y + cy))
    }

    /// Raster position of an image position; `None` where the lens does not reach.
    #[must_use]
    pub fn raster(&self, image: Point2<f64>) -> Option<Point2<f64>> {
        let Some(lens) = &self.lens else { return Some(image - Vector2::repeat(self.first)) };
        let PinholeCamera { fx, fy, cx, cy, .. } = self.camera;
        let ideal = Vector2::new((image.x - cx) / fx, (image.y - cy) / fy);
        if !lens.is_regular(ideal) {
            return None;
        }
        let distorted = lens.distort(ideal);
        Some(Point2::new(fx * distorted.x + cx, fy * distorted.y + cy) - Vector2::repeat(self.first))
    }

    /// The point seen at a raster position, in the camera, metres.
    ///
    /// * `depth_m` — its z in the camera, metres.
    #[must_use]
    pub fn back_project(&self, raster: Point2<f64>, depth_m: f64) -> Option<Point3<f64>> {
        Some(self.camera.back_project(self.image(raster)?, depth_m))
    }

    /// Image and raster position of a point that the image shows; `None` outside the image or behind the camera.
    ///
    /// Inside means inside the images of both: that of the file, and that of the camera without distortion.
    #[must_use]
    pub fn project(&self, point_in_camera: Point3<f64>) -> Option<(Point2<f64>, Point2<f64>)> {
        let image = self.camera.project(point_in_camera)?;
        if !self.holds(image, self.first) {
            return None;
        }
        let raster = self.raster(image)?;
        self.holds(raster, 0.0).then_some((image, raster))
    }

    /// Whether a position lies on the pixels, whose first has its middle at `first`.
    fn holds(&self, position: Point2<f64>, first: f64) -> bool {
        let inside = |value: f64, size: u32| (first - 0.5..first - 0.5 + f64::from(size)).contains(&value);
        inside(position.x, self.camera.width) && inside(position.y, self.camera.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use open_structure::structure::CameraId;

    fn camera(pixel_origin: &str) -> Camera {
        let pinhole = PinholeCamera { fx: 320.0, fy: 320.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };
        Camera::pinhole(CameraId(0), &pinhole, pixel_origin)
    }

    #[test]
    fn the_middle_of_the_first_pixel_is_half_a_pixel_from_its_corner() {
        let raster = Raster::new(&camera(registry::PIXEL_CORNER), None);
        assert_eq!(raster.image(Point2::origin()), Some(Point2::new(0.5, 0.5)));
        assert_eq!(raster.raster(Point2::new(0.5, 0.5)), Some(Point2::origin()));
        let centred = Raster::new(&camera(registry::PIXEL_CENTER), None);
        assert_eq!(centred.image(Point2::origin()), Some(Point2::origin()));
    }

    #[test]
    fn what_is_projected_comes_back() {
        let lens = BrownConrady::new([0.2624, -0.9531, -0.0054, 0.0026, 1.1633]);
        for (origin, lens) in [(registry::PIXEL_CORNER, None), (registry::PIXEL_CENTER, Some(lens))] {
            let raster = Raster::new(&camera(origin), lens);
            let mut seen = 0;
            for x in -9..=9 {
                for y in -7..=7 {
                    let point = Point3::new(f64::from(x) * 0.22, f64::from(y) * 0.22, 2.0);
                    let Some((image, position)) = raster.project(point) else { continue };
                    seen += 1;
                    assert!((raster.image(position).unwrap() - image).amax() < 1e-9);
                    let back = raster.back_project(position, point.z).unwrap();
                    assert!((back - point).amax() < 1e-12, "{point} {back}");
                }
            }
            assert!(seen > 150, "{seen}");
        }
    }

    #[test]
    fn beyond_the_image_nothing_is_seen() {
        let raster = Raster::new(&camera(registry::PIXEL_CORNER), None);
        for point in
            [Point3::new(0.0, 0.0, -1.0), Point3::new(1.001, 0.0, 1.0), Point3::new(0.0, -0.751, 1.0)]
        {
            assert!(raster.project(point).is_none(), "{point}");
        }
        assert!(raster.project(Point3::new(-0.999, 0.749, 1.0)).is_some());
    }
}
