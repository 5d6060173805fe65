//! Raw RGB-D data of a simulated sequence: pictures and depth maps in the layout of a published dataset.
//!
//! Rays through the centres of pixels meet the faces of the scene; depth is what they find, in 64 bits until
//! it is written. Colours are painted on the surfaces ([`Paint`]), so that every view sees the same.

mod calibration;
mod eye;
mod files;
mod icl;
mod lattice;
mod marks;
mod paint;
mod pattern;
mod shot;
mod tartanair;
mod tum;

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::visibility::Occluders;
use super::{Error, Simulation};
use crate::structure::{Camera, Frame, PoseRow};

pub use eye::Eye;
pub use paint::Paint;
pub use shot::Shot;

/// Most pixels of a picture that is rendered.
const MAX_PIXELS: u64 = 1 << 26;

/// Whose layout is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// TUM RGB-D: lists with time stamps, depth in 1/5000 m.
    Tum,
    /// ICL-NUIM, the version with PNG files that is read like TUM RGB-D; y of the camera points up.
    Icl,
    /// ICL-NUIM as its ray tracer wrote it: depth along the ray as text, a camera for each frame.
    IclOriginal,
    /// TartanAir, first version: depth as NumPy arrays, poses north-east-down.
    TartanAir,
}

/// What is rendered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderOptions {
    /// Whose layout is written.
    pub layout: Layout,
    /// Frames, by their places in the sequence.
    pub frames: Range<usize>,
    /// Of these the first of each so many.
    pub stride: usize,
    /// Whether landmarks are painted on the surfaces: points as small discs, lines as edges between dark and
    /// bright, so that detectors find them.
    pub landmarks: bool,
}

impl RenderOptions {
    /// Every frame, with landmarks.
    #[must_use]
    pub const fn new(layout: Layout) -> Self {
        Self { layout, frames: 0..usize::MAX, stride: 1, landmarks: true }
    }
}

/// What was rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rendered {
    /// Pictures, and as many depth maps.
    pub frames: usize,
    /// Columns of each, pixels.
    pub width: u32,
    /// Rows of each, pixels.
    pub height: u32,
}

/// A frame that is to be written: its row, and its true pose.
#[derive(Clone, Copy, Debug)]
struct Posed<'a> {
    frame: &'a Frame,
    pose: PoseRow,
}

/// Writes the dataset of a layout.
trait Dataset {
    /// Looks at what the layout cannot hold, before anything is rendered.
    ///
    /// * `all` — every frame of the sequence, rendered or not.
    fn begin(&mut self, camera: &Camera, all: &[Posed<'_>]) -> Result<(), Error>;

    /// Writes picture and depth map of a frame.
    fn frame(&mut self, posed: &Posed<'_>, shot: &Shot) -> Result<(), Error>;

    /// Writes what comes at the end: lists and trajectories of all frames.
    fn finish(&mut self, all: &[Posed<'_>]) -> Result<(), Error>;
}

/// Renders frames of a simulated sequence into a folder, in the layout of a dataset.
///
/// Pictures show the recipe's camera. Where that is not the dataset's own, and always for TUM RGB-D, which has
/// three, `calibration.txt` is written beside, in the dataset's convention of where pixels are counted from. The true poses are those of every frame,
/// rendered or not, where the dataset's own are denser than its images (TUM RGB-D, ICL-NUIM), and of the
/// rendered frames where they go by line (TartanAir).
///
/// The same simulation gives the same bytes on any number of threads.
///
/// * `folder` — exists and is empty.
/// * `progress` — told of how many frames are done, and of how many.
///
/// # Errors
/// [`Error::Value`] for a camera, stamps or frames that the layout cannot hold, [`Error::Io`] where a file
/// cannot be written.
pub fn render(
    simulation: &Simulation,
    options: &RenderOptions,
    folder: &Path,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Rendered, Error> {
    let manifest = simulation.manifest();
    let Some(camera) = manifest.cameras.first() else {
        return Err(Error::value("camera", "a camera", "none"));
    };
    let (width, height) = (camera.width, camera.height);
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS {
        return Err(Error::value("camera", format!("at most {MAX_PIXELS} px to render"), pixels));
    }
    let all: Vec<Posed<'_>> = simulation
        .frames()
        .iter()
        .filter_map(|frame| Some(Posed { frame, pose: frame.world_from_camera()? }))
        .collect();
    let Range { start, end } = options.frames;
    let chosen: Vec<&Posed<'_>> = all.iter().take(end).skip(start).step_by(options.stride.max(1)).collect();
    if chosen.is_empty() {
        let found = format!("frames {start} to {end} of {}", all.len());
        return Err(Error::value("frames to render", "at least one", found));
    }
    let folder = PathBuf::from(folder);
    let mut dataset: Box<dyn Dataset> = match options.layout {
        Layout::Tum => Box::new(tum::Tum::new(folder.clone(), &manifest.name)),
        Layout::Icl => Box::new(icl::Icl::new(folder.clone(), &manifest.name)),
        Layout::IclOriginal => Box::new(icl::IclOriginal::new(folder.clone())),
        Layout::TartanAir => Box::new(tartanair::TartanAir::new(folder.clone())),
    };
    dataset.begin(camera, &all)?;
    calibration::write(&folder, options.layout, camera)?;

    let occluders = Occluders::new(simulation.scene());
    let eyes: Vec<Eye> = all.iter().map(|posed| Eye::new(camera, &posed.pose)).collect::<Result<_, _>>()?;
    let paint = Paint::new(simulation, &occluders, &eyes, options.landmarks)?;
    let total = chosen.len() as u64;
    for (done, posed) in (0..).zip(chosen) {
        progress(done, total);
        let eye = Eye::new(camera, &posed.pose)?;
        dataset.frame(posed, &Shot::take(&eye, &occluders, &paint))?;
    }
    dataset.finish(&all)?;
    progress(total, total);
    Ok(Rendered { frames: usize::try_from(total).unwrap_or(usize::MAX), width, height })
}

#[cfg(test)]
mod tests;
