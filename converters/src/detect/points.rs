//! ORB: corners with binary descriptors.

use nalgebra::Point2;
use opencv::core::{
    KeyPoint, KeyPointTraitConst as _, Mat, MatTraitConst as _, MatTraitConstManual as _, Ptr, Vector,
};
use opencv::features2d::{Feature2DTrait as _, ORB, ORB_ScoreType};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;

/// Bytes of a descriptor.
pub const DESCRIPTOR_BYTES: usize = 32;

/// A binary descriptor: 256 comparisons of a patch.
pub type Bits = [u8; DESCRIPTOR_BYTES];

/// How points are detected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PointOptions {
    /// Most points of an image, the strongest first.
    pub max_features: u32,
    /// Ratio between the sizes of two levels of the pyramid; over 1.
    pub scale_factor: f32,
    /// Levels of the pyramid.
    pub levels: u32,
    /// Least difference of grey values that makes a corner.
    pub fast_threshold: u32,
    /// Of two points nearer than this, the stronger one stays, pixels: a corner shows itself on several levels.
    pub min_distance_px: f64,
}

impl Default for PointOptions {
    fn default() -> Self {
        Self { max_features: 1000, scale_factor: 1.2, levels: 8, fast_threshold: 20, min_distance_px: 3.0 }
    }
}

/// A detected point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectedPoint {
    /// Where it is: raster position, pixels.
    pub raster: Point2<f64>,
    /// Size of a pixel of the level on which it was found, pixels.
    pub scale: f64,
    /// How strong it is: Harris' measure.
    pub response: f32,
    /// What it looks like.
    pub descriptor: Bits,
}

/// A detector of points; each thread has its own.
pub struct PointDetector {
    orb: Ptr<ORB>,
    options: PointOptions,
}

impl PointDetector {
    /// A detector.
    ///
    /// # Errors
    /// [`Error::OpenCv`] for options that the detector does not take.
    pub fn new(options: PointOptions) -> Result<Self, Error> {
        let count = |value: u32| i32::try_from(value).unwrap_or(i32::MAX);
        let orb = ORB::create(
            // More than are wanted, for of those that stand too close one goes.
            count(options.max_features.saturating_mul(2)),
            options.scale_factor,
            count(options.levels),
            31,
            0,
            2,
            ORB_ScoreType::HARRIS_SCORE,
            31,
            count(options.fast_threshold),
        )?;
        Ok(Self { orb, options })
    }

    /// The points of an image, strongest first.
    ///
    /// ORB says that pixel `i` of a level lies at `i s` of the image, where `s` is the level's scale. But its middle lies at
    /// `(i + ½) n/m − ½`, where the level has a whole number `m ≈ n/s` of pixels for the image's `n`; that is given here.
    /// It is up to one and a half pixels away.
    ///
    /// * `grey` — 8 bits, one channel.
    ///
    /// # Errors
    /// [`Error::OpenCv`] for an image of another kind.
    pub fn detect(&mut self, grey: &Mat) -> Result<Vec<DetectedPoint>, Error> {
        let mut keypoints = Vector::<KeyPoint>::new();
        let mut descriptors = Mat::default();
        self.orb.detect_and_compute_def(grey, &opencv::core::no_array(), &mut keypoints, &mut descriptors)?;
        let mut points = Vec::with_capacity(keypoints.len());
        for (row, keypoint) in (0..).zip(&keypoints) {
            let mut descriptor = [0; DESCRIPTOR_BYTES];
            descriptor.copy_from_slice(descriptors.at_row::<u8>(row)?);
            // By products: powers need not be the same on every machine.
            let scale =
                (0..keypoint.octave()).fold(1.0, |scale, _| scale * f64::from(self.options.scale_factor));
            let position = keypoint.pt();
            let middle = |value: f32, size: i32| {
                let size = f64::from(size);
                let level_size = (size / scale).round_ties_even().max(1.0);
                (f64::from(value) / scale + 0.5) * (size / level_size) - 0.5
            };
            points.push(DetectedPoint {
                raster: Point2::new(middle(position.x, grey.cols()), middle(position.y, grey.rows())),
                scale,
                response: keypoint.response(),
                descriptor,
            });
        }
        points.sort_by(|a, b| {
            let place = |point: &DetectedPoint| (point.raster.y, point.raster.x);
            let ((ay, ax), (by, bx)) = (place(a), place(b));
            b.response.total_cmp(&a.response).then(ay.total_cmp(&by)).then(ax.total_cmp(&bx))
        });
        Ok(self.thin_out(points))
    }

    /// Keeps the strongest, no two of them too close.
    fn thin_out(&self, points: Vec<DetectedPoint>) -> Vec<DetectedPoint> {
        let least = self.options.min_distance_px;
        let most = self.options.max_features as usize;
        let mut kept: Vec<DetectedPoint> = Vec::with_capacity(most.min(points.len()));
        let mut cells = std::collections::HashMap::<[i64; 2], Vec<usize>>::new();
        #[expect(clippy::cast_possible_truncation, reason = "pixels of an image")]
        let cell =
            |point: &Point2<f64>| [point.x, point.y].map(|value| (value / least.max(1.0)).floor() as i64);
        for point in points {
            if kept.len() >= most {
                break;
            }
            let [column, row] = cell(&point.raster);
            let near = (-1..=1).flat_map(|y| (-1..=1).map(move |x| [column + x, row + y]));
            let close = |index: &usize| (kept[*index].raster - point.raster).norm() < least;
            if near.filter_map(|place| cells.get(&place)).flatten().any(close) {
                continue;
            }
            cells.entry([column, row]).or_default().push(kept.len());
            kept.push(point);
        }
        kept
    }
}

/// Bits in which two descriptors differ.
#[must_use]
pub fn hamming(a: &Bits, b: &Bits) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use opencv::core::{CV_8UC1, MatTrait as _, Scalar};

    /// Squares on grey.
    fn squares() -> Mat {
        let mut grey = Mat::new_rows_cols_with_default(480, 640, CV_8UC1, Scalar::all(90.0)).unwrap();
        for (left, top) in [(60, 60), (250, 80), (430, 60), (90, 280), (300, 260), (480, 300)] {
            for row in top..top + 70 {
                for column in left..left + 70 {
                    *grey.at_2d_mut::<u8>(row, column).unwrap() = 200;
                }
            }
        }
        grey
    }

    #[test]
    fn half_a_turn_of_the_image_turns_its_points_on_every_level() {
        let (size, mut random) = ([640, 480], open_structure::simulate::Random::new(1, "texture", 0));
        let mut noise = Mat::new_rows_cols_with_default(size[1], size[0], CV_8UC1, Scalar::all(0.0)).unwrap();
        for row in 0..size[1] {
            for column in 0..size[0] {
                *noise.at_2d_mut::<u8>(row, column).unwrap() = if random.chance(0.5) { 255 } else { 0 };
            }
        }
        let (mut smooth, mut grey, mut turned) = (Mat::default(), Mat::default(), Mat::default());
        let kernel = opencv::core::Size::new(0, 0);
        opencv::imgproc::gaussian_blur_def(&noise, &mut smooth, kernel, 4.0).unwrap();
        opencv::core::normalize(
            &smooth,
            &mut grey,
            0.0,
            255.0,
            opencv::core::NORM_MINMAX,
            -1,
            &Mat::default(),
        )
        .unwrap();
        opencv::core::rotate(&grey, &mut turned, opencv::core::ROTATE_180).unwrap();
        let options = PointOptions { min_distance_px: 0.0, max_features: 2000, ..PointOptions::default() };
        let mut detector = PointDetector::new(options).unwrap();
        let (points, others) = (detector.detect(&grey).unwrap(), detector.detect(&turned).unwrap());
        for level in [1, 4, 7] {
            let scale = (0..level).fold(1.0, |scale, _| scale * f64::from(options.scale_factor));
            let on_level = |point: &&DetectedPoint| point.scale == scale;
            let back = |point: &Point2<f64>| Point2::new(639.0 - point.x, 479.0 - point.y);
            let (mut sum, mut count) = (nalgebra::Vector2::zeros(), 0.0);
            for point in points.iter().filter(on_level) {
                for other in others.iter().filter(on_level) {
                    let difference = point.raster - back(&other.raster);
                    if difference.norm() < 1.5 * scale {
                        sum += difference;
                        count += 1.0;
                    }
                }
            }
            // Twice the shift; without the half pixel of a level it would be −(s − 1), so −2.6 px on the last.
            assert!(count > 20.0 && (sum / count).amax() < 0.1 * scale, "{level} {count} {}", sum / count);
        }
    }

    #[test]
    fn points_keep_their_distance_and_their_number() {
        let grey = squares();
        let options = PointOptions { max_features: 12, min_distance_px: 8.0, ..PointOptions::default() };
        let points = PointDetector::new(options).unwrap().detect(&grey).unwrap();
        assert_eq!(points.len(), 12);
        for (index, point) in points.iter().enumerate() {
            assert!(points[..index].iter().all(|other| (other.raster - point.raster).norm() >= 8.0));
            assert!(index == 0 || points[index - 1].response >= point.response);
        }
        let again = PointDetector::new(options).unwrap().detect(&grey).unwrap();
        assert_eq!(points, again);
    }

    #[test]
    fn an_image_without_corners_has_no_points_and_a_wrong_one_is_an_error() {
        let mut detector = PointDetector::new(PointOptions::default()).unwrap();
        let grey = Mat::new_rows_cols_with_default(120, 160, CV_8UC1, Scalar::all(90.0)).unwrap();
        assert!(detector.detect(&grey).unwrap().is_empty());
        let wrong =
            Mat::new_rows_cols_with_default(120, 160, opencv::core::CV_64FC1, Scalar::all(90.0)).unwrap();
        assert!(detector.detect(&wrong).is_err());
    }

    #[test]
    fn descriptors_differ_in_as_many_bits_as_were_turned() {
        let a = [0b1010_1010; DESCRIPTOR_BYTES];
        let mut b = a;
        (b[0], b[31]) = (!b[0], b[31] ^ 1);
        assert_eq!((hamming(&a, &a), hamming(&a, &b)), (0, 9));
    }
}
