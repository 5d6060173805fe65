//! `measure`: observations into measurements.

use std::collections::BTreeMap;

use open_structure::simulate::noise::{NoiseModel, NoiseRecipe};
use open_structure::stations::{self, MeasureRequest};
use pyo3::prelude::*;
use serde_json::json;

use crate::arguments::{Given, choice};
use crate::errors;
use crate::sequence::Sequence;
use crate::work;

/// The sequence with measurements of its observations, by a noise model of the registry; options as of ``os measure``.
///
/// Measurements that the sequence has are replaced, and so are noise, generator, correspondences and statistics. Estimates and
/// graphs were made from the old measurements and are left out. The same seed gives the same measurements, on any machine.
///
/// * ``noise``: ``none``, ``gaussian``, ``first-release``, ``paper`` or ``kinect-disparity``.
/// * ``seed``: seed of everything random.
/// * ``set``: parameters of the model, by the registry's names, such as ``{"sigma_px": 0.5}``.
/// * ``outliers``: part of the measurements that take the place of another landmark of the frame, 0 to 1.
/// * ``missed``: part of the observations that are not measured, 0 to 1.
/// * ``quantise``: round pixel positions to multiples of this, pixels.
/// * ``drop_outside``: leave out measurements that noise carries out of the image.
/// * ``keep_depth``: keep depths outside the depth range of the camera.
/// * ``keep_estimates``: keep trajectories, maps and graphs.
/// * ``complete_depths``: keep the measurements that are there, and give those without depth one, drawn about the true depth.
#[pyfunction]
#[pyo3(signature = (sequence, noise, *, seed = 0, set = None, outliers = None, missed = None, quantise = None, drop_outside = false, keep_depth = false, keep_estimates = false, complete_depths = false, name = None))]
#[expect(
    clippy::too_many_arguments,
    clippy::fn_params_excessive_bools,
    reason = "the options of a command, by name"
)]
pub(crate) fn measure(
    py: Python<'_>,
    sequence: Given<'_>,
    noise: &str,
    seed: u64,
    set: Option<BTreeMap<String, f64>>,
    outliers: Option<f64>,
    missed: Option<f64>,
    quantise: Option<f64>,
    drop_outside: bool,
    keep_depth: bool,
    keep_estimates: bool,
    complete_depths: bool,
    name: Option<String>,
) -> PyResult<Sequence> {
    let model = choice("noise", noise, &NoiseModel::ALL.map(|model| (model.name(), model)))?;
    let mut recipe = NoiseRecipe::new(model);
    for (name, value) in set.unwrap_or_default() {
        recipe.set(&name, value).map_err(errors::option)?;
    }
    recipe.outlier_fraction = outliers.or(recipe.outlier_fraction);
    recipe.missed_fraction = missed.or(recipe.missed_fraction);
    recipe.quantisation_px = quantise.or(recipe.quantisation_px);
    recipe.drop_outside |= drop_outside;
    recipe.keep_depth |= keep_depth;
    recipe.check().map_err(errors::option)?;
    let idle = [
        ("outliers", outliers.is_some()),
        ("missed", missed.is_some()),
        ("quantise", quantise.is_some()),
        ("drop_outside", drop_outside),
        ("keep_depth", keep_depth),
    ];
    if let Some((option, _)) = idle.iter().find(|(_, given)| complete_depths && *given) {
        return Err(errors::option(format!("{option} does not go with complete_depths")));
    }
    let (input, request) = (sequence.rows()?, MeasureRequest { recipe, seed, keep_estimates, name });
    let (made, summary) = work::run(py, errors::of_station, |_| {
        if complete_depths {
            let (made, done) = stations::complete_depths(&input, &request)?;
            let summary = json!({
                "points": done.points, "line_ends": done.line_ends, "triangulated": done.triangulated,
                "without": done.without,
            });
            Ok((made, summary))
        } else {
            let (made, done) = stations::measure(&input, &request)?;
            Ok((made, json!({ "points": done.points, "lines": done.lines })))
        }
    })?;
    Ok(Sequence::made(made, summary))
}
