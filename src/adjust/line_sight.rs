//! A measured segment as a residual of a line in the camera.

use crate::geometry::PinholeCamera;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2, Vector3};

/// A line whose image is farther away than this many pixels per unit of its coefficients has none.
const LEAST_SCALE: f64 = 1e-12;

/// What a camera measured of a line: `R` is 2 for the ends' pixels, 4 with their depths.
pub(super) trait LineSight<const R: usize>: Send + Sync {
    /// Residual at moment and direction in the camera (of any common scale), and its derivative by both; `None` where there is no image.
    fn look(
        &self,
        moment: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<(SVector<f64, R>, SMatrix<f64, R, 6>)>;
}

/// Both ends' pixels: the paper's residual `r_l`, distances of the ends from the image of the line.
#[derive(Clone, Copy, Debug)]
pub(super) struct EndsSight {
    pub(super) camera: PinholeCamera,
    pub(super) ends: [Vector2<f64>; 2],
    /// `W`: `WᵀW` is the information of the two distances.
    pub(super) root: Matrix2<f64>,
}

impl LineSight<2> for EndsSight {
    #[inline]
    fn look(&self, n: &Vector3<f64>, _: &Vector3<f64>) -> Option<(SVector<f64, 2>, SMatrix<f64, 2, 6>)> {
        let PinholeCamera { fx, fy, cx, cy, .. } = self.camera;
        // l = K̃ n
        let (a, b) = (fy * n.x, fx * n.y);
        let c = fx * fy * n.z - cx * a - cy * b;
        let scale = libm::sqrt(a * a + b * b);
        if scale.is_nan() || scale <= LEAST_SCALE * c.abs() || scale == 0.0 {
            return None;
        }
        let inverse = 1.0 / scale;
        let (a, b, c) = (a * inverse, b * inverse, c * inverse);
        let mut residual = SVector::<f64, 2>::zeros();
        let mut jacobian = SMatrix::<f64, 2, 6>::zeros();
        for (k, end) in self.ends.iter().enumerate() {
            let distance = a * end.x + b * end.y + c;
            residual[k] = distance;
            // ∂d/∂l = ([u, v, 1] − d [a, b, 0])/|l|, ∂l/∂n = K̃
            let (da, db) = ((end.x - distance * a) * inverse, (end.y - distance * b) * inverse);
            jacobian[(k, 0)] = fy * (da - cx * inverse);
            jacobian[(k, 1)] = fx * (db - cy * inverse);
            jacobian[(k, 2)] = fx * fy * inverse;
        }
        Some((self.root * residual, self.root * jacobian))
    }
}

/// Both ends' pixels and depths.
///
/// The depth of the line at a measured end: that of its point in the plane through the camera centre that holds the end and stands across
/// the measured segment, `z = (m × n)_z / (m · d)` with the plane's normal `m`. Pixel noise moves a measured end along the line but leaves
/// its depth as it is, so that the difference of both depths has the variance `σ_d² + (dz/ds)² σ_px²`, `s` along the image of the line.
#[derive(Clone, Copy, Debug)]
pub(super) struct EndsDepthSight {
    pub(super) ends: EndsSight,
    /// Normals of the planes across the segment at its ends, in the camera.
    pub(super) planes: [Vector3<f64>; 2],
    /// What the depths speak for, metres; whatever where the weight is zero.
    pub(super) depths_m: [f64; 2],
    /// `1/σ` of each difference of depths; zero where there is no depth.
    pub(super) weights: [f64; 2],
}

impl EndsDepthSight {
    /// The plane through the camera centre and an end, across a measured segment.
    pub(super) fn plane(camera: &PinholeCamera, end: Vector2<f64>, along: Vector2<f64>) -> Vector3<f64> {
        // The image line through the end with the normal `along`: l = (aₓ, a_y, −a·e), and m = Kᵀ l.
        let l = Vector3::new(along.x, along.y, -along.dot(&end));
        Vector3::new(camera.fx * l.x, camera.fy * l.y, camera.cx * l.x + camera.cy * l.y + l.z)
    }

    /// The depth of a line at an end.
    pub(super) fn depth(&self, end: usize, n: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
        depth_in_plane(&self.planes[end], n, d)
    }
}

/// The depth of a line where it passes through a plane through the camera centre.
pub(super) fn depth_in_plane(m: &Vector3<f64>, n: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
    (m.x * n.y - m.y * n.x) / m.dot(d)
}

impl LineSight<4> for EndsDepthSight {
    #[inline]
    fn look(&self, n: &Vector3<f64>, d: &Vector3<f64>) -> Option<(SVector<f64, 4>, SMatrix<f64, 4, 6>)> {
        let (distances, by_line) = self.ends.look(n, d)?;
        let mut residual = SVector::<f64, 4>::zeros();
        let mut jacobian = SMatrix::<f64, 4, 6>::zeros();
        residual.fixed_rows_mut::<2>(0).copy_from(&distances);
        jacobian.fixed_view_mut::<2, 6>(0, 0).copy_from(&by_line);
        for end in 0..2 {
            let weight = self.weights[end];
            if weight == 0.0 {
                continue;
            }
            let m = &self.planes[end];
            let across = m.dot(d);
            if across.abs() <= 1e-12 * m.norm() * d.norm() {
                return None;
            }
            let z = self.depth(end, n, d);
            residual[2 + end] = weight * (self.depths_m[end] - z);
            let slope = -weight / across;
            jacobian[(2 + end, 0)] = -m.y * slope;
            jacobian[(2 + end, 1)] = m.x * slope;
            for k in 0..3 {
                jacobian[(2 + end, 3 + k)] = -z * m[k] * slope;
            }
        }
        Some((residual, jacobian))
    }
}
