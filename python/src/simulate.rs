//! `simulate`: a sequence out of a recipe.

use std::path::PathBuf;

use open_structure::simulate::{Recipe, names};
use open_structure::stations;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::errors;
use crate::sequence::Sequence;
use crate::work;

/// Names of the recipes that travel with the package: the simulated sequences of the paper.
#[pyfunction]
pub(crate) fn recipes() -> Vec<&'static str> {
    names()
}

/// A sequence out of a recipe: a scene, a path through it, what each frame sees, and noise.
///
/// The same recipe and seed give the same bits on any machine, and the same tables as ``os simulate``.
///
/// * ``recipe``: a name of ``recipes()``, a TOML or JSON file, or a dictionary with what such a file has.
/// * ``seed``: seed of everything random, instead of the recipe's.
#[pyfunction]
#[pyo3(signature = (recipe, *, seed = None))]
pub(crate) fn simulate(py: Python<'_>, recipe: &Bound<'_, PyAny>, seed: Option<u64>) -> PyResult<Sequence> {
    let (mut recipe, folder) = if let Ok(recipe) = recipe.cast::<PyDict>() {
        let options = PyDict::new(py);
        // Numbers of numpy.
        options.set_item("default", py.import("operator")?.call_method1("methodcaller", ("item",))?)?;
        options.set_item("allow_nan", false)?;
        let text = py.import("json")?.call_method("dumps", (recipe,), Some(&options));
        let text: String =
            text.map_err(|cause| errors::option(format!("recipe: {}", cause.value(py))))?.extract()?;
        let recipe: Recipe =
            serde_json::from_str(&text).map_err(|cause| errors::option(format!("recipe: {cause}")))?;
        (recipe, PathBuf::new())
    } else {
        let name: PathBuf = recipe.extract()?;
        let Some(name) = name.to_str() else {
            return Err(errors::option(format!(
                "recipe: expected a name in UTF-8, found {}",
                name.display()
            )));
        };
        work::run(py, errors::of_station, |_| stations::simulation_recipe(name))?
    };
    recipe.seed = seed.unwrap_or(recipe.seed);
    let made = work::run(py, errors::of_station, |watch| {
        stations::simulate(&recipe, &folder, &|_, _, _| watch.progress())
    })?;
    let summary = json!({
        "frames": made.frames.len(),
        "points": made.point_landmarks.len(),
        "lines": made.line_landmarks.len(),
        "groups": made.structural_groups.len(),
        "point_observations": made.point_observations.len(),
        "line_observations": made.line_observations.len(),
    });
    Ok(Sequence::made(made, summary))
}
