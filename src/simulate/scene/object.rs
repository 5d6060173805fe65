//! The kinds of objects that a recipe may put into a scene.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Cuboid, Mesh, RingCorridor, Room, Scene, Staircase};
use crate::simulate::Error;

/// An object of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Object {
    /// A box in any pose.
    Box(Cuboid),
    /// A room, seen from inside.
    Room(Room),
    /// A corridor round a square block.
    RingCorridor(RingCorridor),
    /// A straight flight of stairs.
    Staircase(Staircase),
    /// A triangle mesh from a file.
    Mesh(Mesh),
}

impl Object {
    /// Looks at the numbers; `place` says where the object stands in the recipe.
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        match self {
            Self::Box(cuboid) | Self::Room(cuboid) => cuboid.check(place),
            Self::RingCorridor(corridor) => corridor.check(place),
            Self::Staircase(staircase) => staircase.check(place),
            Self::Mesh(mesh) => mesh.check(place),
        }
    }

    pub(super) fn add_to(&self, scene: &mut Scene, object: u32, folder: &Path) -> Result<(), Error> {
        match self {
            Self::Box(cuboid) | Self::Room(cuboid) => cuboid.add_to(scene, object),
            Self::RingCorridor(corridor) => corridor.add_to(scene, object),
            Self::Staircase(staircase) => staircase.add_to(scene, object),
            Self::Mesh(mesh) => mesh.add_to(scene, object, folder)?,
        }
        Ok(())
    }
}
