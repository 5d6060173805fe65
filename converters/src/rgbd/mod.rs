//! Raw RGB-D datasets: what a folder as downloaded holds, and its images as grey values and metres.
//!
//! Each dataset is one file, whose `open` gives a [`RawSequence`]: every frame with its stamp, its true pose and
//! the names of its files. Images are read one frame at a time by [`RawSequence::images`].

mod ascending;
mod associate;
mod calibration;
mod depth_file;
mod depth_map;
mod depth_noise;
mod error;
pub mod icl;
mod icl_original;
mod images;
mod layout;
mod ledger;
mod lens;
mod list;
mod open_options;
mod picture;
mod raster;
mod raw_sequence;
mod stamp;
pub mod tartanair;
mod true_poses;
pub mod tum;

pub use depth_map::{DepthMap, Plane, Sight, Surface};
pub use depth_noise::DepthNoise;
pub use error::Error;
pub use images::Images;
use ledger::Ledger;
pub use lens::BrownConrady;
pub use open_options::{GivenCamera, Kinect, OpenOptions};
pub use raster::Raster;
pub use raw_sequence::{DepthFormat, RawFrame, RawSequence};
