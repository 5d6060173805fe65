//! The manifest of a converted sequence: origin, decisions, noise, what was recovered and left out.

use super::convert::{Options, RATE_HZ};
use super::decide::Judgement;
use super::graph::INITIAL;
use super::noise::FoundNoise;
use crate::family::Choice;
use crate::text_release::TextSequence;
use open_structure::structure::{
    Camera, CameraId, Clock, Exclusion, Generator, Manifest, Recovery, Sequence, Source, SourceFile, registry,
};
use std::collections::BTreeMap;

/// Name of the dataset that is converted.
const DATASET: &str = "open-structure-text";
/// Where it is published.
const URL: &str = "https://open-structure.github.io";
/// How to cite it.
const CITATION: &str = "Y. Li, Z. Guo, Z. Yang, Y. Sun, L. Zhao, F. Tombari: Open-Structure: Structural Benchmark Dataset for SLAM Algorithms. IEEE Robotics and Automation Letters, 2024.";

/// What was found while a sequence was converted.
#[derive(Clone, Debug)]
pub struct Findings {
    /// The camera, and why.
    pub choice: Choice,
    /// What the points of the association are.
    pub association_points: Option<Judgement>,
    /// What the lines of the association are.
    pub association_lines: Option<Judgement>,
    /// What the points of the graph's file are.
    pub graph_points: Option<Judgement>,
    /// What the lines of the graph's file are.
    pub graph_lines: Option<Judgement>,
    /// Noise of the measurements.
    pub noise: FoundNoise,
    /// What was recovered.
    pub recovered: Vec<Recovery>,
    /// What was left out.
    pub excluded: Vec<Exclusion>,
    /// What else people should know.
    pub notes: Vec<String>,
}

/// The manifest. It depends on the source's files, the options and this program's version alone.
pub(super) fn manifest(
    text: &TextSequence,
    sequence: &Sequence,
    findings: &Findings,
    options: &Options,
) -> Manifest {
    let choice = &findings.choice;
    let origin = choice.family.and_then(|family| family.origin);
    let pixel_origin = choice.family.map_or(registry::PIXEL_CENTER, |family| family.pixel_origin);
    let citation = origin.map_or_else(
        || CITATION.to_owned(),
        |origin| format!("{CITATION} Made from images of: {}", origin.citation),
    );
    let measured = !sequence.point_measurements.is_empty() || !sequence.line_measurements.is_empty();
    Manifest {
        name: text.name.clone(),
        description: Some(format!(
            "Sequence {} of the first text release of Open-Structure: points, lines and structural groups as a tracker sees them, with ground truth.",
            text.name
        )),
        source: Source {
            dataset: DATASET.to_owned(),
            sequence: Some(text.name.clone()),
            url: Some(URL.to_owned()),
            licence: origin.map(|origin| origin.licence.to_owned()),
            citation: Some(citation),
            files: text
                .provenance
                .iter()
                .map(|file| SourceFile {
                    name: file.name.clone(),
                    bytes: file.bytes,
                    sha256: file.sha256.clone(),
                })
                .collect(),
        },
        generator: Generator {
            tool: "os-convert".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: None,
            parameters: parameters(text, findings, options),
        },
        clock: Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: Some(RATE_HZ as f64) },
        cameras: vec![Camera::pinhole(CameraId(0), &choice.camera, pixel_origin)],
        noise: if measured { findings.noise.declared() } else { None },
        recovered: findings.recovered.clone(),
        excluded: findings.excluded.clone(),
        ..Manifest::default()
    }
}

fn parameters(text: &TextSequence, findings: &Findings, options: &Options) -> BTreeMap<String, String> {
    let choice = &findings.choice;
    let mut parameters = BTreeMap::new();
    let mut set = |key: &str, value: String| {
        parameters.insert(key.to_owned(), value);
    };
    if let Some(origin) = choice.family.and_then(|family| family.origin) {
        set("images.dataset", origin.dataset.to_owned());
        set("images.url", origin.url.to_owned());
    }
    set("stamps", format!("stamp_nanos = round(frame_id / {RATE_HZ} Hz); the source has no time stamps"));
    set("camera.family", choice.family_name().to_owned());
    set("camera.chosen_by", choice.by.to_owned());
    if let Some(residual) = choice.residual_px {
        set("camera.median_residual_px", format!("{residual:.3e}"));
    }
    if !choice.residuals_px.is_empty() {
        let all: Vec<String> =
            choice.residuals_px.iter().map(|(name, residual)| format!("{name} {residual:.3e}")).collect();
        set("camera.median_residuals_px", all.join(", "));
    }
    if let Some(camera) = options.camera {
        let open_structure::geometry::PinholeCamera { fx, fy, cx, cy, width, height } = camera;
        set("option.camera", format!("{fx},{fy},{cx},{cy},{width},{height}"));
    }
    for (key, judgement) in [
        ("association.points", &findings.association_points),
        ("association.lines", &findings.association_lines),
        ("graph.points", &findings.graph_points),
        ("graph.lines", &findings.graph_lines),
    ] {
        if let Some(judgement) = judgement {
            set(key, judgement.told());
        }
    }
    let FoundNoise { points_px, lines_px, depth_m, tails } = &findings.noise;
    for (key, spread, unit) in
        [("noise.points", points_px, "px"), ("noise.lines", lines_px, "px"), ("noise.depth", depth_m, "m")]
    {
        if let Some(spread) = spread {
            set(key, format!("found sigma {:.4e} {unit} from {} residuals", spread.sigma, spread.count));
        }
    }
    if let Some([above, below]) = tails {
        set("noise.depth_tails", format!("{above:.4} above and {below:.4} below 2.1 sigma"));
    }
    if let Some(graph) = &text.graph {
        set("graph", format!("`{INITIAL}` holds the vertices and rows of {}", graph.file));
    }
    for (name, value) in &text.system_parameter {
        set(&format!("source.{name}"), value.clone());
    }
    for (number, note) in (1..).zip(&findings.notes) {
        set(&format!("note.{number:02}"), note.clone());
    }
    parameters
}
