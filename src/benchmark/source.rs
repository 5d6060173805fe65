//! Sequences by name: files, folders, and recipes of the simulator.

use std::path::{Path, PathBuf};

use super::Error;
use crate::format;
use crate::simulate::{self, Recipe};
use crate::storage;
use crate::structure::Sequence;

/// The sequence of a path or of a recipe's name, whole.
///
/// * `name` — an MCAP file, a Parquet folder, a recipe (`.toml`), or the name of a built-in recipe such as `box1`. A path that is there
///   goes before a name.
///
/// # Errors
/// [`Error::Format`], [`Error::Recipe`].
pub fn load(name: &str) -> Result<Sequence, Error> {
    let path = Path::new(name);
    let recipe = |cause| Error::Recipe { name: name.to_owned(), cause };
    let is_recipe = storage::without_query(path).extension().is_some_and(|extension| extension == "toml");
    if storage::exists(path) && !is_recipe {
        return Ok(format::read(path)?);
    }
    let (made, folder) = if is_recipe {
        let text = storage::read_to_string(path).map_err(Error::io(path))?;
        (Recipe::from_toml(&text).map_err(recipe)?, path.parent().map(Path::to_owned).unwrap_or_default())
    } else if simulate::names().contains(&name) {
        (simulate::named(name).map_err(recipe)?, PathBuf::new())
    } else {
        // Says that nothing is there, and what was expected.
        return Ok(format::read(path)?);
    };
    simulated(&made, &folder).map_err(recipe)
}

fn simulated(recipe: &Recipe, folder: &Path) -> Result<Sequence, simulate::Error> {
    let simulation = simulate::simulate(recipe, folder, &|_, _, _| {})?;
    let mut sequence = Sequence {
        manifest: simulation.manifest(),
        frames: simulation.frames().to_vec(),
        point_landmarks: simulation.point_landmarks(),
        line_landmarks: simulation.line_landmarks()?,
        structural_groups: simulation.structural_groups().to_vec(),
        ..Sequence::default()
    };
    for bundle in simulation.bundles() {
        sequence.point_observations.extend(bundle.point_observations);
        sequence.line_observations.extend(bundle.line_observations);
    }
    sequence.sort();
    Ok(sequence)
}
