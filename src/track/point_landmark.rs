//! A point of the map.

use nalgebra::{Matrix3, Matrix6, Point2, Point3};

use super::fusion::{back_projected, congruent, fuse, inverse};
use super::sighting::PointSighting;
use crate::geometry::{PinholeCamera, PointMatch, PointView, Pose, triangulate_point};

/// Rays of a point without depth must differ by this much before it is triangulated, radians.
const LEAST_PARALLAX: f64 = 0.03;

/// Views of a point without depth that are kept at most; later ones take the place of every other one.
const MOST_VIEWS: usize = 32;

/// Whitened residuals of a triangulation may have this root mean square.
const MOST_RMS: f64 = 3.0;

/// A frame as landmarks see it: projection, pose, and how well that is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) camera: PinholeCamera,
    pub(super) sigma_px: f64,
    pub(super) camera_from_world: Pose,
    /// Covariance of the tangent of `camera_from_world`.
    pub(super) covariance: Matrix6<f64>,
}

/// A point whose place is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointLandmark {
    pub(super) point: Point3<f64>,
    pub(super) covariance: Matrix3<f64>,
    /// Frames in a row that contradicted it.
    pub(super) contradictions: u32,
}

impl PointLandmark {
    /// A point from one measurement with depth.
    pub(super) fn from_depth(view: &View, sighting: &PointSighting) -> Option<Self> {
        let depth = sighting.depth?;
        let in_camera = view.camera.back_project(sighting.pixel, depth.depth_m());
        let sigmas = (view.sigma_px, depth.sigma_m());
        let covariance =
            back_projected(&view.camera, &view.camera_from_world, &in_camera, sigmas, &view.covariance);
        let point = view.camera_from_world.inverse() * in_camera;
        point.iter().chain(covariance.iter()).all(|number| number.is_finite()).then_some(Self {
            point,
            covariance,
            contradictions: 0,
        })
    }

    /// Moves with the world.
    pub(super) fn shift(&mut self, shift: &Pose) {
        let turn = shift.rotation_matrix();
        self.point = *shift * self.point;
        self.covariance = turn * self.covariance * turn.transpose();
    }

    /// The point with a measurement of it.
    pub(super) fn matched(&self, sighting: &PointSighting) -> PointMatch {
        PointMatch {
            point: self.point,
            covariance: self.covariance,
            pixel: sighting.pixel,
            depth: sighting.depth,
        }
    }

    /// Takes a measurement that agrees.
    pub(super) fn fuse(&mut self, view: &View, sighting: &PointSighting) {
        self.contradictions = 0;
        let prior = *self;
        // Once more from where the first round led, for projection bends.
        for _ in 0..2 {
            let Some(mut residual) =
                self.matched(sighting).residual(&view.camera, &view.camera_from_world, view.sigma_px)
            else {
                return;
            };
            // The error as the prior would make it, linearised here.
            residual.error += residual.by_landmark * (prior.point - self.point);
            let Some(fused) = fuse(&residual, &prior.covariance, &view.covariance) else { return };
            self.point = prior.point + fused.shift;
            self.covariance = fused.covariance;
        }
    }
}

/// How doubtful a triangulated landmark may be, sigma over distance: more where little else is known, for a common error of the first
/// ones, such as their scale, stays with all that follow.
///
/// * `numbers` — that were measured of landmarks that are known.
pub(super) fn most_doubt(numbers: usize) -> f64 {
    0.03 + 0.17 * (1.0 - numbers as f64 / 60.0).max(0.0)
}

/// Where a point without depth was seen, until its place is known.
#[derive(Clone, Debug, Default)]
pub(super) struct PendingPoint {
    views: Vec<(View, Point2<f64>)>,
}

impl PendingPoint {
    /// Takes a measurement; gives the point where it is known well enough by now.
    ///
    /// * `numbers` — that were measured of landmarks that are known.
    pub(super) fn push(
        &mut self,
        view: &View,
        sighting: &PointSighting,
        numbers: usize,
    ) -> Option<PointLandmark> {
        if self.views.len() >= MOST_VIEWS {
            let mut keep = false;
            self.views.retain(|_| {
                keep = !keep;
                keep
            });
        }
        self.views.push((*view, sighting.pixel));
        let ray = |(view, pixel): &(View, Point2<f64>)| {
            view.camera_from_world.rotation().inverse() * view.camera.ray(*pixel)
        };
        let last = ray(self.views.last()?);
        let widest = self.views.iter().map(|view| ray(view).dot(&last)).fold(1.0, f64::min);
        // cos x = 1 − x²/2
        if widest > 1.0 - 0.5 * LEAST_PARALLAX * LEAST_PARALLAX {
            return None;
        }
        self.triangulated(most_doubt(numbers))
    }

    fn triangulated(&self, most_doubt: f64) -> Option<PointLandmark> {
        let observations: Vec<PointView> =
            self.views.iter().map(|(view, pixel)| (view.camera, view.camera_from_world, *pixel)).collect();
        let found = triangulate_point(&observations)?;
        if found.parallax < LEAST_PARALLAX {
            return None;
        }
        let mut information = Matrix3::<f64>::zeros();
        let mut cost = 0.0;
        for (view, pixel) in &self.views {
            let at =
                PointMatch { point: found.point, covariance: Matrix3::zeros(), pixel: *pixel, depth: None };
            let residual = at.residual(&view.camera, &view.camera_from_world, view.sigma_px)?;
            let noise = residual.noise + congruent(&residual.by_pose, &view.covariance);
            let weight = inverse(&noise)?;
            information += residual.by_landmark.transpose() * weight * residual.by_landmark;
            cost += residual.error.dot(&(weight * residual.error));
        }
        if (cost / (2 * self.views.len()) as f64).sqrt() > MOST_RMS {
            return None;
        }
        let covariance = inverse(&information)?;
        let (view, _) = self.views.last()?;
        let distance = (view.camera_from_world * found.point).coords.norm();
        (covariance.trace().sqrt() < most_doubt * distance).then_some(PointLandmark {
            point: found.point,
            covariance,
            contradictions: 0,
        })
    }
}
