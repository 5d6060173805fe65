//! A camera of a sequence, as the manifest describes it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::id::CameraId;
use super::registry;
use crate::geometry::PinholeCamera;

/// A camera of the sequence.
///
/// A point (x, y, z) of `camera` space appears at `u = fx x/z + cx`, `v = fy y/z + cy`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Camera {
    /// Name of the camera.
    pub camera_id: CameraId,
    /// Camera model; the registry has `pinhole`.
    pub model: String,
    /// Image width, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub width: u32,
    /// Image height, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub height: u32,
    /// Horizontal focal length, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub fx: f64,
    /// Vertical focal length, pixels; negative for a camera whose y axis points up in the image.
    #[schemars(extend("x-unit" = "px"))]
    pub fy: f64,
    /// Column of the principal point, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub cx: f64,
    /// Row of the principal point, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub cy: f64,
    /// Axes of `camera` space: `right-down-forward`, or `right-up-forward` where `fy` is negative.
    pub axes: String,
    /// Where pixel (0, 0) lies: `pixel-center` (middle of the top-left pixel) or `pixel-corner` (its outer corner).
    pub pixel_origin: String,
    /// Lens distortion of the source images, already removed from every pixel position of the sequence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed_distortion: Option<Distortion>,
    /// Smallest depth that the sensor gives, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m"))]
    pub depth_min: Option<f64>,
    /// Largest depth that the sensor gives, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m"))]
    pub depth_max: Option<f64>,
}

/// A lens distortion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Distortion {
    /// Distortion model; the registry has `brown-conrady`.
    pub model: String,
    /// Coefficients in the order that the registry gives.
    pub coefficients: Vec<f64>,
}

impl Camera {
    /// A pinhole camera with the usual conventions; axes follow the sign of `fy`.
    #[must_use]
    pub fn pinhole(camera_id: CameraId, pinhole: &PinholeCamera, pixel_origin: &str) -> Self {
        let axes = if pinhole.fy < 0.0 { registry::RIGHT_UP_FORWARD } else { registry::RIGHT_DOWN_FORWARD };
        Self {
            camera_id,
            model: registry::PINHOLE.to_owned(),
            width: pinhole.width,
            height: pinhole.height,
            fx: pinhole.fx,
            fy: pinhole.fy,
            cx: pinhole.cx,
            cy: pinhole.cy,
            axes: axes.to_owned(),
            pixel_origin: pixel_origin.to_owned(),
            removed_distortion: None,
            depth_min: None,
            depth_max: None,
        }
    }

    /// The projection of the camera.
    #[must_use]
    pub fn projection(&self) -> PinholeCamera {
        PinholeCamera {
            fx: self.fx,
            fy: self.fy,
            cx: self.cx,
            cy: self.cy,
            width: self.width,
            height: self.height,
        }
    }
}
