//! An endless line from the segments cameras saw of it.

use super::direction::unsigned_angle;
use super::least_squares::{Normal, minimise};
use super::parallax::{LEAST_PARALLAX, is_one_place, widest_angle};
use super::{OrthonormalLine, PinholeCamera, PluckerLine, Pose};
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3x4, Matrix4, Point2, Point3, Vector3, Vector4};

/// One observation of a line: camera, `camera_from_world`, start and end pixel.
pub type LineView = (PinholeCamera, Pose, [Point2<f64>; 2]);

/// A triangulated line and how well its observations agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineTriangulation {
    /// The line in the world, metres, directed as the first segment runs from start to end.
    pub line: PluckerLine,
    /// Root mean square of all residuals (distances of segment ends from the line's image), two to an observation, pixels.
    pub rms_px: f64,
    /// Widest angle between two planes through a camera and the line, radians; found by sweeps, at least half of the true one.
    pub parallax: f64,
    /// Observations used.
    pub count: usize,
    /// Observations left out because their segment has length zero.
    pub skipped: usize,
}

/// The line with the least squared distances of the segments' ends from its image.
///
/// `min Σ |r_l|²`, `r_l` as in [`line_residual`](super::line_residual)
///
/// Starts from the line in which the planes through cameras and segments meet (the two least eigenvectors of their sum `Σ π πᵀ`) and
/// iterates in the orthonormal form.
///
/// * `observations` — camera, pose of the world in the camera (metres), both ends of the segment (pixels). Ends need not match between
///   observations, nor their order.
///
/// `None` when fewer than two segments, planes at less than 1e-6 rad to each other, or numbers that are not finite leave the line open, or
/// when it would lie behind most of the cameras.
///
/// # Source
/// Bartoli and Sturm 2005, *Structure-from-motion using lines*: linear triangulation and orthonormal update.
#[must_use]
pub fn triangulate_line(observations: &[LineView]) -> Option<LineTriangulation> {
    let used = || observations.iter().filter(|view| has_length(view));
    let count = used().count();
    let first = used().next()?;
    let centre = centre_of(&first.1);
    let spread = used().map(|view| (centre_of(&view.1) - centre).norm()).fold(0.0, f64::max);
    if count < 2 || is_one_place(spread, centre.coords.norm()) {
        return None;
    }

    // The first camera is the origin, for a line it sees passes at a distance, which becomes the unit of length.
    let coarse = meet(observations, &Gauge { centre, unit_m: spread })?;
    let gauge = Gauge { centre, unit_m: spread * coarse.moment.norm() };
    let start =
        meet(observations, &gauge).unwrap_or(PluckerLine { moment: coarse.moment.normalize(), ..coarse });
    let distances = |line: &OrthonormalLine| distances(observations, &gauge, line);
    let (form, normal) = minimise(start.orthonormal(), distances, OrthonormalLine::update)?;

    let mut line = gauge.to_world(&form.plucker());
    if line.moment.iter().chain(line.direction.iter()).any(|number| !number.is_finite()) {
        return None;
    }
    if line.transformed(&first.1).moment.dot(&plane_normal(first)) < 0.0 {
        line = PluckerLine { moment: -line.moment, direction: -line.direction };
    }
    let behind = used().filter(|view| !is_in_front(view, &line)).count();
    if 2 * behind > count {
        return None;
    }
    let plane = |view: &LineView| {
        (line.closest_point_to(centre_of(&view.1)) - centre_of(&view.1)).cross(&line.direction)
    };
    let parallax = widest_angle(observations.len(), |a, b| {
        let (a, b) = (&observations[a], &observations[b]);
        if has_length(a) && has_length(b) { unsigned_angle(&plane(a), &plane(b)) } else { 0.0 }
    });
    let rms_px = (normal.cost / count as f64).sqrt();
    let skipped = observations.len() - count;
    (parallax >= LEAST_PARALLAX).then_some(LineTriangulation { line, rms_px, parallax, count, skipped })
}

/// Origin and unit of length in which a line is sought.
struct Gauge {
    /// Origin in the world, metres.
    centre: Point3<f64>,
    /// Length of one unit, metres.
    unit_m: f64,
}

impl Gauge {
    /// The translation of `camera_from_gauge`, units.
    fn translation(&self, camera_from_world: &Pose) -> Vector3<f64> {
        (camera_from_world * self.centre).coords / self.unit_m
    }

    /// A line in the gauge as a line in the world.
    fn to_world(&self, line: &PluckerLine) -> PluckerLine {
        let moment = line.moment * self.unit_m + self.centre.coords.cross(&line.direction);
        PluckerLine { moment, direction: line.direction }
    }
}

/// Whether a segment has a direction.
fn has_length((_, _, [start, end]): &LineView) -> bool {
    start != end
}

/// Where a camera stands in the world, metres.
fn centre_of(camera_from_world: &Pose) -> Point3<f64> {
    Point3::from(camera_from_world.inverse().translation())
}

/// Normal of the plane through camera and segment, in the camera; its length is about the segment's, in focal lengths.
fn plane_normal((camera, _, [start, end]): &LineView) -> Vector3<f64> {
    camera.normalised(*start).cross(&camera.normalised(*end))
}

/// Whether the middle of a segment sees the line in front of its camera.
fn is_in_front(view: &LineView, line: &PluckerLine) -> bool {
    let (camera, camera_from_world, [start, end]) = view;
    let in_camera = line.transformed(camera_from_world);
    // Where the ray r and the line meet, p = s r: n = p × d = s (r × d).
    let ray = camera.normalised(nalgebra::center(start, end));
    ray.cross(&in_camera.direction).dot(&in_camera.moment) > 0.0
}

/// The line in which the planes of all segments meet, in the gauge; `None` when they are all one plane, or meet at infinity.
fn meet(observations: &[LineView], gauge: &Gauge) -> Option<PluckerLine> {
    let mut sum = Matrix4::<f64>::zeros();
    for view in observations.iter().filter(|view| has_length(view)) {
        let normal_in_camera = plane_normal(view);
        let normal = view.1.rotation().inverse() * normal_in_camera;
        let plane = normal.push(normal_in_camera.dot(&gauge.translation(&view.1)));
        sum.ger(1.0, &plane, &plane, 1.0);
    }
    if !sum.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::try_new(sum, f64::EPSILON, 200)?;
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // The squared sine of 1e-6 rad is 1e-12; under 1e-14 the second plane is rounding.
    if eigen.eigenvalues[order[2]] <= 1e-14 * eigen.eigenvalues[order[3]] {
        return None;
    }
    let [a, b] = [order[0], order[1]].map(|column| eigen.eigenvectors.column(column).into_owned());
    let moment = a.xyz().cross(&b.xyz());
    let direction = b.xyz() * a.w - a.xyz() * b.w;
    let line = PluckerLine::new(moment, direction).ok()?;
    // A line through the origin would be one through the first camera, which has no image.
    (line.moment.norm() > 1e-12).then_some(line)
}

/// Normal equations of all distances at a line in the gauge; `None` where the line has no image.
fn distances(observations: &[LineView], gauge: &Gauge, line: &OrthonormalLine) -> Option<Normal<4>> {
    let frame = line.frame();
    let [u1, u2, u3] = [0, 1, 2].map(|column| frame.column(column).into_owned());
    let (sin, cos) = line.varphi.sin_cos();
    let zero = Vector3::zeros();
    // n = cos φ · u₁ and d = sin φ · u₂ (their common scale is free), and their derivatives by δ.
    let (moment, direction) = (u1 * cos, u2 * sin);
    let moment_by = Matrix3x4::from_columns(&[zero, u3 * -cos, u2 * cos, u1 * -sin]);
    let direction_by = Matrix3x4::from_columns(&[u3 * sin, zero, u1 * -sin, u2 * cos]);

    let mut normal = Normal::new();
    for view in observations.iter().filter(|view| has_length(view)) {
        let (camera, camera_from_world, ends) = view;
        let rotation = camera_from_world.rotation_matrix();
        let shift = gauge.translation(camera_from_world).cross_matrix() * rotation;
        let in_camera = rotation * moment + shift * direction;
        let in_camera_by = rotation * moment_by + shift * direction_by;
        let line_matrix = camera.line_matrix();
        let image = line_matrix * in_camera;
        let scale = image.x.hypot(image.y);
        if scale.is_nan() || scale <= 1e-12 * image.z.abs() {
            return None;
        }
        let image_by = line_matrix * in_camera_by;
        for end in ends {
            let residual = (image.x * end.x + image.y * end.y + image.z) / scale;
            let (across_x, across_y) = (image.x / scale, image.y / scale);
            let by_image =
                Vector3::new(end.x - residual * across_x, end.y - residual * across_y, 1.0) / scale;
            let derivative: Vector4<f64> = image_by.tr_mul(&by_image);
            normal.add(residual, &derivative);
        }
    }
    Some(normal)
}

#[cfg(test)]
mod tests;
