//! How many landmarks a recipe wants, and of what kind.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::simulate::Error;
use crate::simulate::scene::check_numbers;

/// Most landmarks of a kind.
const MAX_LANDMARKS: u32 = 50_000_000;

/// How much a frame sees, by and large.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Density {
    /// About 150 points and 30 segments in a frame.
    Rich,
    /// About 60 points and 12 segments in a frame.
    Medium,
    /// About 20 points and 4 segments in a frame.
    Low,
}

impl Density {
    /// Points that the median frame should see.
    #[must_use]
    pub const fn points_per_frame(self) -> f64 {
        match self {
            Self::Rich => 150.0,
            Self::Medium => 60.0,
            Self::Low => 20.0,
        }
    }

    /// Segments that the median frame should see.
    #[must_use]
    pub const fn lines_per_frame(self) -> f64 {
        0.2 * self.points_per_frame()
    }
}

/// Point landmarks, uniform on the surfaces of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(inline)]
pub struct PointsRecipe {
    /// Points of the sequence; every one is seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<u32>,
    /// Instead of a count: as many points as make frames see so much.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<Density>,
}

/// Line landmarks on the edges and faces of the scene.
///
/// Of all lines about the share `on_edges` lies on edges of objects, whole where they are not too long. Of the
/// others about the share `oblique` runs in a few oblique directions that they share, the share `free` in
/// directions of their own, and the rest along the sides of their faces. Lines of one direction make a
/// structural group; two that overlap within 1 cm are not drawn, so a scene with few edges has fewer lines on
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(inline)]
pub struct LinesRecipe {
    /// Lines of the sequence; every one is seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<u32>,
    /// Instead of a count: as many lines as make frames see so much.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<Density>,
    /// Least length, metres.
    #[schemars(extend("x-unit" = "m"))]
    pub min_length_m: f64,
    /// Greatest length, metres.
    #[schemars(extend("x-unit" = "m"))]
    pub max_length_m: f64,
    /// Share of lines on edges of objects.
    pub on_edges: f64,
    /// Share, of the lines on faces, of those in shared oblique directions.
    pub oblique: f64,
    /// Share, of the lines on faces, of those in directions of their own; they are in no group.
    pub free: f64,
    /// Oblique directions on each class of parallel faces.
    pub oblique_directions: u32,
}

impl Default for LinesRecipe {
    fn default() -> Self {
        Self {
            count: None,
            density: None,
            min_length_m: 0.1,
            max_length_m: 5.0,
            on_edges: 0.5,
            oblique: 0.3,
            free: 0.1,
            oblique_directions: 1,
        }
    }
}

fn check_count(count: Option<u32>, density: Option<Density>, place: &str) -> Result<(), Error> {
    if count.is_some() && density.is_some() {
        return Err(Error::value(place, "either count or density", "both"));
    }
    match count {
        Some(count) if count > MAX_LANDMARKS => {
            Err(Error::value(format!("{place}.count"), format!("at most {MAX_LANDMARKS}"), count))
        }
        _ => Ok(()),
    }
}

impl PointsRecipe {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_count(self.count, self.density, place)
    }
}

impl LinesRecipe {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_count(self.count, self.density, place)?;
        check_numbers(&format!("{place}.min_length_m"), &[self.min_length_m], 1e-4, 1e6, "m")?;
        check_numbers(&format!("{place}.max_length_m"), &[self.max_length_m], self.min_length_m, 1e6, "m")?;
        for (name, share) in [("on_edges", self.on_edges), ("oblique", self.oblique), ("free", self.free)] {
            check_numbers(&format!("{place}.{name}"), &[share], 0.0, 1.0, "of the lines")?;
        }
        let sum = self.oblique + self.free;
        if sum > 1.0 + 1e-9 {
            return Err(Error::value(place, "oblique + free of at most 1", sum));
        }
        if self.oblique_directions > 100 {
            return Err(Error::value(
                format!("{place}.oblique_directions"),
                "at most 100",
                self.oblique_directions,
            ));
        }
        Ok(())
    }
}
