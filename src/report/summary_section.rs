//! What a sequence is, on one card.

use maud::{Markup, html};

use super::SequenceReport;
use super::numbers::{bytes, count, short};
use crate::structure::{Camera, Manifest, MotionGrade, registry};
use crate::validate::Severity;

pub(super) fn section(report: &SequenceReport) -> Markup {
    let found = &report.analysed.sequence;
    let with_truth = report.frames.iter().filter(|frame| frame.world_from_camera().is_some()).count() as u64;
    html! {
        section.card aria-label="Summary" {
            ul.tiles {
                (tile(&count(found.frame_count), "frames", &format!("{} s", short(found.duration_seconds))))
                (tile(&count(found.points.rows), &words(found.points.table), &format!("of {} points", count(found.points.landmarks))))
                (tile(&count(found.lines.rows), &words(found.lines.table), &format!("of {} lines", count(found.lines.landmarks))))
                (tile(&count(report.view.groups().len() as u64), "structural groups", &grouped(report)))
                @if let Some(motion) = &found.motion {
                    (tile(&format!("{} m", short(motion.path_length_m)), "path", motion.grade.map_or("", rotation)))
                }
                @if !report.comparison.estimates.is_empty() {
                    (tile(&count(report.comparison.estimates.len() as u64), "estimates", "compared below"))
                }
            }
            dl.facts {
                @for (name, value) in facts(report, with_truth) {
                    div { dt { (name) } dd { (value) } }
                }
            }
            (provenance(&report.manifest))
        }
    }
}

fn tile(number: &str, what: &str, note: &str) -> Markup {
    html! { li { strong { (number) } span { (what) } @if !note.is_empty() { small { (note) } } } }
}

/// The name of a table in words.
fn words(table: &str) -> String {
    table.replace('_', " ")
}

fn rotation(grade: MotionGrade) -> &'static str {
    match grade {
        MotionGrade::Slow => "slow rotation",
        MotionGrade::Medium => "medium rotation",
        MotionGrade::Sharp => "sharp rotation",
    }
}

fn grouped(report: &SequenceReport) -> String {
    let lines: usize = report.view.groups().iter().map(|group| group.lines).sum();
    format!("with {} lines", count(lines as u64))
}

/// Whether the sequence conforms, in words and as a class.
pub(super) fn verdict(report: &SequenceReport) -> (&'static str, String) {
    let found = &report.validation;
    let [errors, warnings] = [Severity::Error, Severity::Warning].map(|severity| found.count(severity));
    let plural = |number: u64, one: &str, many: &str| {
        format!("{} {}", count(number), if number == 1 { one } else { many })
    };
    match (errors, warnings) {
        (0, 0) => ("good", "conformant".to_owned()),
        (0, _) => ("warned", format!("conformant, {}", plural(warnings, "warning", "warnings"))),
        (_, _) => ("bad", format!("not conformant, {}", plural(errors, "error", "errors"))),
    }
}

fn facts(report: &SequenceReport, with_truth: u64) -> Vec<(&'static str, String)> {
    let manifest = &report.manifest;
    let mut facts = vec![
        ("File", format!("{}, {}, {}", report.file, report.encoding, bytes(report.bytes))),
        ("True poses", format!("{} of {} frames", count(with_truth), count(report.frames.len() as u64))),
    ];
    if manifest.cameras.len() == 1 {
        facts.extend(manifest.cameras.iter().map(|camera| ("Camera", camera_words(camera))));
    } else {
        facts.push(("Cameras", count(manifest.cameras.len() as u64)));
    }
    facts.push(("Noise", noise(manifest)));
    let clock = match (manifest.clock.kind.as_str(), manifest.clock.rate_hz) {
        (registry::SYNTHETIC, Some(rate)) => format!("synthetic, {} Hz", short(rate)),
        (kind, _) => kind.to_owned(),
    };
    facts.push(("Clock", clock));
    let source = &manifest.source;
    let of = source.sequence.as_ref().map(|name| format!(", {name}")).unwrap_or_default();
    facts.push(("Source", format!("{}{of}", source.dataset)));
    facts.extend(source.licence.as_ref().map(|licence| ("Licence", licence.clone())));
    let generator = &manifest.generator;
    let seed = generator.seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
    facts.push(("Made by", format!("{} {}{seed}", generator.tool, generator.version)));
    facts.push(("Specification", manifest.spec_version.clone()));
    facts
}

fn camera_words(camera: &Camera) -> String {
    let Camera { model, width, height, fx, fy, cx, cy, .. } = camera;
    format!("{model}, {width} × {height} px, f {fx} / {fy} px, centre {cx} / {cy} px")
}

fn noise(manifest: &Manifest) -> String {
    let Some(noise) = &manifest.noise else { return "none declared".to_owned() };
    let parameters: Vec<String> =
        noise.parameters.iter().map(|(name, value)| format!("{name} {}", short(*value))).collect();
    let seed = noise.seed.map(|seed| format!("seed {seed}"));
    let all: Vec<String> = std::iter::once(noise.model.clone()).chain(parameters).chain(seed).collect();
    all.join(", ")
}

/// Citation, and what was recovered or left out.
fn provenance(manifest: &Manifest) -> Markup {
    let source = &manifest.source;
    let parameters = &manifest.generator.parameters;
    if source.citation.is_none()
        && source.url.is_none()
        && manifest.recovered.is_empty()
        && manifest.excluded.is_empty()
        && parameters.is_empty()
    {
        return html! {};
    }
    html! {
        details.data {
            summary { "Where it comes from" }
            @if let Some(citation) = &source.citation { p { (citation) } }
            // Not a link: what a file names is not followed by one touch.
            @if let Some(url) = &source.url { p { code { (url) } } }
            @if !manifest.recovered.is_empty() {
                h3.small { "Recovered: what the source lacks, computed from the rest of it" }
                ul { @for row in &manifest.recovered {
                    li { (row.table) ", " (count(row.rows)) " rows: " (row.method) }
                } }
            }
            @if !manifest.excluded.is_empty() {
                h3.small { "Left out of the source" }
                ul { @for row in &manifest.excluded {
                    li { (row.file) ", " (count(row.count)) " times: " (row.reason) }
                } }
            }
            @if !parameters.is_empty() {
                h3.small { "Parameters" }
                dl.facts { @for (name, value) in parameters {
                    div { dt { (name) } dd { code { (value) } } }
                } }
            }
        }
    }
}
