//! A measured point as a residual of a point in the camera.

use crate::geometry::PinholeCamera;
use crate::structure::MeasurementNoise;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, SVector, Vector3};

/// Nearer to the plane of the camera than this (metres) nothing has an image.
const NEAREST_Z: f64 = 1e-9;

/// What a camera measured of a point: `R` is 2 for a pixel, 3 for a pixel and a depth.
///
/// Residual: `W (u − Π(p))`, measured less predicted, in units of sigma.
pub(super) trait PointSight<const R: usize>: Send + Sync {
    /// Residual at a point in the camera, and its derivative by the point; `None` where it has no image.
    fn look(&self, point_in_camera: &Vector3<f64>) -> Option<(SVector<f64, R>, SMatrix<f64, R, 3>)>;
}

/// A measured pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelSight {
    pub(super) camera: PinholeCamera,
    pub(super) pixel: [f64; 2],
    /// `W`: `WᵀW` is the information.
    pub(super) root: Matrix2<f64>,
}

impl PointSight<2> for PixelSight {
    #[inline]
    fn look(&self, p: &Vector3<f64>) -> Option<(SVector<f64, 2>, SMatrix<f64, 2, 3>)> {
        let PinholeCamera { fx, fy, cx, cy, .. } = self.camera;
        // Behind the camera the formula goes on, so that a step may pass through; who ends there is found afterwards.
        if p.z.abs() < NEAREST_Z || p.z.is_nan() {
            return None;
        }
        let inverse = 1.0 / p.z;
        let (x, y) = (p.x * inverse, p.y * inverse);
        let residual = SVector::<f64, 2>::new(self.pixel[0] - fx * x - cx, self.pixel[1] - fy * y - cy);
        let (a, b) = (-fx * inverse, -fy * inverse);
        // Written out: two by two is too small for a loop.
        let w = &self.root;
        let weighted = |u: f64, v: f64| [w[(0, 0)] * u + w[(0, 1)] * v, w[(1, 0)] * u + w[(1, 1)] * v];
        let [r, s] = weighted(residual.x, residual.y);
        let ([xx, yx], [xy, yy], [xz, yz]) = (weighted(a, 0.0), weighted(0.0, b), weighted(-a * x, -b * y));
        Some((SVector::<f64, 2>::new(r, s), Matrix2x3::new(xx, xy, xz, yx, yy, yz)))
    }
}

/// A measured pixel and depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthSight {
    pub(super) camera: PinholeCamera,
    pub(super) pixel: [f64; 2],
    pub(super) depth_m: f64,
    pub(super) weight: DepthWeight,
}

/// How pixel and depth are weighed.
#[derive(Clone, Copy, Debug)]
pub(super) enum DepthWeight {
    /// By the declared noise.
    Noise(MeasurementNoise),
    /// By the root of an information matrix over u, v and depth.
    Root(Matrix3<f64>),
}

impl PointSight<3> for DepthSight {
    #[inline]
    fn look(&self, p: &Vector3<f64>) -> Option<(SVector<f64, 3>, SMatrix<f64, 3, 3>)> {
        let root = match self.weight {
            DepthWeight::Noise(noise) => Matrix2::from_diagonal_element(1.0 / noise.sigma_px),
            DepthWeight::Root(_) => Matrix2::identity(),
        };
        let (residual, jacobian) = PixelSight { camera: self.camera, pixel: self.pixel, root }.look(p)?;
        let [r, slope] = match self.weight {
            DepthWeight::Noise(noise) => noise.depth_residual(self.depth_m, p.z)?,
            DepthWeight::Root(_) => [self.depth_m - p.z, -1.0],
        };
        let residual = SVector::<f64, 3>::new(residual.x, residual.y, r);
        let mut all = SMatrix::<f64, 3, 3>::zeros();
        all.fixed_view_mut::<2, 3>(0, 0).copy_from(&jacobian);
        all[(2, 2)] = slope;
        match self.weight {
            DepthWeight::Noise(_) => Some((residual, all)),
            DepthWeight::Root(root) => Some((root * residual, root * all)),
        }
    }
}
