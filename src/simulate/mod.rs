//! Sequences out of nothing: scenes, trajectories, visibility and noise.
//!
//! Everything random takes a seed, and the same seed gives the same bits on every machine and any number
//! of threads: numbers come from `ChaCha8`, one stream per purpose and frame, and functions such as sine from
//! `libm`, for a platform's own differ in the last bit.

mod error;
mod landmarks;
pub mod noise;
mod random;
mod recipe;
pub mod scene;
mod simulation;
mod survey;
pub mod trajectory;
pub mod visibility;

pub use error::Error;
pub use random::Random;
pub use recipe::{
    CameraPreset, CameraRecipe, Density, Expected, LinesRecipe, MAX_RECIPE_BYTES, PointsRecipe, Recipe,
    named, names,
};
pub use simulation::{Simulation, simulate};
pub use survey::{SeenLine, Survey};
