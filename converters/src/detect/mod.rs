//! Features of images: where they are, before anything is known of depth.

mod error;
mod merge;
mod segment_refine;
mod segments;

pub use error::Error;
pub use segments::{Detector, SegmentOptions, segments};
