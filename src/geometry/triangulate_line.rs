//! An endless line from the segments cameras saw of it.

use super::direction::unsigned_angle;
use super::least_squares::{Normal, minimise};
use super::parallax::{LEAST_PARALLAX, is_one_place, widest_angle};
use super::{OrthonormalLine, PinholeCamera, PluckerLine, Pose};
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3x4, Matrix4, Matrix4x2, Point2, Point3, Vector3, Vector4};

/// One observation of a line: camera, `camera_from_world`, start and end pixel.
pub type LineView = (PinholeCamera, Pose, [Point2<f64>; 2]);

/// A triangulated line and how well its observations agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineTriangulation {
    /// The line in the world, metres, directed as the longest segment runs from start to end.
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
/// Iterates in the orthonormal form from three linear solutions over `Σ π πᵀ`, the sum of the planes through cameras and segments, and keeps
/// the best end: one start is nearly exact without noise, two are not drawn towards the cameras by noise when the parallax is small.
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
    // The longest segment names its plane best. Its camera is the origin, for a line it sees passes at a distance.
    let reference = used().max_by(|a, b| length_px(a).total_cmp(&length_px(b)))?;
    let centre = centre_of(&reference.1);
    let spread = used().map(|view| (centre_of(&view.1) - centre).norm()).fold(0.0, f64::max);
    if count < 2 || is_one_place(spread, centre.coords.norm()) {
        return None;
    }

    let planes = sum_of_planes(observations, &Gauge { centre, unit_m: spread })?;
    let in_front = |line: &PluckerLine| 2 * used().filter(|view| is_in_front(view, line)).count() >= count;
    let (mut line, cost) =
        [by_rays(&planes, reference), by_one_depth(&planes, reference), by_eigenvectors(&planes)]
            .into_iter()
            .flatten()
            .filter_map(|start| {
                // The line's distance becomes the unit of length, so that turning and moving it are of one size.
                let gauge = Gauge { centre, unit_m: spread * start.moment.norm() };
                let start = PluckerLine { moment: start.moment.normalize(), ..start };
                let distances = |line: &OrthonormalLine| distances(observations, &gauge, line);
                let (form, normal) = minimise(start.orthonormal(), distances, OrthonormalLine::update)?;
                Some((gauge.to_world(&form.plucker()), normal.cost))
            })
            .filter(|(line, cost)| cost.is_finite() && is_finite(line) && in_front(line))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;

    if line.transformed(&reference.1).moment.dot(&plane_normal(reference)) < 0.0 {
        line = PluckerLine { moment: -line.moment, direction: -line.direction };
    }
    let plane = |view: &LineView| {
        let centre = centre_of(&view.1);
        (line.closest_point_to(centre) - centre).cross(&line.direction)
    };
    let planes: Vec<Vector3<f64>> = used().map(plane).collect();
    let parallax = widest_angle(&planes.iter(), unsigned_angle);
    let rms_px = (cost / count as f64).sqrt();
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

/// Whether all six numbers are finite.
fn is_finite(line: &PluckerLine) -> bool {
    line.moment.iter().chain(&line.direction).all(|number| number.is_finite())
}

/// Length of a segment, pixels.
fn length_px((_, _, [start, end]): &LineView) -> f64 {
    (end - start).norm()
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

/// `Σ π πᵀ` over the planes of all segments, in the gauge; `None` when it is not finite.
fn sum_of_planes(observations: &[LineView], gauge: &Gauge) -> Option<Matrix4<f64>> {
    let mut sum = Matrix4::<f64>::zeros();
    for view in observations.iter().filter(|view| has_length(view)) {
        let normal_in_camera = plane_normal(view);
        let normal = view.1.rotation().inverse() * normal_in_camera;
        let plane = normal.push(normal_in_camera.dot(&gauge.translation(&view.1)));
        sum.ger(1.0, &plane, &plane, 1.0);
    }
    sum.iter().all(|entry| entry.is_finite()).then_some(sum)
}

/// The line through the two homogeneous points that miss the planes least: the two least eigenvectors.
///
/// `None` when all planes are one, or meet at infinity.
fn by_eigenvectors(planes: &Matrix4<f64>) -> Option<PluckerLine> {
    let eigen = SymmetricEigen::try_new(*planes, f64::EPSILON, 200)?;
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // The squared sine of 1e-6 rad is 1e-12; under 1e-14 the second plane is rounding.
    if eigen.eigenvalues[order[2]] <= 1e-14 * eigen.eigenvalues[order[3]] {
        return None;
    }
    let [a, b] = [order[0], order[1]].map(|column| eigen.eigenvectors.column(column).into_owned());
    join(&a, &b)
}

/// The line through one point on the ray of each end of the reference segment, at the inverse depth that misses the planes least.
///
/// The point is `(r + α m, ρ)` with the ray `r`, the normal `m` of the reference's own plane, and `α`, `ρ` from linear least squares.
fn by_rays(planes: &Matrix4<f64>, reference: &LineView) -> Option<PluckerLine> {
    let across = (reference.1.rotation().inverse() * plane_normal(reference)).normalize().push(0.0);
    let by = Matrix4x2::from_columns(&[across, Vector4::w()]);
    let system = by.tr_mul(&(planes * by)).cholesky()?;
    let [start, end] = rays(reference).map(|ray| ray - by * system.solve(&by.tr_mul(&(planes * ray))));
    join(&start, &end)
}

/// As [`by_rays`], with one inverse depth for both ends: all that short segments can tell.
fn by_one_depth(planes: &Matrix4<f64>, reference: &LineView) -> Option<PluckerLine> {
    let [start, end] = rays(reference);
    let depth = Vector4::w() * (-(planes * (start + end)).w / (2.0 * planes.m44));
    join(&(start + depth), &(end + depth))
}

/// The rays of both ends of a segment, as homogeneous points at infinity with the axes of the world.
fn rays((camera, camera_from_world, ends): &LineView) -> [Vector4<f64>; 2] {
    let world_from_camera = camera_from_world.rotation().inverse();
    ends.map(|pixel| (world_from_camera * camera.normalised(pixel)).push(0.0))
}

/// The line through two homogeneous points; `None` when it is at infinity or passes through the origin, the reference camera.
fn join(a: &Vector4<f64>, b: &Vector4<f64>) -> Option<PluckerLine> {
    let line = PluckerLine::new(a.xyz().cross(&b.xyz()), b.xyz() * a.w - a.xyz() * b.w).ok()?;
    (line.moment.norm() > 1e-12).then_some(line)
}

/// Normal equations of all distances at a line in the gauge; `None` where the line has no image.
fn distances(observations: &[LineView], gauge: &Gauge, line: &OrthonormalLine) -> Option<Normal<4>> {
    let frame = line.frame();
    let [u1, u2, u3] = [0, 1, 2].map(|column| frame.column(column).into_owned());
    let (sin, cos) = libm::sincos(line.varphi);
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
        let scale = libm::hypot(image.x, image.y);
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
