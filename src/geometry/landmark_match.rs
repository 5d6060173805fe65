//! A landmark with its uncertainty, and where one frame measured it.

use super::camera::NEAREST_Z;
use super::direction::perpendicular;
use super::product::product;
use super::{PinholeCamera, Pose, Segment};
use nalgebra::{
    Matrix2, Matrix3, Matrix3x2, Matrix4, Point2, Point3, RowVector3, SMatrix, SVector, Vector2, Vector3,
    Vector6,
};

/// A depth along the optical axis (z), and the space in which its noise is normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeasuredDepth {
    /// Depth itself was measured.
    Direct {
        /// Depth, metres.
        depth_m: f64,
        /// Standard deviation, metres.
        sigma_m: f64,
    },
    /// Its inverse was measured, as by disparity.
    Inverse {
        /// Depth, metres.
        depth_m: f64,
        /// Standard deviation of the inverse, 1/m.
        sigma_per_m: f64,
    },
}

impl MeasuredDepth {
    /// The depth, metres.
    #[must_use]
    pub fn depth_m(&self) -> f64 {
        match *self {
            Self::Direct { depth_m, .. } | Self::Inverse { depth_m, .. } => depth_m,
        }
    }

    /// Standard deviation of the depth, metres; of an inverse one to first order.
    #[must_use]
    pub fn sigma_m(&self) -> f64 {
        match *self {
            Self::Direct { sigma_m, .. } => sigma_m,
            Self::Inverse { depth_m, sigma_per_m } => sigma_per_m * depth_m * depth_m,
        }
    }

    /// Predicted less measured, its derivative by the predicted z, and sigma, all in the space of the noise.
    fn compare(&self, z: f64) -> [f64; 3] {
        match *self {
            Self::Direct { depth_m, sigma_m } => [z - depth_m, 1.0, sigma_m],
            Self::Inverse { depth_m, sigma_per_m } => [1.0 / z - 1.0 / depth_m, -1.0 / (z * z), sigma_per_m],
        }
    }
}

/// The linearised error of one match: predicted less measured, over `M` numbers, for a landmark of `L` degrees of freedom.
///
/// Rows that were not measured have the error 0, no derivative, and the variance 1: they count nowhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual<const M: usize, const L: usize> {
    /// Predicted less measured: pixels, and depth in the space of its noise.
    pub error: SVector<f64, M>,
    /// Derivative by the tangent `[rotation; translation]` of `camera_from_world`, applied on the left.
    pub by_pose: SMatrix<f64, M, 6>,
    /// Derivative by the landmark's degrees of freedom, metres.
    pub by_landmark: SMatrix<f64, M, L>,
    /// Covariance of what was measured.
    pub noise: SMatrix<f64, M, M>,
    /// Rows that were measured.
    pub count: usize,
}

impl<const M: usize, const L: usize> Residual<M, L> {
    #[inline]
    fn empty() -> Self {
        Self {
            error: SVector::zeros(),
            by_pose: SMatrix::zeros(),
            by_landmark: SMatrix::zeros(),
            noise: SMatrix::identity(),
            count: 0,
        }
    }

    #[inline]
    fn set_by_pose(&mut self, row: usize, derivative: &Vector6<f64>) {
        for number in 0..6 {
            self.by_pose[(row, number)] = derivative[number];
        }
    }

    /// `noise + J_X Σ J_Xᵀ`: the covariance of the error where the landmark has the covariance Σ and the pose is exact.
    #[must_use]
    pub fn covariance(&self, landmark: &SMatrix<f64, L, L>) -> SMatrix<f64, M, M> {
        let spread = product(&self.by_landmark, landmark);
        self.noise + product(&spread, &self.by_landmark.transpose())
    }
}

/// The matrix `W` with `W S Wᵀ = I`; `None` when `S` is not positive definite.
pub(super) fn whitening<const M: usize>(covariance: &SMatrix<f64, M, M>) -> Option<SMatrix<f64, M, M>> {
    // By hand, for a factorisation of any size M at compile time: S = L Lᵀ, then W = L⁻¹.
    let mut lower = SMatrix::<f64, M, M>::zeros();
    for row in 0..M {
        for column in 0..=row {
            let mut sum = covariance[(row, column)];
            for k in 0..column {
                sum -= lower[(row, k)] * lower[(column, k)];
            }
            if row == column {
                if !(sum > 0.0 && sum.is_finite()) {
                    return None;
                }
                lower[(row, row)] = sum.sqrt();
            } else {
                lower[(row, column)] = sum / lower[(column, column)];
            }
        }
    }
    let mut inverse = SMatrix::<f64, M, M>::zeros();
    for column in 0..M {
        inverse[(column, column)] = 1.0 / lower[(column, column)];
        for row in column + 1..M {
            let mut sum = 0.0;
            for k in column..row {
                sum += lower[(row, k)] * inverse[(k, column)];
            }
            inverse[(row, column)] = -sum / lower[(row, row)];
        }
    }
    Some(inverse)
}

/// A point and where one frame measured it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMatch {
    /// The landmark in the world, metres.
    pub point: Point3<f64>,
    /// Its covariance, m²; zero for one that is known.
    pub covariance: Matrix3<f64>,
    /// Pixel.
    pub pixel: Point2<f64>,
    /// Depth, where it was measured.
    pub depth: Option<MeasuredDepth>,
}

impl PointMatch {
    /// The error in a camera: `[u, v, depth]`, and its derivatives by pose and by point.
    ///
    /// * `sigma_px` — standard deviation of u and of v, pixels.
    ///
    /// `None` when the point is not in front of the camera.
    #[inline]
    #[must_use]
    pub fn residual(
        &self,
        camera: &PinholeCamera,
        camera_from_world: &Pose,
        sigma_px: f64,
    ) -> Option<Residual<3, 3>> {
        let rotation = camera_from_world.rotation_matrix();
        let seen = rotation * self.point.coords + camera_from_world.translation();
        let z = seen.z;
        if z.is_nan() || z <= NEAREST_Z {
            return None;
        }
        let (x, y) = (seen.x / z, seen.y / z);
        let mut residual = Residual::<3, 3>::empty();
        let mut by_seen = Matrix3::new(
            camera.fx / z,
            0.0,
            -camera.fx * x / z,
            0.0,
            camera.fy / z,
            -camera.fy * y / z,
            0.0,
            0.0,
            0.0,
        );
        residual.error[0] = camera.fx * x + camera.cx - self.pixel.x;
        residual.error[1] = camera.fy * y + camera.cy - self.pixel.y;
        residual.noise[(0, 0)] = sigma_px * sigma_px;
        residual.noise[(1, 1)] = sigma_px * sigma_px;
        residual.count = 2;
        if let Some(depth) = self.depth {
            let [error, slope, sigma] = depth.compare(z);
            residual.error[2] = error;
            by_seen[(2, 2)] = slope;
            residual.noise[(2, 2)] = sigma * sigma;
            residual.count = 3;
        }
        for row in 0..3 {
            let by_seen = Vector3::new(by_seen[(row, 0)], by_seen[(row, 1)], by_seen[(row, 2)]);
            residual.set_by_pose(row, &by_pose(&seen, &by_seen));
        }
        residual.by_landmark = product(&by_seen, &rotation);
        residual.error.iter().all(|error| error.is_finite()).then_some(residual)
    }
}

/// `[p × g; g]`: how a number moves with the pose's tangent that has the derivative g by a point p in the camera.
#[inline]
fn by_pose(point: &Vector3<f64>, by_point: &Vector3<f64>) -> Vector6<f64> {
    let turn = point.cross(by_point);
    Vector6::new(turn.x, turn.y, turn.z, by_point.x, by_point.y, by_point.z)
}

/// A line and where one frame measured a segment of it.
///
/// The line has four degrees of freedom: how far each end of `segment` moves along the two columns of [`LineMatch::across`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineMatch {
    /// Two points of the endless line in the world, metres; they need not be where the measured ends are.
    pub segment: Segment,
    /// Covariance of the four degrees of freedom, `[start; end]`, m²; zero for a line that is known.
    pub covariance: Matrix4<f64>,
    /// Measured ends, pixels; their order does not matter.
    pub ends_px: [Point2<f64>; 2],
    /// Depth of each end, where it was measured.
    pub depths: [Option<MeasuredDepth>; 2],
}

impl LineMatch {
    /// Two unit vectors across a segment, perpendicular to it and to each other; `None` for one without length.
    #[must_use]
    pub fn across(segment: &Segment) -> Option<Matrix3x2<f64>> {
        let direction = segment.direction()?;
        let first = perpendicular(direction);
        Some(Matrix3x2::from_columns(&[first, direction.cross(&first)]))
    }

    /// The error in a camera: `[distance, depth]` of the start, then of the end, with derivatives by pose and by line.
    ///
    /// *distance* is that of the measured end from the line's image (the paper's `r_l`), pixels. *depth* is that of the line where the ray
    /// of the measured end meets it (or is nearest), against the measured one. The noise of the pixel moves that place along the line, so
    /// both rows of an end have a common covariance: `σ² ∂·∂ᵀ` by the pixel, plus the depth's own.
    ///
    /// * `sigma_px` — standard deviation of u and of v, pixels.
    ///
    /// `None` when the line has no image, or passes behind the camera where an end was measured.
    #[must_use]
    pub fn residual(
        &self,
        camera: &PinholeCamera,
        camera_from_world: &Pose,
        sigma_px: f64,
    ) -> Option<Residual<4, 4>> {
        let across = Self::across(&self.segment)?;
        let rotation = camera_from_world.rotation_matrix();
        let translation = camera_from_world.translation();
        let p = rotation * self.segment.start.coords + translation;
        let q = rotation * self.segment.end.coords + translation;
        let across = rotation * across;
        let (d, n) = (q - p, p.cross(&q));
        let matrix = camera.line_matrix();
        let image = matrix * n;
        let length = Vector2::new(image.x, image.y).norm();
        // Relative to its other components: a plane parallel to the image has its line at infinity.
        if !(length > 1e-12 * (camera.fx * camera.fy).abs() * n.norm() / camera.fx.abs().max(camera.fy.abs())
            && length.is_finite())
        {
            return None;
        }
        let mut residual = Residual::<4, 4>::empty();
        for (end, pixel) in self.ends_px.iter().enumerate() {
            let row = 2 * end;
            let distance = image.dot(&pixel.to_homogeneous()) / length;
            let unit = Vector2::new(image.x, image.y) / length;
            let by_image = (pixel.to_homogeneous() - unit.push(0.0) * distance) / length;
            let by_n = matrix.tr_mul(&by_image);
            // n = p × q: dn·g = dp·(q × g) = dq·(g × p).
            let (mut by_p, mut by_q) = ([Vector3::zeros(); 2], [Vector3::zeros(); 2]);
            (by_p[0], by_q[0]) = (q.cross(&by_n), by_n.cross(&p));
            residual.error[row] = distance;
            residual.count += 1;
            let mut noise = Matrix2::new(sigma_px * sigma_px, 0.0, 0.0, 1.0);
            let ray = camera.normalised(*pixel);
            let c = ray.cross(&d);
            let cc = c.norm_squared();
            let z = n.dot(&c) / cc;
            // A ray along the line meets it nowhere.
            let aimed = cc > 1e-12 * ray.norm_squared() * d.norm_squared();
            if aimed && (z.is_nan() || z <= NEAREST_Z) {
                return None;
            }
            if let Some(depth) = self.depths[end].filter(|_| aimed) {
                let [error, slope, sigma] = depth.compare(z);
                let by_d = (n - c * (2.0 * z)).cross(&ray) / cc;
                by_p[1] = (q.cross(&c) / cc - by_d) * slope;
                by_q[1] = (c.cross(&p) / cc + by_d) * slope;
                let by_ray = (d.cross(&n) - d.cross(&c) * (2.0 * z)) / cc;
                let by_pixel = Vector2::new(by_ray.x / camera.fx, by_ray.y / camera.fy) * slope;
                let variance = sigma_px * sigma_px;
                noise[(1, 1)] = sigma * sigma + variance * by_pixel.norm_squared();
                noise[(0, 1)] = variance * by_pixel.dot(&unit);
                noise[(1, 0)] = noise[(0, 1)];
                residual.error[row + 1] = error;
                residual.count += 1;
            }
            residual.noise.fixed_view_mut::<2, 2>(row, row).copy_from(&noise);
            for kind in 0..2 {
                let by_ends = by_pose(&p, &by_p[kind]) + by_pose(&q, &by_q[kind]);
                residual.set_by_pose(row + kind, &by_ends);
                let (by_p, by_q): (RowVector3<f64>, RowVector3<f64>) =
                    (by_p[kind].transpose(), by_q[kind].transpose());
                residual.by_landmark.fixed_view_mut::<1, 2>(row + kind, 0).copy_from(&(by_p * across));
                residual.by_landmark.fixed_view_mut::<1, 2>(row + kind, 2).copy_from(&(by_q * across));
            }
        }
        residual.error.iter().all(|error| error.is_finite()).then_some(residual)
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{camera, circle, visible_point, visible_segment};
    use super::*;
    use nalgebra::{Vector4, Vector6};
    use proptest::prelude::*;

    fn depth(inverse: bool, depth_m: f64) -> MeasuredDepth {
        if inverse {
            MeasuredDepth::Inverse { depth_m, sigma_per_m: 0.02 }
        } else {
            MeasuredDepth::Direct { depth_m, sigma_m: 0.05 }
        }
    }

    proptest! {
        #[test]
        fn derivatives_of_a_point_are_its_differences(
            camera in camera(), pose in circle(), point in visible_point(), beside in visible_point(),
            inverse in any::<bool>(),
        ) {
            let covariance = Matrix3::zeros();
            let seen = pose * beside;
            let at = PointMatch {
                point, covariance, pixel: camera.project(seen).unwrap(), depth: Some(depth(inverse, seen.z)),
            };
            let here = at.residual(&camera, &pose, 1.0).unwrap();
            let step = 1e-6;
            for k in 0..6 {
                let tangent = Vector6::ith(k, step);
                let after = at.residual(&camera, &(Pose::exp(&tangent) * pose), 1.0).unwrap().error;
                let before = at.residual(&camera, &(Pose::exp(&-tangent) * pose), 1.0).unwrap().error;
                // Central differences of numbers of about 1e3 px: rounding 1e-7, third derivatives 1e-8 of it.
                prop_assert!(((after - before) / (2.0 * step) - here.by_pose.column(k)).norm() < 1e-5);
            }
            for k in 0..3 {
                let moved = |sign: f64| PointMatch { point: point + Vector3::ith(k, sign * step), ..at };
                let after = moved(1.0).residual(&camera, &pose, 1.0).unwrap().error;
                let before = moved(-1.0).residual(&camera, &pose, 1.0).unwrap().error;
                prop_assert!(((after - before) / (2.0 * step) - here.by_landmark.column(k)).norm() < 1e-5);
            }
        }

        #[test]
        fn derivatives_of_a_line_are_its_differences(
            camera in camera(), pose in circle(), segment in visible_segment(), beside in visible_segment(),
            inverse in any::<bool>(),
        ) {
            // The measured ends lie a little beside the line, so that no term of the derivatives is zero.
            let near = |a: Point3<f64>, b: Point3<f64>| pose * (a + (b - a) * 0.05);
            let ends = [near(segment.start, beside.start), near(segment.end, beside.end)];
            let at = LineMatch {
                segment,
                covariance: Matrix4::zeros(),
                ends_px: ends.map(|end| camera.project(end).unwrap()),
                depths: ends.map(|end| Some(depth(inverse, end.z))),
            };
            let Some(here) = at.residual(&camera, &pose, 1.0) else { return Ok(()) };
            // Seen end-on, a line has no place where a ray meets it, and no direction in the image.
            prop_assume!((at.ends_px[0] - at.ends_px[1]).norm() > 20.0);
            let step = 1e-6;
            let scale = here.by_pose.amax().max(here.by_landmark.amax());
            for k in 0..6 {
                let tangent = Vector6::ith(k, step);
                let after = at.residual(&camera, &(Pose::exp(&tangent) * pose), 1.0).unwrap().error;
                let before = at.residual(&camera, &(Pose::exp(&-tangent) * pose), 1.0).unwrap().error;
                let found = (after - before) / (2.0 * step);
                prop_assert!((found - here.by_pose.column(k)).norm() < 1e-6 * scale, "{k} {found} {}", here.by_pose.column(k));
            }
            let across = LineMatch::across(&segment).unwrap();
            for k in 0..4 {
                let moved = |sign: f64| {
                    let delta = Vector4::ith(k, sign * step);
                    let start = segment.start + across * delta.fixed_rows::<2>(0);
                    let end = segment.end + across * delta.fixed_rows::<2>(2);
                    LineMatch { segment: Segment { start, end }, ..at }
                };
                let after = moved(1.0).residual(&camera, &pose, 1.0).unwrap().error;
                let before = moved(-1.0).residual(&camera, &pose, 1.0).unwrap().error;
                let found = (after - before) / (2.0 * step);
                prop_assert!((found - here.by_landmark.column(k)).norm() < 1e-6 * scale);
            }
        }

        #[test]
        fn the_noise_of_a_line_is_the_derivative_by_what_was_measured(
            camera in camera(), pose in circle(), segment in visible_segment(),
        ) {
            let ends = [segment.start, segment.end].map(|end| pose * end);
            let ends_px = ends.map(|end| camera.project(end).unwrap());
            prop_assume!((ends_px[0] - ends_px[1]).norm() > 20.0);
            let at = LineMatch {
                segment,
                covariance: Matrix4::zeros(),
                ends_px,
                depths: ends.map(|end| Some(depth(false, end.z))),
            };
            let Some(here) = at.residual(&camera, &pose, 2.0) else { return Ok(()) };
            let (step, mut covariance) = (1e-5, Matrix4::<f64>::zeros());
            for end in 0..2 {
                for axis in 0..2 {
                    let error = |sign: f64| {
                        let mut moved = at;
                        moved.ends_px[end][axis] += sign * step;
                        moved.residual(&camera, &pose, 2.0).unwrap().error
                    };
                    let by_pixel = (error(1.0) - error(-1.0)) / (2.0 * step) * 2.0;
                    covariance.ger(1.0, &by_pixel, &by_pixel, 1.0);
                }
                covariance[(2 * end + 1, 2 * end + 1)] += 0.05 * 0.05;
            }
            // Rounding of 1e-13 px over the step.
            prop_assert!((covariance - here.noise).norm() < 1e-6 * here.noise.norm(), "{covariance} {}", here.noise);
        }

        #[test]
        fn a_landmark_where_it_was_measured_has_no_error(
            camera in camera(), pose in circle(), segment in visible_segment(), shift in -0.5..0.5_f64,
        ) {
            let ends = [segment.start, segment.end].map(|end| pose * end);
            let ends_px = ends.map(|end| camera.project(end).unwrap());
            prop_assume!((ends_px[0] - ends_px[1]).norm() > 1.0);
            // Other points of the same line.
            let along = (segment.end - segment.start) * shift;
            let moved = Segment { start: segment.start + along, end: segment.end + along * 2.0 };
            prop_assume!(moved.length() > 0.1);
            let line = LineMatch {
                segment: moved,
                covariance: Matrix4::zeros(),
                ends_px,
                depths: ends.map(|end| Some(depth(false, end.z))),
            };
            let Some(residual) = line.residual(&camera, &pose, 1.0) else { return Ok(()) };
            prop_assert_eq!(residual.count, 4);
            // Metres and pixels, for a line that is seen under 1 px of 500 at least.
            prop_assert!(residual.error.norm() < 1e-8, "{}", residual.error);
        }

        #[test]
        fn whitening_takes_a_covariance_to_the_identity(entries in prop::array::uniform16(-1.0..1.0_f64)) {
            let factor = Matrix4::from(std::array::from_fn(|k| std::array::from_fn(|l| entries[4 * k + l])));
            let covariance = factor * factor.transpose() + Matrix4::identity() * 0.01;
            let white = whitening(&covariance).unwrap();
            prop_assert!((white * covariance * white.transpose() - Matrix4::identity()).norm() < 1e-11);
        }
    }
}
