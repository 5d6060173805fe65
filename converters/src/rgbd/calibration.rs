//! Which camera took the images of a folder.

use std::path::Path;

use open_structure::geometry::PinholeCamera;
use open_structure::structure::{Camera, CameraId, SourceFile};

use super::list::List;
use super::{BrownConrady, Error, OpenOptions};

/// Numbers of a camera beside its images, where they are not the dataset's.
const FILE: &str = "calibration.txt";
/// What the file says.
const EXPECTED: &str = "width height fx fy cx cy, pixels, the focal lengths not zero and fx positive";
/// Most pixels of an image that is read.
const MAX_PIXELS: u64 = 1 << 26;

/// The camera of a dataset as it is published.
#[derive(Clone, Copy, Debug)]
pub(super) struct Published {
    /// The projection.
    pub(super) pinhole: PinholeCamera,
    /// Coefficients of the distortion.
    pub(super) distortion: Option<[f64; 5]>,
}

/// What a dataset's cameras have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    /// Where pixels are counted from, as the registry names it.
    pub(super) pixel_origin: &'static str,
    /// Depths that are believed, metres.
    pub(super) depth_m: [f64; 2],
}

/// The camera of a folder, its lens, and the file that told: the camera that was given, else that of
/// `calibration.txt`, else the published one.
///
/// # Errors
/// [`Error::Line`] for a file that has no camera; [`Error::Layout`] for a given one that is none; those of `published`.
pub(super) fn camera(
    folder: &Path,
    options: &OpenOptions,
    kind: Kind,
    published: impl FnOnce() -> Result<Published, Error>,
) -> Result<(Camera, Option<BrownConrady>, Option<SourceFile>), Error> {
    let path = folder.join(FILE);
    let mut lens = None;
    let mut read = None;
    let pinhole = if let Some(given) = options.camera {
        let [width, height] = match given.size {
            Some(size) => size,
            None => published().map_or([640, 480], |found| [found.pinhole.width, found.pinhole.height]),
        };
        checked(given.fx, given.fy, given.cx, given.cy, [width, height])
            .ok_or_else(|| Error::layout("camera", EXPECTED, format!("{given:?}")))?
    } else if path.exists() {
        let list = List::read(path)?;
        let line = list.lines().next().ok_or_else(|| Error::layout(&list.path, EXPECTED, "nothing"))?;
        let size = |field: usize| line.fields.get(field).and_then(|text| text.parse::<u32>().ok());
        let camera = size(0).zip(size(1)).zip(line.numbers::<4>(2));
        let camera = camera.filter(|_| line.fields.len() == 6);
        let pinhole =
            camera.and_then(|((width, height), [fx, fy, cx, cy])| checked(fx, fy, cx, cy, [width, height]));
        let pinhole = pinhole.ok_or_else(|| line.wrong(EXPECTED))?;
        read = Some(list.source.clone());
        pinhole
    } else {
        let published = published()?;
        lens = published.distortion.map(BrownConrady::new);
        published.pinhole
    };
    let mut camera = Camera::pinhole(CameraId(0), &pinhole, kind.pixel_origin);
    camera.removed_distortion = lens.map(|lens| lens.declared());
    let [nearest, farthest] = kind.depth_m;
    (camera.depth_min, camera.depth_max) = (Some(nearest), Some(farthest));
    Ok((camera, lens, read))
}

fn checked(fx: f64, fy: f64, cx: f64, cy: f64, [width, height]: [u32; 2]) -> Option<PinholeCamera> {
    let camera = PinholeCamera::new(fx, fy, cx, cy, width, height).ok()?;
    (fx > 0.0 && u64::from(width) * u64::from(height) <= MAX_PIXELS).then_some(camera)
}
