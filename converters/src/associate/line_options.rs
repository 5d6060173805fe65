//! What counts as a line of the world.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rims::Rims;
use crate::rgbd::{DepthNoise, Raster};

/// What counts as a line of the world, and as a view of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LineOptions {
    /// Distance between places along a segment at which depth is asked for, pixels.
    pub step_px: f64,
    /// Most places along a segment; long segments are asked at wider distances.
    pub most_places: usize,
    /// Least part of the places that has a depth.
    pub depth_part: f64,
    /// What becomes of segments along the rims of objects: `nearer` makes lines of the nearer surface of them, `reject` rejects
    /// them when more than `rim_part` of their places lie on a rim.
    pub rims: Rims,
    /// `reject`: greatest part of the places that may lie on a rim.
    pub rim_part: f64,
    /// How far a place may be from its straight line: standard deviations of the depth.
    pub straight_sigmas: f64,
    /// How far a place may be from its straight line besides: widths of a pixel at its depth.
    pub straight_px: f64,
    /// Pairs of places that are tried as a line.
    pub trials: usize,
    /// Least part of the places with depth that lies on the line.
    pub straight_part: f64,
    /// Shortest line, metres.
    pub length_m: f64,
    /// Lines at up to this angle may be one landmark, degrees.
    pub fuse_angle_deg: f64,
    /// The ends of the shorter may be this far from the line of the longer, metres; `fuse_widths` comes on top.
    pub fuse_distance_m: f64,
    /// What comes on top, for each of both: a standard deviation of the depth and the width of a pixel at its depth, this many
    /// times.
    pub fuse_widths: f64,
    /// Gap between two parts of one landmark along it, metres.
    pub fuse_gap_m: f64,
    /// Frames that have to detect a landmark.
    pub min_detections: u32,
    /// Frames that have to see it.
    pub min_observations: u32,
    /// Nearest depth at which a landmark is seen, metres.
    pub nearest_m: f64,
    /// Distance between places along a landmark's image at which the depth map is asked, pixels.
    pub sight_step_px: f64,
    /// Longest piece of a view along which the landmark is hidden, pixels.
    pub sight_gap_px: f64,
    /// Shortest view, pixels.
    pub sight_length_px: f64,
    /// Least part of a view's places at which the depth map shows the landmark.
    pub sight_part: f64,
}

impl Default for LineOptions {
    fn default() -> Self {
        Self {
            step_px: 1.0,
            most_places: 32,
            depth_part: 0.6,
            rims: Rims::Nearer,
            rim_part: 0.5,
            straight_sigmas: 2.0,
            straight_px: 1.0,
            trials: 24,
            straight_part: 0.7,
            length_m: 0.05,
            fuse_angle_deg: 4.0,
            fuse_distance_m: 0.005,
            fuse_widths: 1.0,
            fuse_gap_m: 0.3,
            min_detections: 3,
            min_observations: 5,
            nearest_m: 0.05,
            sight_step_px: 3.0,
            sight_gap_px: 8.0,
            sight_length_px: 15.0,
            sight_part: 0.7,
        }
    }
}

/// How far a place of a depth may be from where it is seen: a standard deviation of the depth and the width of a pixel, metres.
pub(super) fn tolerance_m(raster: &Raster, noise: &DepthNoise, depth_m: f64) -> f64 {
    noise.sigma_m(depth_m) + depth_m / focal_px(raster)
}

/// The shorter of the two focal lengths, pixels.
pub(super) fn focal_px(raster: &Raster) -> f64 {
    raster.camera().fx.abs().min(raster.camera().fy.abs())
}
