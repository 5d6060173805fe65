//! The camera of a recipe.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::PinholeCamera;
use crate::simulate::Error;
use crate::simulate::scene::check_numbers;
use crate::structure::{Camera, CameraId, registry};

/// A pinhole camera: one that is well known, or its numbers, or both, the numbers going first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(inline)]
pub struct CameraRecipe {
    /// The camera whose numbers are taken where none are given.
    pub preset: CameraPreset,
    /// Horizontal focal length, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub fx: Option<f64>,
    /// Vertical focal length, pixels; negative where the camera's y points up in the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub fy: Option<f64>,
    /// Column of the principal point, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub cx: Option<f64>,
    /// Row of the principal point, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub cy: Option<f64>,
    /// Image width, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub width: Option<u32>,
    /// Image height, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub height: Option<u32>,
    /// Smallest depth that the sensor gives, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m"))]
    pub depth_min_m: Option<f64>,
    /// Largest depth that the sensor gives, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m"))]
    pub depth_max_m: Option<f64>,
}

/// A well-known camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum CameraPreset {
    /// TUM RGB-D's fr3, and every simulation of the first release: 640 × 480, 535.4, 539.2, 320.1, 247.6.
    #[default]
    TumFr3,
    /// ICL-NUIM: 640 × 480, 481.2, −480, 319.5, 239.5; y points up in the image.
    IclNuim,
    /// TartanAir: 640 × 480, 320, 320, 320, 240, counted from the corner of the first pixel.
    Tartanair,
}

impl CameraPreset {
    /// fx, fy, cx, cy and where pixels are counted from; all are 640 × 480.
    const fn numbers(self) -> ([f64; 4], &'static str) {
        match self {
            Self::TumFr3 => ([535.4, 539.2, 320.1, 247.6], registry::PIXEL_CENTER),
            Self::IclNuim => ([481.2, -480.0, 319.5, 239.5], registry::PIXEL_CENTER),
            Self::Tartanair => ([320.0, 320.0, 320.0, 240.0], registry::PIXEL_CORNER),
        }
    }
}

impl CameraRecipe {
    /// The camera's projection.
    ///
    /// # Errors
    /// [`Error::Value`] and [`Error::Geometry`] for numbers that make no camera; `place` says where they stand.
    pub fn pinhole(&self, place: &str) -> Result<PinholeCamera, Error> {
        let ([fx, fy, cx, cy], _) = self.preset.numbers();
        let (width, height) = (self.width.unwrap_or(640), self.height.unwrap_or(480));
        for (name, size) in [("width", width), ("height", height)] {
            if !(1..=100_000).contains(&size) {
                return Err(Error::value(format!("{place}.{name}"), "1 to 100000 px", size));
            }
        }
        let [fx, fy] = [self.fx.unwrap_or(fx), self.fy.unwrap_or(fy)];
        for (name, focal) in [("fx", fx), ("fy", fy)] {
            check_numbers(&format!("{place}.{name}"), &[focal.abs()], 1.0, 1e6, "px")?;
        }
        if let Some([low, high]) = self.depth_min_m.zip(self.depth_max_m).map(|(low, high)| [low, high]) {
            check_numbers(&format!("{place}.depth_max_m"), &[high], low, 1e7, "m")?;
        }
        for depth in [self.depth_min_m, self.depth_max_m].into_iter().flatten() {
            check_numbers(&format!("{place}.depth_min_m"), &[depth], 0.0, 1e7, "m")?;
        }
        PinholeCamera::new(fx, fy, self.cx.unwrap_or(cx), self.cy.unwrap_or(cy), width, height)
            .map_err(|source| Error::Geometry { place: place.to_owned(), source })
    }

    /// The camera as the manifest says it.
    ///
    /// # Errors
    /// Those of [`pinhole`](Self::pinhole).
    pub fn camera(&self, place: &str) -> Result<Camera, Error> {
        let (_, pixel_origin) = self.preset.numbers();
        let mut camera = Camera::pinhole(CameraId(0), &self.pinhole(place)?, pixel_origin);
        camera.depth_min = self.depth_min_m;
        camera.depth_max = self.depth_max_m;
        Ok(camera)
    }
}
