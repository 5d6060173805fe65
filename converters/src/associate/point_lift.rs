//! A detected point in the world.

use nalgebra::{Matrix3, Point2, Point3};
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

/// The point of the world that a detected point shows.
///
/// Along the ray it is as uncertain as the depth, across it as the position in the image; the pose's uncertainty comes to
/// both.
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
    let focal_px = raster.camera().fx.abs();
    let place: Point2<f64> = point.raster;
    let surface = depth.surface(place, focal_px, noise).ok_or(PointRejection::NoDepth)?;
    if surface.jump && options.rims == Rims::Reject {
        return Err(PointRejection::OnRim);
    }
    let in_camera = raster.back_project(place, surface.depth_m).ok_or(PointRejection::NoDepth)?;
    let ray = world_from_camera.transform_vector(&in_camera.coords.normalize());
    let pixel_m = surface.depth_m / focal_px;
    let along = square(noise.sigma_m(surface.depth_m)) + square(pose_sigma_m);
    let across = square(options.sigma_px * point.scale * pixel_m) + square(pose_sigma_m);
    let information = Matrix3::identity() / across + ray * ray.transpose() * (1.0 / along - 1.0 / across);
    let spread = 3.0 * (noise.sigma_m(surface.depth_m) + pose_sigma_m);
    Ok(LiftedPoint {
        position: world_from_camera * in_camera,
        information,
        radius_m: (options.radius_px * pixel_m + spread).min(options.max_radius_m),
        descriptor: point.descriptor,
    })
}

fn square(value: f64) -> f64 {
    value * value
}
