//! The part of the page that moves: the scene, one frame's measurements, the frames that share landmarks with it.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};

use super::SequenceReport;
use super::charts::named;
use super::error::Error;
use super::numbers::count;

pub(super) fn section(report: &SequenceReport, place: usize) -> Result<Markup, Error> {
    let view = &report.view;
    let last = report.frames.len().saturating_sub(1);
    let kinds = [report.analysed.sequence.points.table, report.analysed.sequence.lines.table]
        .map(|table| if table.ends_with("observations") { "observed without noise" } else { "measured" });
    Ok(html! {
        div.explorer data-explorer=(place) {
            div.panes {
                figure.pane {
                    figcaption {
                        h4 { "Scene" }
                        p.note {
                            "Points, lines by structural group, paths, and the camera at the frame that is chosen. Points that it shows are green, lines thick; paths of estimates differ in colour and dashes."
                            @if let Some(instead) = report.landmarks.instead() { " Landmarks are " (instead) "." }
                        }
                    }
                    div.stage {
                        @if let Some(still) = &report.still {
                            img.still src=(format!("data:image/svg+xml;base64,{}", STANDARD.encode(still)))
                                alt="The scene from above at an angle: points, lines by group, the path of the camera";
                        } @else { p.nothing.still { "Nothing in the sequence has a place in the world." } }
                        canvas.scene tabindex="0" role="application" aria-roledescription="3-D scene" hidden
                            aria-label="Scene. Arrow keys turn it, plus and minus zoom, 0 shows all of it." {}
                        div.stage-buttons hidden {
                            button type="button" data-do="closer" aria-label="Closer" { "+" }
                            button type="button" data-do="farther" aria-label="Farther" { "−" }
                            button type="button" data-do="top" { "Top" }
                            button type="button" data-do="all" { "All" }
                            button type="button" data-do="camera" aria-pressed="false" { "Camera" }
                        }
                    }
                    p.note.hint.needs-script hidden { "Drag turns, Shift and drag moves, Ctrl and wheel or two fingers zoom; with keys: arrows, +, −, 0." }
                    (toggles(report))
                }
                figure.pane {
                    figcaption {
                        h4 { "Measurements of the frame" }
                        p.note {
                            "What the camera shows at that frame, within the borders of its image: points (" (kinds[0]) ") in green, segments ("
                            (kinds[1]) ") in the colour of their group."
                        }
                    }
                    div.stage.image-stage {
                        canvas.frame tabindex="0" role="application" aria-roledescription="image" hidden
                            aria-label="Measurements of the frame. Arrow keys go from one to the next." {}
                    }
                    p.pointed.needs-script aria-live="polite" hidden { "Point at a measurement to read its id." }
                    details.data.needs-script hidden { summary { "Measurements as a table" } div.frame-table tabindex="0" role="group" aria-label="Measurements of the frame" {} }
                }
            }
            div.transport.needs-script hidden {
                button type="button" data-do="before" aria-label="Frame before" { "◀" }
                button.play type="button" data-do="play" aria-label="Play" aria-pressed="false" { "▶ Play" }
                button type="button" data-do="after" aria-label="Frame after" { "▶" }
                label {
                    span { "Frame" }
                    input.slider type="range" min="0" max=(last) value="0" step="1";
                }
                output.where {}
            }
            div.covisible.needs-script hidden {
                h4 { "Covisible frames" }
                p.note { "Landmarks that every frame shares with the one above; a touch goes there." }
                canvas.strip aria-hidden="true" {}
                ol.sharing {}
            }
            script type="application/json" data-description=(place) { (PreEscaped(view.description()?)) }
            script type="application/octet-stream" data-block=(place) { (view.block()) }
        }
    })
}

/// What of the scene is shown, with its colours.
fn toggles(report: &SequenceReport) -> Markup {
    let view = &report.view;
    let edges = report.view.has_edges();
    html! {
        fieldset.toggles.needs-script hidden {
            legend.sr { "Shown in the scene" }
            @if report.landmarks.has_points() { (toggle("points", "swatch dot quiet", html! { "points" })) }
            @for (place, group) in view.groups().iter().enumerate() {
                (toggle(&format!("group-{place}"), &format!("swatch group-{}", group.colour), html! {
                    (named(&group.name)) ": " (count(group.lines as u64))
                }))
            }
            @if report.has_ungrouped {
                (toggle("ungrouped", "swatch quiet", html! { "lines in no group" }))
            }
            @for (place, path) in view.paths().iter().enumerate() {
                (toggle(&format!("path-{place}"), &format!("swatch {}", path.class), named(&path.name)))
            }
            @if report.landmarks.has_points() { (toggle("rays", "swatch points", html! { "rays" })) }
            @if edges { (toggle("edges", "swatch faint", html! { "edges of objects" })) }
        }
    }
}

fn toggle(name: &str, swatch: &str, words: Markup) -> Markup {
    html! {
        label {
            input type="checkbox" data-show=(name) checked[name != "rays"];
            span class=(swatch) {}
            span { (words) }
        }
    }
}
