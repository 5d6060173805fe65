//! Observations into measurements, and measurements without depth into ones with it.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Error;
use super::simulate::count;
use crate::simulate::noise::{CompletedDepths, NoiseRecipe};
use crate::structure::{
    FrameBundle, LineMeasurement, Manifest, PointMeasurement, Record as _, Recovery, Sequence, registry,
};

/// How to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasureRequest {
    /// The noise.
    pub recipe: NoiseRecipe,
    /// Seed of everything random.
    pub seed: u64,
    /// Keep trajectories, maps and graphs, which were made from other measurements.
    pub keep_estimates: bool,
    /// Name of the sequence; by default that of the input.
    pub name: Option<String>,
}

impl MeasureRequest {
    /// Measurements with some noise, of the first seed.
    #[must_use]
    pub const fn new(recipe: NoiseRecipe) -> Self {
        Self { recipe, seed: 0, keep_estimates: false, name: None }
    }
}

impl MeasureRequest {
    /// Refuses a name that no sequence can have.
    ///
    /// # Errors
    /// [`Error::Name`].
    pub fn check_name(&self) -> Result<(), Error> {
        self.name.as_deref().map_or(Ok(()), super::check_sequence_name)
    }
}

/// What measuring did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeasureSummary {
    /// Points measured.
    pub points: usize,
    /// Lines measured.
    pub lines: usize,
}

/// Measures the observations of a sequence anew.
///
/// Measurements that the sequence has are replaced, and so are noise, generator, correspondences and statistics. The same seed gives
/// the same measurements, on any machine.
///
/// # Errors
/// [`Error::Name`], [`Error::UnknownCamera`], [`Error::Missing`] where there is nothing to measure, and [`Error::Simulate`] for noise out of range.
pub fn measure(input: &Sequence, request: &MeasureRequest) -> Result<(Sequence, MeasureSummary), Error> {
    request.recipe.check()?;
    request.check_name()?;
    let cameras = &input.manifest;
    if let Some(frame) = input.frames.iter().find(|frame| cameras.camera(frame.camera_id).is_none()) {
        return Err(Error::UnknownCamera { frame: frame.frame_id, camera: frame.camera_id });
    }
    if input.point_observations.is_empty() && input.line_observations.is_empty() {
        return Err(Error::Missing { missing: "observations to measure", remedy: "" });
    }
    let mut sequence = kept(input, request.keep_estimates);
    sequence.manifest = measured_manifest(&input.manifest, request);
    sequence.point_observations.clone_from(&input.point_observations);
    sequence.line_observations.clone_from(&input.line_observations);
    sequence.sort();
    let bundles: Vec<FrameBundle> = sequence.bundles().collect();
    let measured: Vec<_> = bundles
        .par_iter()
        .filter_map(|bundle| {
            let camera = cameras.camera(bundle.frame.camera_id)?;
            let (points, lines) = (&bundle.point_observations, &bundle.line_observations);
            Some(request.recipe.measure(camera, bundle.frame.frame_id, points, lines, request.seed))
        })
        .collect();
    for (points, lines) in measured {
        sequence.point_measurements.extend(points);
        sequence.line_measurements.extend(lines);
    }
    count(&mut sequence);
    let summary =
        MeasureSummary { points: sequence.point_measurements.len(), lines: sequence.line_measurements.len() };
    Ok((sequence, summary))
}

/// The tables that do not depend on measurements; those that do where they are to be kept.
fn kept(input: &Sequence, keep_estimates: bool) -> Sequence {
    let mut sequence = Sequence {
        frames: input.frames.clone(),
        point_landmarks: input.point_landmarks.clone(),
        line_landmarks: input.line_landmarks.clone(),
        structural_groups: input.structural_groups.clone(),
        // Unrefined lines were recovered from observations, which are still the same.
        map_lines: input
            .map_lines
            .iter()
            .filter(|row| keep_estimates || row.estimate == registry::UNREFINED)
            .cloned()
            .collect(),
        ..Sequence::default()
    };
    if keep_estimates {
        sequence.trajectories.clone_from(&input.trajectories);
        sequence.map_points.clone_from(&input.map_points);
        sequence.graph_poses.clone_from(&input.graph_poses);
        sequence.graph_points.clone_from(&input.graph_points);
        sequence.graph_lines.clone_from(&input.graph_lines);
        sequence.graph_factors.clone_from(&input.graph_factors);
    }
    sequence
}

/// Keeps the measurements of a sequence, and gives those without depth one, drawn about the true depth.
///
/// # Errors
/// [`Error::Name`], [`Error::Missing`] where there are no measurements, and [`Error::Simulate`] for noise out of range.
pub fn complete_depths(
    input: &Sequence,
    request: &MeasureRequest,
) -> Result<(Sequence, CompletedDepths), Error> {
    let MeasureRequest { recipe, seed, keep_estimates, .. } = request;
    recipe.check()?;
    request.check_name()?;
    if input.point_measurements.is_empty() && input.line_measurements.is_empty() {
        return Err(Error::Missing { missing: "measurements whose depth could be completed", remedy: "" });
    }
    let mut sequence = input.clone();
    let done = recipe.complete_depths(&mut sequence, *seed);
    sequence.manifest = measured_manifest(&input.manifest, request);
    // Pixels stay as they were measured, and so does what was declared of them.
    if let Some(noise) = input.manifest.noise.as_ref().filter(|noise| noise.model == recipe.model.name()) {
        sequence.manifest.noise = Some(noise.clone());
    }
    sequence.manifest.recovered.clone_from(&input.manifest.recovered);
    for (table, rows) in [("point_measurements", done.points), ("line_measurements", done.line_ends)] {
        if rows > 0 {
            sequence.manifest.recovered.push(completed(table, rows));
        }
    }
    if !keep_estimates {
        sequence.trajectories.clear();
        sequence.map_points.clear();
        sequence.map_lines.retain(|row| row.estimate == registry::UNREFINED);
        sequence.tracking.clear();
        sequence.iterations.clear();
        sequence.graph_poses.clear();
        sequence.graph_points.clear();
        sequence.graph_lines.clear();
        sequence.graph_factors.clear();
    }
    Ok((sequence, done))
}

/// What a manifest says about depths that were drawn.
fn completed(table: &str, rows: usize) -> Recovery {
    let columns =
        if table == PointMeasurement::TABLE.name { &["depth"][..] } else { &["start_depth", "end_depth"] };
    let columns = columns.iter().map(|column| (*column).to_owned()).collect();
    Recovery {
        table: table.to_owned(),
        columns,
        rows: rows as u64,
        method: "drawn about the depth of the landmark in the true camera, by the noise model".to_owned(),
        ids: Vec::new(),
    }
}

/// The tool's name in a manifest.
const TOOL: &str = "os measure";

/// The manifest of a sequence whose measurements were made anew.
#[must_use]
pub fn measured_manifest(input: &Manifest, request: &MeasureRequest) -> Manifest {
    let MeasureRequest { recipe, seed, keep_estimates, name } = request;
    let mut manifest = input.clone();
    if let Some(name) = name {
        manifest.name.clone_from(name);
    }
    registry::SPEC_VERSION.clone_into(&mut manifest.spec_version);
    manifest.noise = Some(recipe.declared(*seed));
    manifest.tables.clear();
    let generator = &mut manifest.generator;
    let before = format!("{} {}", generator.tool, generator.version);
    let before_seed = generator.seed.map(|seed| seed.to_string());
    // What was measured before is measured anew: then the generator before that one counts.
    if generator.tool != TOOL {
        let entries = [("from", Some(before)), ("from_seed", before_seed)];
        let entries = entries.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?)));
        generator.parameters.extend(entries.collect::<BTreeMap<_, _>>());
    }
    TOOL.clone_into(&mut generator.tool);
    env!("CARGO_PKG_VERSION").clone_into(&mut generator.version);
    generator.seed = Some(*seed);
    let made_anew = [PointMeasurement::TABLE.name, LineMeasurement::TABLE.name];
    let made_of_them =
        ["trajectories", "map_points", "graph_poses", "graph_points", "graph_lines", "graph_factors"];
    manifest.recovered.retain(|entry| {
        let table = entry.table.as_str();
        !made_anew.contains(&table) && (*keep_estimates || !made_of_them.contains(&table))
    });
    manifest
}
