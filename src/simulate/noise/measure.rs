//! Measurements of what one frame observes.

use super::super::Random;
use super::depth::DepthNoise;
use super::{NoiseModel, NoiseRecipe};
use crate::structure::{
    Camera, FrameId, LineMeasurement, LineObservation, PointMeasurement, PointObservation, registry,
};

/// One position in the image with the depth there.
#[derive(Clone, Copy, Debug)]
struct Place {
    pixel: [f64; 2],
    depth: Option<f64>,
}

/// A point has one place, a segment two.
type Places<const N: usize> = [Place; N];

impl NoiseRecipe {
    /// Measurements of the observations of one frame, in their order.
    ///
    /// * `points`, `lines` — what the frame observes; pixels, metres.
    ///
    /// What is drawn depends on the seed, the frame and the rows, and on nothing else: streams are named by
    /// seed and frame, of their own for points and lines, and for noise, mismatches and misses. So an option
    /// leaves the noise of the other rows as it was.
    ///
    /// # Source
    /// Open-Structure (Li et al. 2024), section III-C; what differs is in the registry, section 4.
    #[must_use]
    pub fn measure(
        &self,
        camera: &Camera,
        frame_id: FrameId,
        points: &[PointObservation],
        lines: &[LineObservation],
        seed: u64,
    ) -> (Vec<PointMeasurement>, Vec<LineMeasurement>) {
        let sensor = Sensor::new(self, camera);
        let index = frame_id.0.cast_unsigned();
        let stream = |purpose: &str| Random::new(seed, purpose, index);

        let mut streams = ["noise points", "noise points mismatched", "noise points missed"].map(stream);
        let places = |row: &PointObservation| [Place { pixel: [row.u, row.v], depth: row.depth }];
        let points = (0..points.len()).filter_map(|index| {
            let [place] = sensor.measure(index, points, places, &mut streams)?;
            let [u, v] = place.pixel;
            Some(PointMeasurement { frame_id, point_id: points[index].point_id, u, v, depth: place.depth })
        });
        let points = points.collect();

        let mut streams = ["noise lines", "noise lines mismatched", "noise lines missed"].map(stream);
        let places = |row: &LineObservation| {
            [
                Place { pixel: [row.start_u, row.start_v], depth: row.start_depth },
                Place { pixel: [row.end_u, row.end_v], depth: row.end_depth },
            ]
        };
        let lines = (0..lines.len()).filter_map(|index| {
            let [start, end] = sensor.measure(index, lines, places, &mut streams)?;
            Some(LineMeasurement {
                frame_id,
                line_id: lines[index].line_id,
                start_u: start.pixel[0],
                start_v: start.pixel[1],
                start_depth: start.depth,
                end_u: end.pixel[0],
                end_v: end.pixel[1],
                end_depth: end.depth,
            })
        });
        (points, lines.collect())
    }
}

/// A recipe with its numbers, and the camera's.
struct Sensor {
    exact: bool,
    sigma_px: f64,
    depth: DepthNoise,
    outlier_fraction: f64,
    missed_fraction: f64,
    quantisation_px: f64,
    drop_outside: bool,
    depth_range_m: [f64; 2],
    size_px: [f64; 2],
    /// Where the image begins, pixels: its first pixel reaches from here to one more.
    edge_px: f64,
}

impl Sensor {
    fn new(recipe: &NoiseRecipe, camera: &Camera) -> Self {
        let range = if recipe.keep_depth { [None; 2] } else { [camera.depth_min, camera.depth_max] };
        Self {
            exact: recipe.model == NoiseModel::None,
            sigma_px: recipe.parameter("sigma_px"),
            depth: DepthNoise::new(recipe),
            outlier_fraction: recipe.outlier_fraction.unwrap_or(0.0),
            missed_fraction: recipe.missed_fraction.unwrap_or(0.0),
            quantisation_px: recipe.quantisation_px.unwrap_or(0.0),
            drop_outside: recipe.drop_outside,
            depth_range_m: [range[0].unwrap_or(0.0), range[1].unwrap_or(f64::INFINITY)],
            size_px: [f64::from(camera.width), f64::from(camera.height)],
            edge_px: if camera.pixel_origin == registry::PIXEL_CORNER { 0.0 } else { -0.5 },
        }
    }

    /// One row measured, or missed.
    fn measure<Row, const N: usize>(
        &self,
        index: usize,
        rows: &[Row],
        places: impl Fn(&Row) -> Places<N>,
        [noise, mismatched, missed]: &mut [Random; 3],
    ) -> Option<Places<N>> {
        let is_missed = missed.chance(self.missed_fraction);
        let mut truth = places(&rows[index]);
        if mismatched.chance(self.outlier_fraction) {
            match rows.len() {
                0 | 1 => truth.iter_mut().for_each(|place| place.pixel = self.anywhere(mismatched)),
                // Any of the others, each as likely as the next.
                count => truth = places(&rows[(index + 1 + mismatched.index(count - 1)) % count]),
            }
        }
        let slopes = inverse_slopes(&truth);
        let mut measured = truth;
        for (place, slope) in measured.iter_mut().zip(slopes) {
            for coordinate in &mut place.pixel {
                let shift = noise.normal();
                if !self.exact {
                    *coordinate += self.sigma_px * shift;
                }
                *coordinate = self.rounded(*coordinate);
            }
            let [least, most] = self.depth_range_m;
            place.depth = self.depth.measure(place.depth, slope, noise);
            place.depth = place.depth.filter(|depth| (least..=most).contains(depth));
        }
        let dropped = is_missed
            || (self.drop_outside && !measured.iter().all(|place| self.contains(place.pixel)))
            || (self.quantisation_px > 0.0 && N == 2 && measured[0].pixel == measured[N - 1].pixel);
        (!dropped).then_some(measured)
    }

    fn anywhere(&self, random: &mut Random) -> [f64; 2] {
        self.size_px.map(|size| self.edge_px + size * random.uniform())
    }

    fn contains(&self, pixel: [f64; 2]) -> bool {
        let inside =
            |(coordinate, size): (f64, f64)| (self.edge_px..=self.edge_px + size).contains(&coordinate);
        pixel.into_iter().zip(self.size_px).all(inside)
    }

    /// The nearest position of the grid through the middle of the first pixel.
    fn rounded(&self, coordinate: f64) -> f64 {
        if self.quantisation_px > 0.0 {
            let middle = self.edge_px + 0.5;
            ((coordinate - middle) / self.quantisation_px).round() * self.quantisation_px + middle
        } else {
            coordinate
        }
    }
}

/// How the inverse of depth changes along a segment, 1/m per pixel, for shifts from the start to the end.
///
/// The inverse of depth is linear along the image of a line. `None` for a point; 0 where a depth is absent or
/// the ends coincide.
fn inverse_slopes<const N: usize>(places: &Places<N>) -> [Option<f64>; N] {
    let [start, .., end] = places.as_slice() else { return [None; N] };
    let slope = start.depth.zip(end.depth).map(|(near, far)| {
        let [across, down] = [0, 1].map(|axis| end.pixel[axis] - start.pixel[axis]);
        (1.0 / far - 1.0 / near) / (across * across + down * down).sqrt()
    });
    [Some(slope.filter(|slope| slope.is_finite()).unwrap_or(0.0)); N]
}
