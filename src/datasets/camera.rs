//! The camera that took the images of a dataset.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;
use crate::structure::registry;

/// The pinhole camera that took the images, as its dataset publishes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct CameraOfDataset {
    /// Name by which the converters know the camera, such as `tum-fr3`.
    pub family: String,
    /// Horizontal focal length, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub fx: f64,
    /// Vertical focal length, pixels; negative where the camera's y points up in the image.
    #[schemars(extend("x-unit" = "px"))]
    pub fy: f64,
    /// Column of the principal point, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub cx: f64,
    /// Row of the principal point, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub cy: f64,
    /// Image width, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub width: u32,
    /// Image height, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub height: u32,
    /// Where pixels are counted from: `pixel-center` or `pixel-corner`, as in the registry.
    pub pixel_origin: String,
}

impl CameraOfDataset {
    /// Looks at every number.
    pub(super) fn check(&self) -> Result<(), Error> {
        let known = !self.family.is_empty()
            && self.family.len() <= 64
            && self
                .family
                .bytes()
                .all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-');
        if !known {
            return Err(Error::value(
                "camera.family",
                "1 to 64 lower-case letters, digits and hyphens",
                format!("{:?}", self.family),
            ));
        }
        for (name, focal) in [("fx", self.fx), ("fy", self.fy)] {
            if !(1.0..=1e6).contains(&focal.abs()) {
                return Err(Error::value(
                    format!("camera.{name}"),
                    "1 to 1000000 px, or its negative",
                    focal,
                ));
            }
        }
        for (name, size) in [("width", self.width), ("height", self.height)] {
            if !(1..=100_000).contains(&size) {
                return Err(Error::value(format!("camera.{name}"), "1 to 100000 px", size));
            }
        }
        for (name, center, size) in [("cx", self.cx, self.width), ("cy", self.cy, self.height)] {
            // The principal point of a lens lies in its image.
            if !(-1.0..=f64::from(size)).contains(&center) {
                return Err(Error::value(format!("camera.{name}"), format!("-1 to {size} px"), center));
            }
        }
        let origins = [registry::PIXEL_CENTER, registry::PIXEL_CORNER];
        if !origins.contains(&self.pixel_origin.as_str()) {
            return Err(Error::value(
                "camera.pixel_origin",
                origins.join(" or "),
                format!("{:?}", self.pixel_origin),
            ));
        }
        Ok(())
    }
}
