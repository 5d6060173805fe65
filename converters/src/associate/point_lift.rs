//! A detected point in the world.

use nalgebra::{Matrix3, Point2, Point3, Vector3};
use open_structure::geometry::Pose;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rims::Rims;
use crate::detect::{Bits, DetectedPoint};
use crate::rgbd::{DepthMap, DepthNoise, Raster};

/// How points are lifted, fused and found again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PointLandmarkOptions {
    /// What becomes of points at the rim of an object.
    pub rims: Rims,
    /// Standard deviation of a detected position, pixels.
    pub sigma_px: f64,
    /// How far a detected point may be from its landmark, pixels at its depth; three standard deviations of depth and pose
    /// are added.
    pub radius_px: f64,
    /// Largest such distance, metres.
    pub max_radius_m: f64,
    /// Most bits of 256 in which their descriptors differ.
    pub max_hamming: u32,
    /// Frames that have to detect a landmark.
    pub min_detections: u32,
    /// Frames that have to see it.
    pub min_observations: u32,
    /// Part of the frames it should be seen in which may show something farther away instead, 0 to 1.
    pub max_absent: f64,
}

impl Default for PointLandmarkOptions {
    fn default() -> Self {
        Self {
            rims: Rims::Nearer,
            sigma_px: 1.0,
            radius_px: 2.0,
            max_radius_m: 0.1,
            max_hamming: 64,
            min_detections: 2,
            min_observations: 5,
            max_absent: 0.2,
        }
    }
}

/// A detected point in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct LiftedPoint {
    /// Where it is, metres.
    pub position: Point3<f64>,
    /// How well that is known: inverse of its covariance, 1/m².
    pub information: Matrix3<f64>,
    /// How far away its landmark may be, metres.
    pub radius_m: f64,
    /// What it looks like.
    pub descriptor: Bits,
}

/// Why a detected point has no place in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PointRejection {
    /// There is no depth, or too little around it.
    NoDepth,
    /// It is at the rim of an object.
    OnRim,
}

/// How far a surface may be from its plane, whatever the depth map says, in widths of a pixel at its depth: no detector
/// tells more, and information stays well conditioned.
const FLAT: f64 = 0.05;

/// The point of the world that a detected point shows.
///
/// An error of its position in the image moves it along the surface, an error of the depth along the ray; the pose's
/// uncertainty comes to both. So what different views say of a point of a plane leaves it in that plane. At a rim or a crease
/// the surface may have any slope up to 45 degrees.
///
/// * `pose_sigma_m` — standard deviation of the true pose, at the point, metres.
///
/// # Errors
/// Why there is none.
///
/// # Source
/// Open-Structure (Li et al. 2024), section III-A; there every point counts alike.
pub fn lift_point(
    raster: &Raster,
    depth: &DepthMap,
    noise: &DepthNoise,
    pose_sigma_m: f64,
    world_from_camera: &Pose,
    point: &DetectedPoint,
    options: &PointLandmarkOptions,
) -> Result<LiftedPoint, PointRejection> {
    let camera = raster.camera();
    let focal_px = camera.fx.abs();
    let place: Point2<f64> = point.raster;
    let surface = depth.surface(place, focal_px, noise).ok_or(PointRejection::NoDepth)?;
    if surface.jump && options.rims == Rims::Reject {
        return Err(PointRejection::OnRim);
    }
    let in_camera = raster.back_project(place, surface.depth_m).ok_or(PointRejection::NoDepth)?;
    // As long as one metre of depth.
    let ray = in_camera.coords / surface.depth_m;
    let pixel_m = surface.depth_m / focal_px;
    let sigma_m = noise.sigma_m(surface.depth_m);
    let position = square(options.sigma_px * point.scale);
    let mut covariance = Matrix3::identity() * square(pose_sigma_m);
    let along = if let Some(plane) = surface.plane {
        let right = Vector3::x() * (surface.depth_m / camera.fx) + ray * plane.slope_m.x;
        let down = Vector3::y() * (surface.depth_m / camera.fy) + ray * plane.slope_m.y;
        covariance += (right * right.transpose() + down * down.transpose()) * position;
        sigma_m.max(plane.bend_m).max(FLAT * pixel_m)
    } else {
        covariance += Matrix3::identity() * (position * square(pixel_m));
        sigma_m
    };
    covariance += ray * ray.transpose() * square(along);
    let information = covariance.cholesky().ok_or(PointRejection::NoDepth)?.inverse();
    let rotation = world_from_camera.rotation_matrix();
    let spread = 3.0 * (sigma_m + pose_sigma_m);
    Ok(LiftedPoint {
        position: world_from_camera * in_camera,
        information: rotation * information * rotation.transpose(),
        radius_m: (options.radius_px * pixel_m + spread).min(options.max_radius_m),
        descriptor: point.descriptor,
    })
}

fn square(value: f64) -> f64 {
    value * value
}
