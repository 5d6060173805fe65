//! A frame's image with what was detected in it and what was made of it.

use std::path::Path;

use nalgebra::Point2;
use opencv::core::{Mat, MatTraitConst as _, Point, Scalar, Vector};
use opencv::{imgcodecs, imgproc};

use super::{Error, Generated, Options};
use crate::detect::{self, PointDetector, segments};
use crate::rgbd::{RawFrame, RawSequence};

/// Positions are drawn to a sixteenth of a pixel.
const SHIFT: i32 = 4;
/// Blue, green and red of a detected feature.
const DETECTED: [f64; 3] = [255.0, 120.0, 40.0];
/// Of a point that is observed, and of a line in no group.
const OBSERVED: [f64; 3] = [80.0, 220.0, 60.0];
/// Of lines of the first groups; later ones begin again.
const GROUPS: [[f64; 3]; 6] = [
    [60.0, 60.0, 240.0],
    [0.0, 190.0, 250.0],
    [220.0, 80.0, 200.0],
    [230.0, 210.0, 0.0],
    [120.0, 180.0, 250.0],
    [180.0, 130.0, 90.0],
];

/// Draws a frame of a sequence as PNG, as large as its images: detected points and segments in blue, observations in green,
/// those of lines in the colour of their group.
///
/// As the paper's figure of detected features and generated measurements. Observations are drawn where the pixels of the image
/// show them, so with the distortion of its lens.
///
/// # Errors
/// Those of reading and detecting; [`Error::Picture`] where the picture cannot be written.
pub fn overlay(
    raw: &RawSequence,
    generated: &Generated,
    options: &Options,
    index: usize,
    path: &Path,
) -> Result<(), Error> {
    let Some(bundle) = generated.frame(index) else { return Ok(()) };
    let same = |frame: &&RawFrame| frame.frame_id == bundle.frame.frame_id;
    let Some(frame) = raw.frames.iter().find(same) else { return Ok(()) };
    let grey = raw.grey(frame)?;
    let refused = |cause| Error::Detect { path: frame.colour.clone(), cause };
    let unwritten = |detail: String| Error::Picture { path: path.to_owned(), detail };
    let drawn = |error: opencv::Error| unwritten(error.message);

    // Paler, so that colours stand out.
    let (mut pale, mut picture) = (Mat::default(), Mat::default());
    grey.convert_to(&mut pale, -1, 0.6, 90.0).map_err(drawn)?;
    imgproc::cvt_color_def(&pale, &mut picture, imgproc::COLOR_GRAY2BGR).map_err(drawn)?;
    let points = PointDetector::new(options.points).and_then(|mut detector| detector.detect(&grey));
    for point in points.map_err(refused)? {
        circle(&mut picture, point.raster, 3.0, DETECTED, 1).map_err(drawn)?;
    }
    let found: Result<_, detect::Error> = segments(&grey, &options.segments);
    for segment in found.map_err(refused)? {
        line(&mut picture, segment, DETECTED, 2).map_err(drawn)?;
    }
    let raster = raw.raster();
    let place = |u: f64, v: f64| raster.raster(Point2::new(u, v));
    let (_, _, groups) = generated.landmarks();
    for row in &bundle.line_observations {
        let group = groups.iter().position(|group| group.line_ids.binary_search(&row.line_id).is_ok());
        let colour = group.map_or(OBSERVED, |group| GROUPS[group % GROUPS.len()]);
        if let Some(ends) = place(row.start_u, row.start_v).zip(place(row.end_u, row.end_v)) {
            line(&mut picture, ends.into(), colour, 1).map_err(drawn)?;
        }
    }
    for row in &bundle.point_observations {
        if let Some(position) = place(row.u, row.v) {
            circle(&mut picture, position, 1.5, OBSERVED, -1).map_err(drawn)?;
        }
    }
    let mut bytes = Vector::<u8>::new();
    imgcodecs::imencode_def(".png", &picture, &mut bytes).map_err(drawn)?;
    std::fs::write(path, bytes.as_slice()).map_err(|error| unwritten(error.to_string()))
}

#[expect(clippy::cast_possible_truncation, reason = "positions within an image")]
fn fixed(position: Point2<f64>) -> Point {
    let fixed = |value: f64| (value * f64::from(1 << SHIFT)).round() as i32;
    Point::new(fixed(position.x), fixed(position.y))
}

fn scalar([blue, green, red]: [f64; 3]) -> Scalar {
    Scalar::new(blue, green, red, 0.0)
}

#[expect(clippy::cast_possible_truncation, reason = "a few pixels")]
fn circle(
    picture: &mut Mat,
    centre: Point2<f64>,
    radius_px: f64,
    colour: [f64; 3],
    thickness: i32,
) -> opencv::Result<()> {
    let radius = (radius_px * f64::from(1 << SHIFT)) as i32;
    imgproc::circle(picture, fixed(centre), radius, scalar(colour), thickness, imgproc::LINE_AA, SHIFT)
}

fn line(picture: &mut Mat, ends: [Point2<f64>; 2], colour: [f64; 3], thickness: i32) -> opencv::Result<()> {
    let [start, end] = ends.map(fixed);
    imgproc::line(picture, start, end, scalar(colour), thickness, imgproc::LINE_AA, SHIFT)
}
