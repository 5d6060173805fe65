//! What a front-end finds in an image: points and segments.

mod error;
mod points;

pub use error::Error;
pub use points::{Bits, DESCRIPTOR_BYTES, DetectedPoint, PointDetector, PointOptions, hamming};
