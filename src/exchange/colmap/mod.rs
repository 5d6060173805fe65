//! COLMAP's text model: `cameras.txt`, `images.txt`, `points3D.txt`, as they are and as our graphs.
//!
//! COLMAP stores `camera_from_world` with the real part of the quaternion first. Its pixels count from the outer corner of
//! the first pixel, whose middle is (0.5, 0.5): our `pixel-corner`. Its cameras have x right, y down, z forward.

mod export;
mod import;
mod model;
#[cfg(test)]
mod tests;
mod text;

pub use export::to_colmap;
pub use import::from_colmap;
pub use model::{ColmapCamera, ColmapImage, ColmapModel, ColmapPoint, ColmapPoint2};
pub use text::{read_colmap, write_colmap};
