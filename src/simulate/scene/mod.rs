//! What the camera looks at: objects with faces, on which landmarks lie and which hide what is behind them.

mod corridor;
mod cuboid;
mod edges;
mod face;
mod mesh;
mod object;
mod placement;
mod staircase;

use std::path::Path;

use super::Error;

pub use corridor::RingCorridor;
pub use cuboid::{Cuboid, Room};
pub use face::{Edge, Face};
pub use mesh::Mesh;
pub use object::Object;
pub use placement::Placement;
pub(crate) use placement::check_numbers;
pub use staircase::Staircase;

/// Most faces that a scene may have.
const MAX_FACES: usize = 20_000_000;

/// The faces and edges of all objects, in `world`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Flat convex faces; they hide what is behind them, from either side.
    pub faces: Vec<Face>,
    /// Edges where faces meet at an angle, or end.
    pub edges: Vec<Edge>,
}

impl Scene {
    /// The scene of some objects.
    ///
    /// * `folder` — where names of mesh files start.
    ///
    /// # Errors
    /// [`Error::Value`] for numbers that make no object, [`Error::Io`] and [`Error::Content`] for mesh files.
    pub fn build(objects: &[Object], folder: &Path) -> Result<Self, Error> {
        let mut scene = Self::default();
        for (index, object) in objects.iter().enumerate() {
            object.check(&format!("scene[{index}]"))?;
            let object_id = u32::try_from(index).unwrap_or(u32::MAX);
            object.add_to(&mut scene, object_id, folder)?;
            if scene.faces.len() > MAX_FACES {
                return Err(Error::value("scene", format!("at most {MAX_FACES} faces"), scene.faces.len()));
            }
        }
        if scene.faces.is_empty() {
            return Err(Error::value("scene", "at least one object with a face", "none"));
        }
        Ok(scene)
    }

    /// Area of all faces, square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.faces.iter().map(Face::area).sum()
    }
}
