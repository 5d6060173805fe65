//! A recipe into a sequence.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::Error;
use crate::datasets;
use crate::simulate::{self, MAX_RECIPE_BYTES, Recipe, Simulation};
use crate::storage::{self, File};
use crate::structure::{Sequence, frame_statistics, line_correspondences, point_correspondences};

/// A recipe, and the folder in which names of files in it start.
///
/// * `name` — a recipe that travels with the library, such as `box1`, or a file: TOML, or JSON as a simulated sequence carries it in its
///   manifest.
///
/// # Errors
/// [`Error::FromImages`] for a sequence that is not simulated, [`Error::RecipeFile`], [`Error::RecipeSize`], [`Error::Recipe`] and
/// [`Error::RecipeJson`].
pub fn simulation_recipe(name: &str) -> Result<(Recipe, PathBuf), Error> {
    let path = Path::new(name);
    let wrong = |cause| Error::Recipe { name: name.to_owned(), cause };
    if storage::is_folder(path) || (!storage::exists(path) && path.extension().is_none()) {
        if datasets::names().contains(&name) {
            return Err(Error::FromImages { name: name.to_owned() });
        }
        // A name of ours goes before a folder of that name, such as an output that stands beside.
        return Ok((simulate::named(name)?, PathBuf::new()));
    }
    let unread = |cause| Error::RecipeFile { path: path.to_owned(), cause };
    let mut text = String::new();
    let file = File::open(path).map_err(unread)?;
    let bytes = file.take(MAX_RECIPE_BYTES + 1).read_to_string(&mut text).map_err(unread)?;
    if bytes as u64 > MAX_RECIPE_BYTES {
        return Err(Error::RecipeSize { path: path.to_owned(), limit: MAX_RECIPE_BYTES });
    }
    let recipe = if storage::without_query(path).extension().is_some_and(|extension| extension == "json") {
        let recipe: Recipe = serde_json::from_str(&text)
            .map_err(|cause| Error::RecipeJson { name: name.to_owned(), cause })?;
        recipe.check().map_err(wrong)?;
        recipe
    } else {
        Recipe::from_toml(&text).map_err(wrong)?
    };
    Ok((recipe, path.parent().map(Path::to_owned).unwrap_or_default()))
}

/// The sequence of a recipe, with correspondences and statistics.
///
/// * `folder` — where names of files in the recipe start.
/// * `progress` — told the stage, how many frames are done, and of how many.
///
/// # Errors
/// Those of [`simulate::simulate`].
pub fn simulate(
    recipe: &Recipe,
    folder: &Path,
    progress: &(dyn Fn(&'static str, u64, u64) + Sync),
) -> Result<Sequence, Error> {
    let simulation: Simulation = simulate::simulate(recipe, folder, progress)?;
    let mut sequence = Sequence {
        manifest: simulation.manifest(),
        frames: simulation.frames().to_vec(),
        point_landmarks: simulation.point_landmarks(),
        line_landmarks: simulation.line_landmarks()?,
        structural_groups: simulation.structural_groups().to_vec(),
        ..Sequence::default()
    };
    let total = sequence.frames.len() as u64;
    for (done, bundle) in (1..).zip(simulation.bundles()) {
        sequence.point_observations.extend(bundle.point_observations);
        sequence.line_observations.extend(bundle.line_observations);
        sequence.point_measurements.extend(bundle.point_measurements);
        sequence.line_measurements.extend(bundle.line_measurements);
        progress("measuring", done, total);
    }
    count(&mut sequence);
    Ok(sequence)
}

/// Makes correspondences and statistics of what the frames show.
pub(super) fn count(sequence: &mut Sequence) {
    sequence.sort();
    sequence.point_correspondences =
        point_correspondences(&sequence.point_measurements, &sequence.point_observations);
    sequence.line_correspondences =
        line_correspondences(&sequence.line_measurements, &sequence.line_observations);
    sequence.frame_statistics = frame_statistics(sequence);
}
