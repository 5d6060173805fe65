//! A sequence as its dataset publishes it.

use std::path::{Path, PathBuf};

use open_structure::geometry::Pose;
use open_structure::structure::{Camera, Clock, Exclusion, FrameId, Source};

use super::{BrownConrady, DepthNoise, Error, Raster};
use crate::family::{Family, Origin};

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
    /// Text: the distance along each pixel's ray, row by row (ICL-NUIM as its ray tracer wrote it).
    RayText {
        /// Units in a metre: 1, and 100 where the scene is in centimetres.
        units_per_metre: f64,
    },
}

/// A sequence as its dataset publishes it; nothing of its images is in memory.
#[derive(Clone, Debug)]
pub struct RawSequence {
    /// Name of the sequence within the dataset.
    pub name: String,
    /// What it shows, for people.
    pub description: Option<String>,
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
    /// Standard deviation of the true positions, metres.
    pub pose_sigma_m: f64,
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

/// Where a sequence of a family comes from, but for its files.
pub(super) fn source(family: &Family, name: &str) -> Source {
    let text = |of: fn(&Origin) -> &'static str| family.origin.as_ref().map(|origin| of(origin).to_owned());
    Source {
        dataset: text(|origin| origin.dataset).unwrap_or_default(),
        sequence: Some(name.to_owned()),
        url: text(|origin| origin.url),
        licence: text(|origin| origin.licence),
        citation: text(|origin| origin.citation),
        files: Vec::new(),
    }
}

/// The stamp of a frame of a clock that was made: its id divided by the rate, rounded, nanoseconds.
pub(super) fn tick(id: i64, rate_hz: i64) -> i64 {
    let (seconds, rest) = (id.div_euclid(rate_hz), id.rem_euclid(rate_hz));
    seconds.saturating_mul(1_000_000_000).saturating_add((rest * 1_000_000_000 + rate_hz / 2) / rate_hz)
}

/// The error of a sequence of which nothing can be used.
pub(super) fn no_frame(root: &Path, excluded: &[Exclusion]) -> Error {
    let found = if excluded.is_empty() {
        "none of those that are wanted".to_owned()
    } else {
        // Frames may also be there, and not be wanted.
        let reasons =
            excluded.iter().map(|found| format!("{}: {} {}", found.file, found.count, found.reason));
        format!("none of those that are wanted; {}", reasons.collect::<Vec<_>>().join("; "))
    };
    Error::layout(root, "at least one frame with its images and a true pose", found)
}
