//! What a frame measured, drawn on its image.

use ::foxglove::messages::points_annotation::Type;
use ::foxglove::messages::{Color, ImageAnnotations, Point2, PointsAnnotation};

use super::color::{GroupColors, POINT};
use super::timestamp;
use super::viewer_space::from_corner;
use crate::format::writer::FrameRows;
use crate::structure::{Camera, LineId};

/// Size of a point, pixels.
const POINT_SIZE: f64 = 4.0;
/// Thickness of a segment, pixels.
const LINE_THICKNESS: f64 = 2.0;

/// Points and segments of a frame: its measurements, or its observations if it has no measurement.
///
/// A frame without either gives an empty message, which takes the last frame's drawings away.
pub(super) fn annotations(
    camera: &Camera,
    rows: FrameRows<'_>,
    colors: &GroupColors,
    stamp: u64,
) -> ImageAnnotations {
    let measured = !(rows.point_measurements.is_empty() && rows.line_measurements.is_empty());
    let pixel = |position: [f64; 2]| {
        let [x, y] = from_corner(camera, position);
        Point2 { x, y }
    };
    let (points, lines): (Vec<Point2>, Vec<(LineId, [Point2; 2])>) = if measured {
        (
            rows.point_measurements.iter().map(|row| pixel([row.u, row.v])).collect(),
            rows.line_measurements
                .iter()
                .map(|row| (row.line_id, [[row.start_u, row.start_v], [row.end_u, row.end_v]].map(pixel)))
                .collect(),
        )
    } else {
        (
            rows.point_observations.iter().map(|row| pixel([row.u, row.v])).collect(),
            rows.line_observations
                .iter()
                .map(|row| (row.line_id, [[row.start_u, row.start_v], [row.end_u, row.end_v]].map(pixel)))
                .collect(),
        )
    };
    let draw = |kind: Type, points: Vec<Point2>, color: Color, thickness: f64| PointsAnnotation {
        timestamp: Some(timestamp(stamp)),
        r#type: kind as i32,
        points,
        outline_color: Some(color),
        outline_colors: Vec::new(),
        fill_color: Some(color),
        thickness,
        metadata: Vec::new(),
    };
    let mut drawn: Vec<PointsAnnotation> = colors
        .by_color(lines.into_iter())
        .into_iter()
        .map(|(color, segments)| draw(Type::LineList, segments.concat(), color, LINE_THICKNESS))
        .collect();
    if !points.is_empty() {
        drawn.push(draw(Type::Points, points, POINT, POINT_SIZE));
    }
    ImageAnnotations { timestamp: Some(timestamp(stamp)), points: drawn, ..ImageAnnotations::default() }
}
