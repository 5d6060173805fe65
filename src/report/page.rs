//! The page as a whole: head, sections, its own code and style.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

use super::charts::named;
use super::error::Error;
use super::{
    Report, SequenceReport, benchmark_section, comparison_section, explorer_section, findings_section,
    results_section, statistics_section, summary_section,
};

/// The page's code and style, bundled of what stands beside them.
const CODE: &str = include_str!("page/dist/report.js");
const STYLE: &str = include_str!("page/dist/report.css");
/// Longest title, characters.
const LONGEST_TITLE: usize = 100;

pub(super) fn html(report: &Report) -> Result<String, Error> {
    let title = title(report);
    let sequences = report.sequences.iter().enumerate();
    let sections: Vec<Markup> =
        sequences.map(|(place, found)| sequence(found, place)).collect::<Result<_, _>>()?;
    let results = &report.results;
    let empty = report.sequences.is_empty() && *results == super::Results::default();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy());
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="referrer" content="no-referrer";
                meta name="generator" content=(concat!("os report ", env!("CARGO_PKG_VERSION")));
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                a.skip href="#content" { "To the content" }
                header.top {
                    div {
                        h1 { "Open-Structure report" }
                        p.note { (contents(report)) }
                    }
                    div.controls {
                        @if report.sequences.len() > 1 {
                            label.needs-script hidden {
                                "Sequence "
                                select #picker {
                                    @for (place, found) in report.sequences.iter().enumerate() {
                                        option value=(place) { (found.file) }
                                    }
                                }
                            }
                        }
                        button.needs-script #theme type="button" hidden { "Theme: system" }
                    }
                }
                main #content {
                    noscript { p.nothing { "Without scripts the scene is a picture, and frames cannot be looked at one by one; everything else is here." } }
                    @if empty { p.nothing { "There is nothing to report." } }
                    @for section in &sections { (section) }
                    @if !results.evaluations.is_empty() { (results_section::evaluations(&results.evaluations)) }
                    @if !results.adjustments.is_empty() { (results_section::adjustments(&results.adjustments)) }
                    @if !results.benchmarks.is_empty() || !results.runs.is_empty() {
                        (benchmark_section::section(&results.benchmarks, &results.runs))
                    }
                }
                footer { p.note { "Made by os report " (env!("CARGO_PKG_VERSION")) ". One file; nothing is fetched." } }
                script { (PreEscaped(CODE)) }
            }
        }
    };
    Ok(page.into_string())
}

/// What the page may do: run its own code and use its own style, known by their digests; show pictures that stand in it.
fn policy() -> String {
    let digest = |text: &str| STANDARD.encode(Sha256::digest(text.as_bytes()));
    format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; img-src data:; base-uri 'none'; form-action 'none'",
        digest(CODE),
        digest(STYLE)
    )
}

fn title(report: &Report) -> String {
    let names: Vec<&str> = report.sequences.iter().map(|found| found.file.as_str()).collect();
    if names.is_empty() {
        return "Open-Structure report".to_owned();
    }
    let title = format!("{} · Open-Structure report", names.join(", "));
    if title.chars().count() <= LONGEST_TITLE {
        return title;
    }
    title.chars().take(LONGEST_TITLE - 1).chain(['…']).collect()
}

fn contents(report: &Report) -> String {
    let results = &report.results;
    let counts = [
        (report.sequences.len(), "sequence", "sequences"),
        (results.evaluations.len(), "evaluation", "evaluations"),
        (results.adjustments.len(), "adjustment", "adjustments"),
        (results.benchmarks.len(), "row of a benchmark", "rows of a benchmark"),
    ];
    let there = counts.into_iter().filter(|(count, _, _)| *count > 0);
    let words: Vec<String> =
        there.map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many })).collect();
    words.join(", ")
}

fn sequence(report: &SequenceReport, place: usize) -> Result<Markup, Error> {
    let (class, words) = summary_section::verdict(report);
    let id = |part: &str| format!("sequence-{place}-{part}");
    let parts = [
        ("scene", "Scene and measurements", explorer_section::section(report, place)?),
        ("statistics", "Statistics", statistics_section::section(report)),
        ("tracks", "Tracks and covisibility", statistics_section::tracks(report)),
        ("trajectories", "Trajectories", comparison_section::section(report)),
        ("convergence", "Convergence", comparison_section::convergence(&report.runs, "Cost")),
        ("validation", "Validation", findings_section::section(report)),
    ];
    Ok(html! {
        article.sequence data-sequence=(place) aria-labelledby=(id("name")) {
            header {
                h2 id=(id("name")) {
                    (named(&report.manifest.name))
                    // Several may be made of one sequence.
                    @if report.file != report.manifest.name { " " small { (named(&report.file)) } }
                    " " span class=(format!("badge {class}")) { (words) }
                }
                @if let Some(description) = &report.manifest.description { p { (description) } }
                nav aria-label="Parts of the sequence" {
                    ul { @for (part, name, _) in &parts { li { a href=(format!("#{}", id(part))) { (name) } } } }
                }
            }
            (summary_section::section(report))
            @for (part, name, content) in &parts {
                section.card aria-labelledby=(id(part)) {
                    h3 id=(id(part)) { (name) }
                    (content)
                }
            }
        }
    })
}
