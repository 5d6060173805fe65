//! Recipes: everything that makes a simulated sequence, in one TOML file.

mod camera;
mod expected;
mod landmarks;
mod library;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;
use super::noise::NoiseRecipe;
use super::scene::{Object, check_numbers};
use super::trajectory::Trajectory;
use super::visibility::Visibility;

pub use camera::{CameraPreset, CameraRecipe};
pub use expected::Expected;
pub use landmarks::{Density, LinesRecipe, PointsRecipe};
pub use library::{named, names};

/// Largest recipe that is read, bytes.
pub const MAX_RECIPE_BYTES: u64 = 1 << 20;

/// Everything that makes a simulated sequence.
///
/// The same recipe and seed give the same sequence, byte for byte, on any machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Name of the sequence.
    pub name: String,
    /// What the sequence shows, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Licence of the sequence, as an SPDX expression; what a simulator makes is its author's to give away.
    #[serde(default = "free")]
    pub licence: String,
    /// How to cite the sequence, where it repeats somebody's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub citation: Option<String>,
    /// Seed of everything random: path, landmarks and noise draw from streams of their own.
    #[serde(default)]
    pub seed: u64,
    /// Frames per second.
    #[serde(default = "video_rate")]
    #[schemars(extend("x-unit" = "Hz"))]
    pub rate_hz: f64,
    /// Landmarks that fewer frames see are left out, and others drawn instead.
    #[serde(default = "one")]
    pub min_observations: u32,
    /// The camera; by default that of the first release's simulations.
    #[serde(default)]
    pub camera: CameraRecipe,
    /// The path of the camera.
    pub trajectory: Trajectory,
    /// Objects, in any number.
    pub scene: Vec<Object>,
    /// Point landmarks.
    #[serde(default)]
    pub points: PointsRecipe,
    /// Line landmarks.
    #[serde(default)]
    pub lines: LinesRecipe,
    /// What a frame sees.
    #[serde(default)]
    pub visibility: Visibility,
    /// Noise of the measurements; without it there are observations alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseRecipe>,
    /// What comes out with the seed above; a recipe that no longer makes it is noticed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Expected>,
}

fn free() -> String {
    "CC0-1.0".to_owned()
}
const fn video_rate() -> f64 {
    30.0
}
const fn one() -> u32 {
    1
}

impl Recipe {
    /// Reads a recipe from the text of a TOML file.
    ///
    /// # Errors
    /// [`Error::Value`] with the place in the text where it is not a recipe, and those of [`check`](Self::check).
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let recipe: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            let place = line.map_or_else(|| "recipe".to_owned(), |line| format!("recipe, line {line}"));
            Error::value(place, "a recipe", error.message())
        })?;
        recipe.check()?;
        Ok(recipe)
    }

    /// Looks at every number; files that the recipe names are looked at when they are read.
    ///
    /// # Errors
    /// [`Error::Value`] with the place, what is expected and what was found.
    pub fn check(&self) -> Result<(), Error> {
        let named = !self.name.is_empty()
            && self.name.len() <= 200
            && !self.name.contains(['/', '\\'])
            && !self.name.chars().any(char::is_control);
        if !named {
            return Err(Error::value(
                "name",
                "a name of 1 to 200 bytes, without slashes",
                format!("{:?}", self.name),
            ));
        }
        check_numbers("rate_hz", &[self.rate_hz], 1e-3, 1e6, "Hz")?;
        if self.min_observations == 0 {
            return Err(Error::value("min_observations", "at least 1", 0));
        }
        if self.scene.len() > 100_000 {
            return Err(Error::value("scene", "at most 100000 objects", self.scene.len()));
        }
        self.camera.pinhole("camera")?;
        self.points.check("points")?;
        self.lines.check("lines")?;
        self.visibility.check("visibility")?;
        if let Some(noise) = &self.noise {
            noise.check()?;
        }
        Ok(())
    }
}
