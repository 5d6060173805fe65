//! The numbers of a camera, where a dataset's reader could not know them.

use std::path::Path;

use super::{Layout, files};
use crate::simulate::{CameraPreset, CameraRecipe, Error};
use crate::structure::{Camera, registry};

/// The camera with which a dataset's readers reckon.
fn published(layout: Layout) -> Result<Camera, Error> {
    let preset = match layout {
        Layout::Tum => CameraPreset::TumFr3,
        Layout::Icl | Layout::IclOriginal => CameraPreset::IclNuim,
        Layout::TartanAir => CameraPreset::Tartanair,
    };
    CameraRecipe { preset, ..CameraRecipe::default() }.camera("camera")
}

/// Writes `calibration.txt` where a reader cannot know the camera: one line `width height fx fy cx cy`, pixels, counted
/// from where the dataset counts.
///
/// TUM RGB-D has three cameras, told by the folder's name, which is not ours to give: it always has the file. The
/// others have one camera, and the file if the recipe's is another.
pub(super) fn write(folder: &Path, layout: Layout, camera: &Camera) -> Result<(), Error> {
    let published = published(layout)?;
    let numbers = |camera: &Camera| {
        let first = |origin: &str| if origin == registry::PIXEL_CORNER { 0.5 } else { 0.0 };
        // The same pixel is named by positions that differ by half a pixel.
        let shift = first(&published.pixel_origin) - first(&camera.pixel_origin);
        let Camera { width, height, fx, fy, cx, cy, .. } = camera;
        (*width, *height, [*fx, *fy, cx + shift, cy + shift])
    };
    let (width, height, [fx, fy, cx, cy]) = numbers(camera);
    if layout != Layout::Tum && (width, height, [fx, fy, cx, cy]) == numbers(&published) {
        return Ok(());
    }
    let origin = if published.pixel_origin == registry::PIXEL_CORNER {
        "the outer corner of the top-left pixel is (0, 0)"
    } else {
        "the middle of the top-left pixel is (0, 0)"
    };
    let text = format!(
        "# camera of these images, in pixels; {origin}\n# width height fx fy cx cy\n{width} {height} {fx:?} {fy:?} {cx:?} {cy:?}\n"
    );
    files::text(&folder.join("calibration.txt"), &text)
}
