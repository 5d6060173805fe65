//! A COLMAP model, with the numbers of its files.

/// A line of `cameras.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapCamera {
    /// Name of the camera.
    pub id: i64,
    /// Model, such as `PINHOLE`.
    pub model: String,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Parameters in the model's order; `PINHOLE` has fx, fy, cx, cy, `SIMPLE_PINHOLE` f, cx, cy.
    pub parameters: Vec<f64>,
}

/// A point seen in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColmapPoint2 {
    /// Position, pixels from the outer corner of the first pixel.
    pub pixel: [f64; 2],
    /// The point that it is; `None` (−1 in the file) for one that was matched with none.
    pub point: Option<i64>,
}

/// Two lines of `images.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapImage {
    /// Name of the image.
    pub id: i64,
    /// Rotation of `camera_from_world`, Hamilton quaternion, the real part first.
    pub rotation_wxyz: [f64; 4],
    /// Translation of `camera_from_world`.
    pub translation: [f64; 3],
    /// Camera of the image.
    pub camera: i64,
    /// File name of the image.
    pub name: String,
    /// Points seen in it.
    pub points: Vec<ColmapPoint2>,
}

/// A line of `points3D.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapPoint {
    /// Name of the point.
    pub id: i64,
    /// Position in the world.
    pub position: [f64; 3],
    /// Colour: red, green, blue.
    pub colour: [u8; 3],
    /// Mean reprojection error, pixels; −1 where it is not known.
    pub error: f64,
    /// Where it is seen: the image, and the place among the image's points.
    pub track: Vec<(i64, usize)>,
}

/// A COLMAP model, in the order of its files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColmapModel {
    /// Cameras.
    pub cameras: Vec<ColmapCamera>,
    /// Images.
    pub images: Vec<ColmapImage>,
    /// Points.
    pub points: Vec<ColmapPoint>,
}
