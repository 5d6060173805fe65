//! Recipes of datasets: where the images of a sequence come from, and what made a sequence of them.
//!
//! Sixteen sequences of the paper, and two more of its release, come from images that others took. A recipe says
//! where those are published, under which licence, which files they are and with which camera they were taken.
//!
//! ```
//! let hospital = open_structure::datasets::named("hospital")?;
//! assert_eq!(hospital.licence, "CC-BY-4.0");
//! # Ok::<(), open_structure::datasets::Error>(())
//! ```

mod camera;
mod convert_options;
mod error;
mod library;
mod part;
mod recipe;
mod remote_file;

#[cfg(test)]
mod tests;

pub use camera::CameraOfDataset;
pub use convert_options::{ConvertOptions, OptionValue};
pub use error::Error;
pub use library::{named, names};
pub use part::Part;
pub use recipe::{Dataset, MAX_RECIPE_BYTES, Recipe};
pub use remote_file::RemoteFile;
