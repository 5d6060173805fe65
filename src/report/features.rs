//! What frames show, as columns: which landmarks, where in the image, how deep.

use std::collections::BTreeMap;

use serde::Serialize;

use super::columns::{Column, Columns};
use crate::structure::{Camera, CameraId, FrameBundle, registry};

/// What stands for a depth that is not known.
const NO_DEPTH: u16 = u16::MAX;

/// From whole numbers of two bytes to pixels: `from + step · n`.
///
/// The range is the image with an eighth of it on every side; what lies farther outside, where the page does not draw, ends there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Grid {
    from: [f64; 2],
    /// A power of two, a sixtieth of a pixel or so for usual images.
    step: f64,
}

impl Grid {
    fn of(camera: &Camera) -> Self {
        let size = [camera.width, camera.height].map(f64::from);
        let range = size[0].max(size[1]) * 1.25 + 2.0;
        let mut step = 1.0 / 64.0;
        while range / step > f64::from(u16::MAX) {
            step *= 2.0;
        }
        Self { from: size.map(|size| -(size / 8.0).ceil()), step }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
    fn place(&self, pixel: [f64; 2]) -> [u16; 2] {
        let place = |axis: usize| {
            let number = (pixel[axis] - self.from[axis]) / self.step;
            number.round().clamp(0.0, f64::from(u16::MAX)) as u16
        };
        [place(0), place(1)]
    }
}

/// A camera, as the page draws it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct ViewCamera {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    /// Pixel coordinate of the image's left and upper border.
    border: f64,
    grid: Grid,
}

impl ViewCamera {
    pub(super) fn of(camera: &Camera) -> Self {
        Self {
            width: camera.width,
            height: camera.height,
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
            border: if camera.pixel_origin == registry::PIXEL_CORNER { 0.0 } else { -0.5 },
            grid: Grid::of(camera),
        }
    }
}

/// Features of one kind, frame after frame; `ENDS` pixels each, 1 of a point and 2 of a segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Features<const ENDS: usize> {
    /// Features of each frame.
    counts: Vec<u32>,
    /// Ids of their landmarks.
    ids: Vec<i64>,
    places: Vec<[[u16; 2]; ENDS]>,
    depths: Vec<[Option<f64>; ENDS]>,
}

impl<const ENDS: usize> Features<ENDS> {
    fn push(&mut self, grid: &Grid, id: i64, pixels: [[f64; 2]; ENDS], depths: [Option<f64>; ENDS]) {
        if pixels.iter().flatten().all(|coordinate| coordinate.is_finite()) {
            self.ids.push(id);
            self.places.push(pixels.map(|pixel| grid.place(pixel)));
            self.depths.push(depths);
        }
    }

    fn end_frame(&mut self, before: usize) {
        self.counts.push(u32::try_from(self.ids.len() - before).unwrap_or(u32::MAX));
    }

    /// Ids of the landmarks of all features, with repetitions.
    pub(super) fn ids(&self) -> &[i64] {
        &self.ids
    }

    /// Number of features.
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    /// The features as columns.
    ///
    /// * `index` — place of each landmark in the list of landmarks.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of 1, clamped")]
    pub(super) fn columns(&self, index: &BTreeMap<i64, u32>, columns: &mut Columns) -> FeatureColumns {
        let places: Vec<u32> = self.ids.iter().map(|id| index.get(id).copied().unwrap_or(u32::MAX)).collect();
        let known = || self.depths.iter().flatten().flatten().copied().filter(|depth| depth.is_finite());
        let most = known().fold(0.0, f64::max);
        let depth = |depth: &Option<f64>| match depth {
            Some(depth) if *depth >= 0.0 && depth.is_finite() && most > 0.0 => {
                (depth / most * f64::from(NO_DEPTH - 1)).round().clamp(0.0, f64::from(NO_DEPTH - 1)) as u16
            }
            _ => NO_DEPTH,
        };
        let pixels: Vec<u16> = self.places.iter().flatten().flatten().copied().collect();
        let depths: Vec<u16> = self.depths.iter().flatten().map(depth).collect();
        FeatureColumns {
            counts: columns.whole(&self.counts),
            landmarks: columns.whole(&places),
            pixels: columns.u16(&pixels),
            depths: (most > 0.0).then(|| columns.u16(&depths)),
            depth_step: most / f64::from(NO_DEPTH - 1),
        }
    }
}

/// Where the columns of features of one kind stand.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FeatureColumns {
    counts: Column,
    landmarks: Column,
    pixels: Column,
    #[serde(skip_serializing_if = "Option::is_none")]
    depths: Option<Column>,
    /// Metres; a depth is its whole number times this, 65535 is none.
    depth_step: f64,
}

/// Gathers what frames show: measurements, or observations of a kind that has no measurement.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    grids: BTreeMap<CameraId, Grid>,
    measured_points: bool,
    measured_lines: bool,
    pub(super) points: Features<1>,
    pub(super) lines: Features<2>,
}

impl Gathered {
    pub(super) fn new(cameras: &[Camera], measured_points: bool, measured_lines: bool) -> Self {
        Self {
            grids: cameras.iter().map(|camera| (camera.camera_id, Grid::of(camera))).collect(),
            measured_points,
            measured_lines,
            points: Features::default(),
            lines: Features::default(),
        }
    }

    /// Adds a frame; of one whose camera is not known nothing can be drawn.
    pub(super) fn add(&mut self, frame: &FrameBundle) {
        let before = (self.points.len(), self.lines.len());
        if let Some(grid) = self.grids.get(&frame.frame.camera_id) {
            macro_rules! points {
                ($rows:expr) => {
                    for row in $rows {
                        self.points.push(grid, row.point_id.0, [[row.u, row.v]], [row.depth]);
                    }
                };
            }
            macro_rules! lines {
                ($rows:expr) => {
                    for row in $rows {
                        let pixels = [[row.start_u, row.start_v], [row.end_u, row.end_v]];
                        self.lines.push(grid, row.line_id.0, pixels, [row.start_depth, row.end_depth]);
                    }
                };
            }
            if self.measured_points {
                points!(&frame.point_measurements);
            } else {
                points!(&frame.point_observations);
            }
            if self.measured_lines {
                lines!(&frame.line_measurements);
            } else {
                lines!(&frame.line_observations);
            }
        }
        self.points.end_frame(before.0);
        self.lines.end_frame(before.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PinholeCamera;
    use proptest::prelude::*;

    fn grid(width: u32, height: u32) -> Grid {
        let pinhole = PinholeCamera { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, width, height };
        Grid::of(&Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CENTER))
    }

    proptest! {
        #[test]
        fn a_pixel_is_kept_to_half_a_step(
            width in 1_u32..5000, height in 1_u32..5000, u in -0.1..1.1_f64, v in -0.1..1.1_f64,
        ) {
            let grid = grid(width, height);
            let pixel = [u * f64::from(width), v * f64::from(height)];
            let place = grid.place(pixel);
            for axis in 0..2 {
                let again = grid.from[axis] + grid.step * f64::from(place[axis]);
                prop_assert!((again - pixel[axis]).abs() <= 0.5 * grid.step + 1e-9, "{again} {pixel:?}");
            }
        }
    }

    #[test]
    fn usual_images_have_fine_steps_and_far_pixels_stay_at_the_end() {
        assert_eq!(grid(640, 480).step, 1.0 / 64.0);
        assert_eq!(grid(640, 480).place([1e30, -1e30]), [u16::MAX, 0]);
    }
}
