//! Raw RGB-D datasets: what a folder as downloaded holds, and its images as grey values and metres.
//!
//! Each dataset is one file, whose `open` gives a [`RawSequence`]: every frame with its stamp, its true pose and
//! the names of its files. Images are read one frame at a time by [`RawSequence::images`].

mod depth_map;
mod depth_noise;
mod error;
mod lens;
mod raster;
mod raw_sequence;

pub use depth_map::{DepthMap, Sight, Surface};
pub use depth_noise::DepthNoise;
pub use error::Error;
pub use lens::BrownConrady;
pub use raster::Raster;
pub use raw_sequence::{DepthFormat, RawFrame, RawSequence};
