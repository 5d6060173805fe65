//! Everything that a page shows of one sequence.

use std::path::Path;

use super::comparison::{Comparison, Tables};
use super::convergence::Run;
use super::error::Error;
use super::features::Gathered;
use super::scene::{self, Landmarks};
use super::view_data::{Shown, ViewData, ViewPath};
use super::{ReportOptions, charts};
use crate::evaluate::EvaluateOptions;
use crate::format::{self, SequenceReader};
use crate::plot::{self, Scene, ViewFrom};
use crate::statistics::{Analysed, Analysis, Counted};
use crate::structure::{
    Frame, GraphLine, GraphPoint, Iteration, LineLandmark, LineMeasurement, Manifest, MapLine, MapPoint,
    PointLandmark, PointMeasurement, StructuralGroup, TrajectoryPose,
};
use crate::validate;

/// Everything that a page shows of one sequence.
#[derive(Clone, Debug)]
pub struct SequenceReport {
    /// Name of the file or folder without its ending.
    pub file: String,
    /// `MCAP file` or `Parquet folder`.
    pub encoding: &'static str,
    /// Size on disk, bytes.
    pub bytes: u64,
    /// What the sequence says of itself.
    pub manifest: Manifest,
    /// The frames.
    pub frames: Vec<Frame>,
    /// Statistics of the sequence and of each frame.
    pub analysed: Analysed,
    /// Estimates against the truth.
    pub comparison: Comparison,
    /// Costs over the steps of optimisers.
    pub runs: Vec<Run>,
    /// What the validator found.
    pub validation: validate::Report,
    /// A picture of the scene, SVG, for where none can be drawn anew; `None` where nothing has a place.
    pub(super) still: Option<String>,
    pub(super) landmarks: Landmarks,
    /// Whether a line is in no group.
    pub(super) has_ungrouped: bool,
    pub(super) view: ViewData,
}

impl SequenceReport {
    /// Reads a sequence once, validates it and compares its estimates.
    ///
    /// # Errors
    /// Those of [`format::open`] and of reading its tables.
    pub fn of(path: &Path, options: &ReportOptions<'_>) -> Result<Self, Error> {
        let reader = format::open(path)?;
        let manifest = reader.manifest().clone();
        let frames = reader.frame_list()?.to_vec();
        let (points, lines) = (reader.table::<PointLandmark>()?, reader.table::<LineLandmark>()?);
        let (map_points, map_lines) = (reader.table::<MapPoint>()?, reader.table::<MapLine>()?);
        let trajectories = reader.table::<TrajectoryPose>()?;
        let groups = reader.table::<StructuralGroup>()?;
        let (analysed, gathered) = pass(&reader, &groups, options)?;

        let tables = Tables {
            frames: &frames,
            points: &points,
            lines: &lines,
            trajectories: &trajectories,
            map_points: &map_points,
            map_lines: &map_lines,
        };
        let comparison = Comparison::of(&tables, &EvaluateOptions::default());
        let mut landmarks = Landmarks::new(&points, &lines);
        if landmarks.is_empty() {
            landmarks = Landmarks::of_map(&map_points, &map_lines);
        }
        if landmarks.is_empty() {
            landmarks = Landmarks::of_graph(&reader.table::<GraphPoint>()?, &reader.table::<GraphLine>()?);
        }
        landmarks.add_shown(&gathered);

        let edges = options.edges.map(|edges| edges(&manifest)).unwrap_or_default();
        let picture = Scene {
            manifest: &manifest,
            frames: &frames,
            points: &points,
            lines: &lines,
            groups: &groups,
            edges: &edges,
        };
        let still = plot::scene_picture(&picture, ViewFrom::OBLIQUE).ok();
        let (shown_groups, places) = scene::groups(&groups);
        let has_ungrouped = landmarks.has_lines_beside(&places);
        let mut paths = vec![(
            ViewPath { name: "ground truth".to_owned(), class: "truth".to_owned() },
            scene::true_path(&frames),
        )];
        paths.extend(comparison.estimates.iter().enumerate().map(|(place, estimate)| {
            let path = ViewPath { name: estimate.name.clone(), class: charts::series(place) };
            (path, estimate.path(&frames))
        }));
        let view = ViewData::new(Shown {
            manifest: &manifest,
            frames: &frames,
            landmarks: &landmarks,
            groups: shown_groups,
            places: &places,
            edges: &edges,
            paths,
            upward: plot::upward(&manifest.cameras, &frames),
            gathered: &gathered,
        });

        let progress = options.progress;
        let update = |done, total| {
            if let Some(progress) = progress {
                progress("validating", done, total);
            }
        };
        let rules = validate::Options { progress: Some(&update), ..validate::Options::default() };
        let mut validation = validate::validate(path, &rules)?;
        // The same page wherever the file lies.
        validation.path = None;
        Ok(Self {
            file: reader.file_name(),
            encoding: reader.encoding().name(),
            bytes: format::stored_bytes(path),
            runs: Run::of(&reader.table::<Iteration>()?),
            manifest,
            frames,
            analysed,
            comparison,
            validation,
            still,
            has_ungrouped,
            landmarks,
            view,
        })
    }

    /// Whether a rule that has to be followed is broken, or an estimate could not be compared.
    #[must_use]
    pub fn has_findings(&self) -> bool {
        !self.validation.conformant
            || self.comparison.estimates.iter().any(|estimate| estimate.problem.is_some())
    }
}

/// One way through the frames: statistics, and what is drawn of each.
fn pass(
    reader: &SequenceReader,
    groups: &[StructuralGroup],
    options: &ReportOptions<'_>,
) -> Result<(Analysed, Gathered), Error> {
    let counted = Counted {
        measured_points: reader.has_rows::<PointMeasurement>()?,
        measured_lines: reader.has_rows::<LineMeasurement>()?,
    };
    let mut analysis = Analysis::new(reader.manifest(), groups, counted);
    let cameras = &reader.manifest().cameras;
    let mut gathered = Gathered::new(cameras, counted.measured_points, counted.measured_lines);
    let total = reader.frame_list()?.len() as u64;
    for (done, frame) in (1..).zip(reader.frames()?) {
        let frame = frame?;
        gathered.add(&frame);
        analysis.add(frame);
        if let Some(progress) = options.progress {
            progress("reading", done, total);
        }
    }
    Ok((analysis.finish(), gathered))
}
