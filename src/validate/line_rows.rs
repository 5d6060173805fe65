//! Observations and measurements of lines: pixels, depths, residuals against the truth.

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3, Vector4};

use super::finding::{Detail, Findings};
use super::fit::Fit;
use super::frame_rows::{FrameRows, Pixels};
use super::frames::{CameraFromWorld, View};
use super::ids::Unknown;
use super::landmarks::LineEntry;
use super::noise::{Residual, Sample};
use super::point_rows::{NEAREST_Z, REPROJECTION_PX, Seen, outside, stray};
use super::rules::RuleId;
use super::tables::{Shared, check};
use super::world::World;
use crate::structure::{LineMeasurement, LineObservation, Record};

/// Depth at a pixel may change by at most this part of its sigma with the pixel's noise, or it is not judged.
const DEPTH_SENSITIVITY: f64 = 0.3;

/// One end of a segment in an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    pixel: [f64; 2],
    depth: Option<f64>,
}

/// A row that shows a line.
pub(crate) trait LineRow: Record {
    /// Whether the row carries noise.
    const MEASURED: bool;
    /// Frame, line, both ends.
    fn parts(&self) -> (i64, i64, [End; 2]);
}

macro_rules! line_row {
    ($name:ident, $measured:literal) => {
        impl LineRow for $name {
            const MEASURED: bool = $measured;
            #[inline]
            fn parts(&self) -> (i64, i64, [End; 2]) {
                let start = End { pixel: [self.start_u, self.start_v], depth: self.start_depth };
                let end = End { pixel: [self.end_u, self.end_v], depth: self.end_depth };
                (self.frame_id.0, self.line_id.0, [start, end])
            }
        }
    };
}
line_row!(LineObservation, false);
line_row!(LineMeasurement, true);

/// A line with the four directions in which it can move: two shifts of its middle across it, metres, and two
/// turns about the middle, metres at an end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Movable {
    direction: Vector3<f64>,
    moment: Vector3<f64>,
    middle: Vector3<f64>,
    moment_by: [Vector3<f64>; 4],
    direction_by: [Vector3<f64>; 4],
}

impl Movable {
    pub(crate) fn new(line: &LineEntry) -> Option<Self> {
        let direction = line.direction?;
        let middle = line.middle.coords;
        if !(middle.iter().all(|part| part.is_finite()) && line.half_length > 0.0) {
            return None;
        }
        let axis = Vector3::ith_axis(direction.iamin()).into_inner();
        let first = (axis - direction * direction.dot(&axis)).normalize();
        let second = direction.cross(&first);
        let turn = line.half_length.recip();
        let zero = Vector3::zeros();
        Some(Self {
            direction,
            moment: middle.cross(&direction),
            middle,
            moment_by: [
                first.cross(&direction),
                second.cross(&direction),
                middle.cross(&first) * turn,
                middle.cross(&second) * turn,
            ],
            direction_by: [zero, zero, first * turn, second * turn],
        })
    }
}

/// The image of a line through a true pose: `l · (u, v, 1) = 0`, scaled to distances in pixels.
struct LineImage<'a> {
    line: &'a Movable,
    pose: &'a CameraFromWorld,
    view: &'a View,
    line_matrix: Matrix3<f64>,
    image: Vector3<f64>,
    scale: f64,
}

impl<'a> LineImage<'a> {
    /// `None` when the line has no image, as when it passes through the camera.
    #[inline]
    fn new(line: &'a Movable, pose: &'a CameraFromWorld, view: &'a View) -> Option<Self> {
        let direction = pose.rotation * line.direction;
        let moment = pose.rotation * line.moment + pose.translation.cross(&direction);
        let line_matrix = view.pinhole.line_matrix();
        let image = line_matrix * moment;
        let scale = image.x.hypot(image.y);
        let rounding = 1e-12 * (image.z.abs() + 1.0);
        (scale > rounding && scale.is_finite()).then_some(Self {
            line,
            pose,
            view,
            line_matrix,
            image,
            scale,
        })
    }

    /// Signed distance of a pixel, pixels, and its derivative by the four directions.
    #[inline]
    fn residual(&self, [u, v]: [f64; 2]) -> (f64, Vector4<f64>) {
        let residual = (self.image.x * u + self.image.y * v + self.image.z) / self.scale;
        let (across_x, across_y) = (self.image.x / self.scale, self.image.y / self.scale);
        let by_image = Vector3::new(u - residual * across_x, v - residual * across_y, 1.0) / self.scale;
        let by_moment = self.line_matrix.tr_mul(&by_image);
        let by_direction = self.pose.rotation.tr_mul(&by_moment.cross(&self.pose.translation));
        let by_moment = self.pose.rotation.tr_mul(&by_moment);
        let derivative = Vector4::from_fn(|row, _| {
            by_moment.dot(&self.line.moment_by[row]) + by_direction.dot(&self.line.direction_by[row])
        });
        (residual, derivative)
    }

    /// Depth of the line where a pixel sees it, and how much it changes with a pixel along the image, metres.
    fn depth(&self, [u, v]: [f64; 2]) -> Option<(f64, f64)> {
        let camera = &self.view.pinhole;
        let direction = self.pose.rotation * self.line.direction;
        let middle = self.pose.rotation * self.line.middle + self.pose.translation;
        // fx (m_x + s d_x) = (u − cx) (m_z + s d_z), and the same for v: the two in least squares.
        let (x, y) = (u - camera.cx, v - camera.cy);
        let slope = [camera.fx * direction.x - x * direction.z, camera.fy * direction.y - y * direction.z];
        let offset = [camera.fx * middle.x - x * middle.z, camera.fy * middle.y - y * middle.z];
        let norm = slope[0] * slope[0] + slope[1] * slope[1];
        let along = -(slope[0] * offset[0] + slope[1] * offset[1]) / norm;
        let z = middle.z + along * direction.z;
        // A step ds moves the pixel by |slope|/z ds.
        let by_pixel = direction.z.abs() * z / norm.sqrt();
        (z > NEAREST_Z && by_pixel.is_finite()).then_some((z, by_pixel))
    }
}

/// Checks a table of lines.
pub(crate) fn lines<R: LineRow>(
    shared: &Shared<'_>,
    world: &World<'_>,
    hashed: bool,
    counted: bool,
    findings: &mut Findings,
) -> Seen<4> {
    let table = R::TABLE.name;
    let movable: Vec<Option<Movable>> =
        world.lines.map_or_else(Vec::new, |lines| lines.places.iter().map(Movable::new).collect());
    let mut books = FrameRows::new::<R>(world, hashed, counted);
    let mut unknown = Unknown::default();
    let (mut shown, mut fits) = (vec![false; movable.len()], vec![Fit::<4>::default(); movable.len()]);
    let (mut sample, mut astray) = (Sample::default(), HashMap::new());
    let margin = if R::MEASURED { world.noise.margin_px() } else { 1.0 };
    let outcome = check::<R>(shared, findings, |batch, first_row, log_time, findings| {
        books.message(batch.iter().map(|row| row.parts().0), first_row, log_time, findings);
        for (row, entry) in (first_row..).zip(batch) {
            let (frame_id, line_id, ends) = entry.parts();
            segment(ends, table, row, frame_id, line_id, findings);
            let frame = books.frame(frame_id, line_id, row);
            let landmark = world.lines.and_then(|lines| {
                let place = lines.index.get(line_id);
                match place {
                    Some(place) => shown[place] = true,
                    None => unknown.add(line_id, row),
                }
                place
            });
            let Some((place, frame)) = frame else { continue };
            books.count(place, line_id, Pixels::Segment(ends.map(|end| end.pixel)));
            let Some(view) = frame.camera.and_then(|camera| world.views[camera].as_ref()) else { continue };
            for end in ends.iter().filter(|end| !view.contains(end.pixel[0], end.pixel[1], margin)) {
                outside(view, end.pixel, margin, table, row, &format!("line {line_id}"), findings);
            }
            let (Some(landmark), Some(pose)) = (landmark, &frame.pose) else { continue };
            let Some(line) = &movable[landmark] else { continue };
            let Some(image) = LineImage::new(line, pose, view) else {
                fits[landmark].add_behind();
                continue;
            };
            let [start, end] = ends.map(|end| image.residual(end.pixel));
            if !(start.0.is_finite() && end.0.is_finite()) {
                continue;
            }
            let residuals = [start.0, end.0];
            if R::MEASURED && world.noise.is_outlier(residuals) {
                fits[landmark].add_wild();
                continue;
            }
            // A segment without length says nothing of a line's direction, nor of its place along.
            if !coincide(ends) {
                fits[landmark].add(residuals, &[start.1, end.1]);
            }
            let landmark = u32::try_from(landmark).unwrap_or(u32::MAX);
            if R::MEASURED {
                let takes = sample.takes_next();
                let depths =
                    ends.map(|end| if takes { depth_residual(&image, end, world) } else { f64::NAN });
                sample.add(Residual { landmark, pixels: residuals, depths });
            } else {
                let worst = residuals[0].abs().max(residuals[1].abs());
                if worst > REPROJECTION_PX {
                    stray(&mut astray, landmark, row, || {
                        let expected =
                            format!("both ends within 0.5 px of the line's image in frame {frame_id}");
                        (expected, format!("an end {worst:.3} px away"))
                    });
                }
            }
        }
    });
    unknown.report(RuleId::LandmarkKnown, table, "line", "line_landmarks", findings);
    let books = books.finish(findings);
    Seen { outcome, books, shown, fits, sample, astray }
}

/// Whether both ends are the same pixel, digit by digit.
#[expect(clippy::float_cmp, reason = "ends that differ at all have a direction")]
fn coincide([start, end]: [End; 2]) -> bool {
    start.pixel[0] == end.pixel[0] && start.pixel[1] == end.pixel[1]
}

fn segment(
    ends: [End; 2],
    table: &'static str,
    row: u64,
    frame_id: i64,
    line_id: i64,
    findings: &mut Findings,
) {
    for depth in ends.iter().filter_map(|end| end.depth).filter(|depth| *depth <= 0.0) {
        findings.add(RuleId::DepthPositive, Some(table), || {
            let found = format!("{depth} m in frame {frame_id}");
            Detail::new("a depth over 0 m", found).row(row).id(format!("line {line_id}"))
        });
    }
    if coincide(ends) {
        findings.add(RuleId::SegmentPixelsDistinct, Some(table), || {
            let [u, v] = ends[0].pixel;
            let found = format!("both at ({u}, {v}) in frame {frame_id}");
            Detail::new("two different ends", found).row(row).id(format!("line {line_id}"))
        });
    }
}

/// The depth residual of an end; NaN where there is none, or where the pixel's noise would drown it.
fn depth_residual(image: &LineImage<'_>, end: End, world: &World<'_>) -> f64 {
    let (Some(noise), Some(measured)) = (world.noise.depth, end.depth) else { return f64::NAN };
    let sigma_px = world.noise.sigma_along_px();
    match image.depth(end.pixel) {
        Some((z, by_pixel)) if by_pixel * sigma_px <= DEPTH_SENSITIVITY * noise.sigma_m(z) => {
            noise.residual(measured, z)
        }
        _ => f64::NAN,
    }
}
