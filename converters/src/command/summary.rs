//! What was converted, as a table for people and as JSON for machines.

use crate::family::Choice;
use crate::release::{Converted, Findings};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets::NOTHING};
use open_structure::format::Encoding;
use open_structure::structure::{Exclusion, Noise, Recovery};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What is said about one converted sequence.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Summary {
    sequence: String,
    output: PathBuf,
    encoding: &'static str,
    frames: usize,
    points: usize,
    lines: usize,
    point_observations: usize,
    line_observations: usize,
    point_measurements: usize,
    line_measurements: usize,
    groups: usize,
    graph_factors: usize,
    estimates: Vec<String>,
    camera: String,
    camera_chosen_by: &'static str,
    camera_residual_px: Option<f64>,
    camera_doubtful: bool,
    noise: Option<Noise>,
    recovered: Vec<Recovery>,
    excluded: Vec<Exclusion>,
    notes: Vec<String>,
}

/// What is said about a sequence that failed.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Failure {
    pub(super) sequence: String,
    pub(super) error: String,
}

/// The whole report.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Report {
    pub(super) tool: &'static str,
    pub(super) version: &'static str,
    pub(super) sequences: Vec<Summary>,
    pub(super) failed: Vec<Failure>,
    /// Files that belong to no sequence.
    pub(super) passed_over: Vec<String>,
}

impl Summary {
    /// What there is to say about a converted sequence.
    pub(super) fn of(converted: &Converted, output: &Path, encoding: Encoding) -> Self {
        let Converted { sequence, findings } = converted;
        let Findings { choice, recovered, excluded, notes, .. } = findings;
        let mut estimates: Vec<String> =
            sequence.trajectories.iter().map(|row| row.estimate.clone()).collect();
        estimates.extend(sequence.map_points.iter().map(|row| row.estimate.clone()));
        estimates.extend(sequence.map_lines.iter().map(|row| row.estimate.clone()));
        estimates.sort();
        estimates.dedup();
        Self {
            sequence: sequence.manifest.name.clone(),
            output: output.to_owned(),
            encoding: encoding.name(),
            frames: sequence.frames.len(),
            points: sequence.point_landmarks.len(),
            lines: sequence.line_landmarks.len(),
            point_observations: sequence.point_observations.len(),
            line_observations: sequence.line_observations.len(),
            point_measurements: sequence.point_measurements.len(),
            line_measurements: sequence.line_measurements.len(),
            groups: sequence.structural_groups.len(),
            graph_factors: sequence.graph_factors.len(),
            estimates,
            camera: choice.family_name().to_owned(),
            camera_chosen_by: choice.by,
            camera_residual_px: choice.residual_px,
            camera_doubtful: is_doubtful(choice),
            noise: sequence.manifest.noise.clone(),
            recovered: recovered.clone(),
            excluded: excluded.clone(),
            notes: notes.clone(),
        }
    }

    /// Whether people should look at it.
    pub(super) fn has_findings(&self) -> bool {
        self.camera_doubtful || !self.excluded.is_empty()
    }

    fn camera_cell(&self) -> String {
        let doubt = if self.camera_doubtful { " (?)" } else { "" };
        let residual = self.camera_residual_px.map_or_else(
            || format!("by {}", self.camera_chosen_by),
            |residual| format!("{} px", significant(residual)),
        );
        format!("{}{doubt} {residual}", self.camera)
    }

    fn noise_cell(&self) -> String {
        let Some(noise) = &self.noise else { return "–".to_owned() };
        let mut cell = noise.model.clone();
        for (name, unit) in [("sigma_px", "px"), ("sigma_depth_m", "m")] {
            if let Some(value) = noise.parameters.get(name) {
                cell = format!("{cell} {value} {unit}");
            }
        }
        cell
    }

    fn recovered_cell(&self) -> String {
        let told = self.recovered.iter().map(|recovery| {
            let what = match recovery.table.as_str() {
                "point_observations" => "depths",
                "map_lines" => "unrefined lines",
                "line_landmarks" => "line landmarks",
                "point_landmarks" => "point landmarks",
                other => other,
            };
            format!("{} {what}", recovery.rows)
        });
        told.collect::<Vec<_>>().join(", ")
    }
}

fn is_doubtful(choice: &Choice) -> bool {
    choice.is_doubtful() || (choice.by == "default")
}

/// Two significant digits, as few zeros as possible.
fn significant(value: f64) -> String {
    if value >= 0.1 { format!("{value:.2}") } else { format!("{value:.1e}") }
}

/// The table, the remarks, and what was left out, for people.
pub(super) fn render(report: &Report) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    table.set_header([
        "sequence",
        "frames",
        "points",
        "lines",
        "observations",
        "measurements",
        "groups",
        "camera, residual",
        "noise",
        "recovered",
        "excluded",
    ]);
    for summary in &report.sequences {
        table.add_row([
            summary.sequence.clone(),
            summary.frames.to_string(),
            summary.points.to_string(),
            summary.lines.to_string(),
            format!("{} + {}", summary.point_observations, summary.line_observations),
            format!("{} + {}", summary.point_measurements, summary.line_measurements),
            summary.groups.to_string(),
            summary.camera_cell(),
            summary.noise_cell(),
            summary.recovered_cell(),
            summary.excluded.iter().map(|exclusion| exclusion.count).sum::<u64>().to_string(),
        ]);
    }
    for column in [1, 2, 3, 4, 5, 6, 10] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let mut lines = Vec::new();
    if !report.sequences.is_empty() {
        lines.push(table.to_string());
    }
    for summary in &report.sequences {
        for Exclusion { file, reason, count, first_line } in &summary.excluded {
            let at = first_line.map_or_else(String::new, |line| format!(":{line}"));
            lines.push(format!("{}: excluded {count}: {file}{at}: {reason}", summary.sequence));
        }
        for note in &summary.notes {
            lines.push(format!("{}: note: {note}", summary.sequence));
        }
    }
    lines.extend(report.passed_over.iter().map(|passed| format!("passed over: {passed}")));
    lines.into_iter().map(|line| line + "\n").collect()
}
