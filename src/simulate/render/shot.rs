//! What an eye sees: colours and depths of all pixels.

use rayon::prelude::*;

use super::{Eye, Paint};
use crate::simulate::visibility::Occluders;

/// Rays end here, metres of depth.
pub(super) const REACH_M: f64 = 1e9;
/// Where the colour of a pixel is sampled, from its middle, pixels.
const SAMPLES_PX: [[f64; 2]; 4] = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];

/// A picture and its depth map.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Columns, pixels.
    pub width: u32,
    /// Rows, pixels.
    pub height: u32,
    /// Red, green, blue of each pixel, row by row: the mean of 2 × 2 rays.
    pub rgb: Vec<u8>,
    /// Depth (z, not range) of the surface at the middle of each pixel, row by row, metres; infinite where
    /// there is none.
    pub depth_m: Vec<f64>,
}

impl Shot {
    /// Takes the picture, rows on all cores.
    #[must_use]
    pub fn take(eye: &Eye, occluders: &Occluders, paint: &Paint<'_>) -> Self {
        let (width, height) = eye.size();
        let columns = width as usize;
        let mut rgb = vec![0; columns * height as usize * 3];
        let mut depth_m = vec![0.0; columns * height as usize];
        let rows = rgb.par_chunks_mut(columns * 3).zip(depth_m.par_chunks_mut(columns));
        rows.enumerate().for_each(|(row, (colors, depths))| {
            let row = row as f64;
            for (column, (color, depth)) in colors.chunks_exact_mut(3).zip(depths).enumerate() {
                let column = column as f64;
                let hit = occluders.first_hit(&eye.center(), &eye.direction(column, row), REACH_M);
                *depth = hit.map_or(f64::INFINITY, |hit| hit.along);
                let mut sum = [0.0; 3];
                for [right, down] in SAMPLES_PX {
                    let sample = paint.seen(eye, occluders, column + right, row + down);
                    sum.iter_mut().zip(sample).for_each(|(sum, part)| *sum += part);
                }
                color.iter_mut().zip(sum).for_each(|(byte, sum)| *byte = byte_of(sum / 4.0));
            }
        });
        Self { width, height, rgb, depth_m }
    }
}

/// A brightness from 0 to 1 as a byte.
fn byte_of(brightness: f64) -> u8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
    let byte = (brightness.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    byte
}
