//! Straight edges of an image.

use nalgebra::Point2;
use opencv::core::{CV_8U, Mat, MatTraitConst as _, MatTraitConstManual as _, Vec4f, Vector, no_array};
use opencv::imgproc::{LSD_REFINE_STD, LineSegmentDetectorTrait as _, create_line_segment_detector};
use opencv::ximgproc::{
    EdgeDrawingTrait as _, FastLineDetectorTrait as _, create_edge_drawing, create_fast_line_detector,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;
use super::merge::merge;
use super::segment_refine::{Grey, refine};

/// Shortest side of an image in which edges are looked for, pixels.
const LEAST_SIDE_PX: i32 = 16;
/// Aperture of the Sobel operator in front of Canny's edges, pixels.
const APERTURE_PX: i32 = 3;

/// A detector of straight edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Detector {
    /// Fast line detector (Lee et al. 2014), which the paper uses: straight pieces of Canny's edges.
    Fld,
    /// Line segment detector (von Gioi et al. 2012): regions of one gradient direction.
    Lsd,
    /// Edge drawing (Akinlar and Topal 2011, 2020): chains of edge pixels drawn from anchor to anchor, cut into straight pieces
    /// that are not there by chance.
    Ed,
}

/// Which edges of an image count as segments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentOptions {
    /// The detector: `fld`, `lsd` or `ed`.
    pub detector: Detector,
    /// Shortest piece that the detector reports, before pieces are merged, pixels.
    pub piece_px: f64,
    /// Shortest segment that is kept, pixels.
    pub length_px: f64,
    /// `fld`: how far an edge pixel may be from its straight line, pixels.
    pub straightness_px: f64,
    /// `fld`: gradient at which an edge goes on, and gradient at which one begins (Canny's thresholds).
    pub canny: [f64; 2],
    /// Pieces at up to this angle to each other may be parts of one edge, degrees.
    pub merge_angle_deg: f64,
    /// The ends of the shorter piece may be this far from the line of the longer, pixels.
    pub merge_distance_px: f64,
    /// Pieces of one edge may have this gap between them, pixels; 0 and less merges only what overlaps.
    pub merge_gap_px: f64,
    /// Most segments of an image; the longest are kept.
    pub most: usize,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self {
            detector: Detector::Fld,
            piece_px: 10.0,
            length_px: 25.0,
            straightness_px: std::f64::consts::SQRT_2,
            canny: [50.0, 50.0],
            merge_angle_deg: 2.0,
            merge_distance_px: 1.5,
            merge_gap_px: 10.0,
            most: 400,
        }
    }
}

/// Straight edges of an image, as raster positions of their ends: (0, 0) is the middle of the top-left pixel.
///
/// The detector's pieces are drawn to the middle of the gradient across them, which takes off the detectors' own
/// conventions (up to half a pixel), pieces of one edge are merged, and short ones are left out. The brighter side of an
/// edge is not told by the order of its ends: a segment begins at its smaller x, or its smaller y where both are equal.
///
/// * `grey` — one channel of 8 bits.
///
/// Returns segments in the order of their ends; the same for the same image.
///
/// # Errors
/// [`Error::NotGrey`] for another kind of image; [`Error::OpenCv`] when the detector fails.
///
/// # Source
/// Open-Structure (Li et al. 2024), section III-A names the fast line detector and no options; merging and refinement are ours.
pub fn segments(grey: &Mat, options: &SegmentOptions) -> Result<Vec<[Point2<f64>; 2]>, Error> {
    let (channels, depth) = (grey.channels(), grey.depth());
    if channels != 1 || depth != CV_8U || grey.dims() > 2 {
        return Err(Error::NotGrey { channels, depth });
    }
    if grey.rows().min(grey.cols()) < LEAST_SIDE_PX {
        return Ok(Vec::new());
    }
    let own;
    let grey = if grey.is_continuous() {
        grey
    } else {
        own = grey.try_clone()?;
        &own
    };
    let picture = Grey::new(grey.data_typed::<u8>()?, grey.cols(), grey.rows());
    let pieces = detect(grey, options)?
        .into_iter()
        .filter(|piece| (piece[1] - piece[0]).norm() >= options.piece_px)
        .filter_map(|piece| refine(&picture, piece))
        .map(ordered)
        .collect();
    let mut found: Vec<_> = merge(sorted(pieces), options)
        .into_iter()
        .filter(|segment| (segment[1] - segment[0]).norm() >= options.length_px)
        .map(ordered)
        .collect();
    found = sorted(found);
    if found.len() > options.most {
        // Stable: of equal lengths, the first in order stays.
        found.sort_by(|a, b| (b[1] - b[0]).norm().total_cmp(&(a[1] - a[0]).norm()));
        found.truncate(options.most);
        found = sorted(found);
    }
    Ok(found)
}

/// What the detector says.
fn detect(grey: &Mat, options: &SegmentOptions) -> Result<Vec<[Point2<f64>; 2]>, Error> {
    let mut lines = Vector::<Vec4f>::new();
    match options.detector {
        Detector::Fld => {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "a length in pixels; what is longer saturates"
            )]
            let least = options.piece_px.max(1.0) as i32;
            #[expect(clippy::cast_possible_truncation, reason = "as OpenCV takes it")]
            let straightness = options.straightness_px as f32;
            let [on, begin] = options.canny;
            create_fast_line_detector(least, straightness, on, begin, APERTURE_PX, false)?
                .detect(grey, &mut lines)?;
        }
        Detector::Lsd => {
            let mut detector =
                create_line_segment_detector(LSD_REFINE_STD, 0.8, 0.6, 2.0, 22.5, 0.0, 0.7, 1024)?;
            detector.detect(grey, &mut lines, &mut no_array(), &mut no_array(), &mut no_array())?;
        }
        Detector::Ed => {
            let mut detector = create_edge_drawing()?;
            detector.detect_edges(grey)?;
            detector.detect_lines(&mut lines)?;
        }
    }
    let finite = |piece: &[Point2<f64>; 2]| piece.iter().all(|end| end.x.is_finite() && end.y.is_finite());
    Ok(lines
        .iter()
        .map(|Vec4f { 0: [x0, y0, x1, y1], .. }| [x0, y0, x1, y1].map(f64::from))
        .map(|[x0, y0, x1, y1]| [Point2::new(x0, y0), Point2::new(x1, y1)])
        .filter(finite)
        .collect())
}

fn key([a, b]: &[Point2<f64>; 2]) -> [f64; 4] {
    [a.x, a.y, b.x, b.y]
}

fn ordered(segment: [Point2<f64>; 2]) -> [Point2<f64>; 2] {
    let [a, b] = segment;
    if (b.x, b.y) < (a.x, a.y) { [b, a] } else { segment }
}

fn sorted(mut segments: Vec<[Point2<f64>; 2]>) -> Vec<[Point2<f64>; 2]> {
    segments.sort_by(|a, b| {
        let pairs = key(a).into_iter().zip(key(b));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    });
    segments
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use opencv::core::{CV_8UC3, Scalar};
    use proptest::prelude::*;

    const WIDTH: usize = 240;
    const HEIGHT: usize = 200;
    const DETECTORS: [Detector; 3] = [Detector::Fld, Detector::Lsd, Detector::Ed];

    /// An image of a function of raster positions, each pixel the mean of a square of `fine` × `fine` places.
    fn image(fine: u32, grey: impl Fn(Point2<f64>) -> f64) -> Mat {
        let mut pixels = Vec::with_capacity(WIDTH * HEIGHT);
        for row in 0..HEIGHT {
            for column in 0..WIDTH {
                let mut sum = 0.0;
                for place in 0..fine * fine {
                    let within = |step: u32| (f64::from(step) + 0.5) / f64::from(fine) - 0.5;
                    let offset = Vector2::new(within(place % fine), within(place / fine));
                    sum += grey(Point2::new(column as f64, row as f64) + offset);
                }
                pixels.push((sum / f64::from(fine * fine)).round() as u8);
            }
        }
        Mat::from_slice(&pixels).unwrap().reshape(1, HEIGHT as i32).unwrap().try_clone().unwrap()
    }

    fn found(image: &Mat, detector: Detector) -> Vec<[Point2<f64>; 2]> {
        segments(image, &SegmentOptions { detector, ..SegmentOptions::default() }).unwrap()
    }

    #[test]
    fn an_edge_between_two_columns_lies_between_them() {
        for (dark, bright) in [(60.0, 190.0), (190.0, 60.0)] {
            let upright = image(1, |p| if p.x < 99.5 { dark } else { bright });
            let level = image(1, |p| if p.y < 99.5 { dark } else { bright });
            for detector in DETECTORS {
                let [across, along] = [&upright, &level].map(|image| found(image, detector));
                assert_eq!((across.len(), along.len()), (1, 1), "{detector:?} {across:?} {along:?}");
                for end in 0..2 {
                    // The edge is as sharp as can be, and the grey between pixels linear: nothing is left but rounding.
                    assert!((across[0][end].x - 99.5).abs() < 1e-6, "{detector:?} {across:?}");
                    assert!((along[0][end].y - 99.5).abs() < 1e-6, "{detector:?} {along:?}");
                }
                assert!(
                    (across[0][1] - across[0][0]).norm() > 0.9 * HEIGHT as f64,
                    "{detector:?} {across:?}"
                );
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_slanted_edge_is_found_where_it_is(
            turn in 0.0..std::f64::consts::PI, shift in -20.0..20.0_f64, which in 0..2_usize,
        ) {
            let normal = Vector2::new(libm::cos(turn), libm::sin(turn));
            let middle = Point2::new(119.5, 99.5);
            let distance = |p: Point2<f64>| normal.dot(&(p - middle)) - shift;
            let found = found(&image(6, |p| if distance(p) < 0.0 { 70.0 } else { 180.0 }), DETECTORS[which]);
            prop_assert!(!found.is_empty());
            let length: f64 = found.iter().map(|[a, b]| (b - a).norm()).sum();
            prop_assert!(length > 80.0, "{length}");
            for segment in found {
                for end in segment {
                    // Pixels: grey in steps of a 256th and a pixel's linear interpolation leave a tenth.
                    prop_assert!(distance(end).abs() < 0.2, "{:?} {end} {}", DETECTORS[which], distance(end));
                }
            }
        }
    }

    #[test]
    fn a_broken_edge_is_one_segment_and_short_ones_are_left_out() {
        let broken = |gap: f64| {
            image(1, move |p| if p.x < 99.5 || (p.y - 100.0).abs() < gap / 2.0 { 60.0 } else { 190.0 })
        };
        let upright =
            |found: Vec<[Point2<f64>; 2]>| found.into_iter().filter(|[a, b]| (a.x - b.x).abs() < 1.0).count();
        assert_eq!(upright(found(&broken(4.0), Detector::Fld)), 1);
        assert_eq!(upright(found(&broken(40.0), Detector::Fld)), 2);
        let short =
            image(1, |p| if (p.x - 99.5).abs() < 9.0 && (p.y - 80.0).abs() < 9.0 { 60.0 } else { 190.0 });
        assert!(found(&short, Detector::Fld).is_empty());
    }

    #[test]
    fn the_longest_are_kept_and_all_stand_in_order() {
        let bars =
            image(
                1,
                |p| if (p.x / 24.0).floor() % 2.0 > 0.0 && p.y > 190.0 - p.x / 2.0 { 60.0 } else { 190.0 },
            );
        let all = segments(&bars, &SegmentOptions::default()).unwrap();
        assert!(all.len() > 6 && all.windows(2).all(|pair| key(&pair[0]) <= key(&pair[1])), "{all:?}");
        let some = segments(&bars, &SegmentOptions { most: 4, ..SegmentOptions::default() }).unwrap();
        let length = |segment: &[Point2<f64>; 2]| (segment[1] - segment[0]).norm();
        let least = some.iter().map(length).fold(f64::INFINITY, f64::min);
        assert_eq!(some.len(), 4);
        assert!(all.iter().filter(|segment| length(segment) > least).count() < 4);
        assert!(some.iter().all(|segment| all.contains(segment)));
    }

    #[test]
    fn what_is_not_a_grey_image_is_refused_and_a_tiny_one_is_empty() {
        let options = SegmentOptions::default();
        let colour = Mat::new_rows_cols_with_default(50, 50, CV_8UC3, Scalar::all(0.0)).unwrap();
        assert!(matches!(segments(&colour, &options), Err(Error::NotGrey { channels: 3, .. })));
        let tiny = Mat::new_rows_cols_with_default(4, 50, CV_8U, Scalar::all(0.0)).unwrap();
        for image in [tiny, Mat::default()] {
            assert_eq!(segments(&image, &options).unwrap(), Vec::<[Point2<f64>; 2]>::new());
        }
        let noise = image(1, |p| (p.x * 7919.0 + p.y * 104_729.0).rem_euclid(256.0).floor());
        let odd = SegmentOptions { piece_px: f64::NAN, merge_angle_deg: f64::NAN, ..options };
        for detector in DETECTORS {
            assert!(segments(&noise, &SegmentOptions { detector, ..odd.clone() }).is_ok());
        }
    }
}
