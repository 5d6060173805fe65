//! Straight edges of an image.

use nalgebra::Point2;
use opencv::core::{CV_8U, Mat, MatTraitConst as _, MatTraitConstManual as _, Vec4f, Vector, no_array};
use opencv::imgproc::{LSD_REFINE_STD, LineSegmentDetectorTrait as _, create_line_segment_detector};
use opencv::ximgproc::{FastLineDetectorTrait as _, create_fast_line_detector};
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
}

/// Which edges of an image count as segments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentOptions {
    /// The detector: `fld` or `lsd`.
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
