//! What a front-end finds in an image, before anything is known of depth: points and segments.

mod error;
mod merge;
mod points;
mod segment_refine;
mod segments;

pub use error::Error;
pub use points::{Bits, DESCRIPTOR_BYTES, DetectedPoint, PointDetector, PointOptions, hamming};
pub use segments::{Detector, SegmentOptions, segments};
