//! A sequence as its dataset publishes it.

use std::path::PathBuf;

use open_structure::geometry::Pose;
use open_structure::structure::{Camera, Clock, Exclusion, FrameId, Source};

use super::{BrownConrady, DepthNoise, Raster};

/// A frame: when and where it was taken, and its files.
#[derive(Clone, Debug, PartialEq)]
pub struct RawFrame {
    /// Name of the frame.
    pub frame_id: FrameId,
    /// When the colour image was taken, nanoseconds.
    pub stamp_nanos: i64,
    /// Where it was taken: the true pose.
    pub world_from_camera: Pose,
    /// The colour image.
    pub colour: PathBuf,
    /// The depth map.
    pub depth: PathBuf,
}

/// How a dataset writes depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthFormat {
    /// A PNG picture of 16 bits: depth along the optical axis in steps, 0 where there is none.
    Png {
        /// Steps in a metre.
        steps_per_metre: f64,
    },
    /// A NumPy array of 32-bit floating point numbers: depth along the optical axis, metres.
    Npy,
    /// A PNG picture of four times 8 bits whose bytes are a 32-bit floating point number: depth along the optical
    /// axis, metres (TartanAir V2).
    FloatPng,
    /// Text: the distance along each pixel's ray, metres, row by row (ICL-NUIM as its ray tracer wrote it).
    RayText,
}

/// A sequence as its dataset publishes it; nothing of its images is in memory.
#[derive(Clone, Debug)]
pub struct RawSequence {
    /// Name of the sequence within the dataset.
    pub name: String,
    /// Dataset, licence, citation, and the lists that were read, with digests.
    pub source: Source,
    /// Where stamps come from.
    pub clock: Clock,
    /// The camera of the sequence that is made: without distortion, with its depth range.
    pub camera: Camera,
    /// The lens of the images, where they are distorted.
    pub lens: Option<BrownConrady>,
    /// How depth is written.
    pub depth_format: DepthFormat,
    /// How far depth may be from the surface.
    pub depth_noise: DepthNoise,
    /// The frames, ascending by stamp and by id.
    pub frames: Vec<RawFrame>,
    /// What the lists name and cannot be used, counted: files that are missing, images without a pose, ...
    pub excluded: Vec<Exclusion>,
}

impl RawSequence {
    /// Where pixels of the images lie in the `image` space of the camera.
    #[must_use]
    pub fn raster(&self) -> Raster {
        Raster::new(&self.camera, self.lens)
    }
}
