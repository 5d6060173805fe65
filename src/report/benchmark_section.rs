//! Tables of a benchmark: sequences down, methods across.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::comparison_section::convergence;
use super::convergence::Run;
use super::json_results::BenchmarkRow;
use super::numbers::{NONE, count, maybe, short};

pub(super) fn section(rows: &[BenchmarkRow], runs: &BTreeMap<String, Vec<Run>>) -> Markup {
    html! {
        section.card aria-labelledby="benchmark" {
            h2 id="benchmark" { "Benchmark" }
            h3 { "Absolute error of translation" }
            p.note {
                "RMSE after SE(3) alignment, cm: median over seeds, and quartiles. Below it how many times the bound, which is the error that "
                "what the method reads allows; of methods without depth both are taken after an alignment that scales, for nothing tells them "
                "the scale. Below 1 a method uses more than measurements, such as how a camera moves. Last, what the paper prints for its own "
                "method of that kind. Bold: the least of a sequence."
            }
            (pivot(rows, "Absolute error of translation", |row, best| html! {
                @match row.ape_rmse_cm {
                    Some(median) => {
                        @if best { b { (short(median)) } } @else { (short(median)) }
                        @if let (Some(lower), Some(upper)) = (row.ape_rmse_cm_lower, row.ape_rmse_cm_upper) {
                            @if lower != upper { " (" (short(lower)) "–" (short(upper)) ")" }
                        }
                    }
                    None => { @if row.failed.unwrap_or(0) > 0 { "failed" } @else { (NONE) } }
                }
                @if let Some(over) = row.over_bound { small { (short(over)) " × bound" } }
                @if let Some(paper) = row.paper_ape_rmse_cm { small { "paper " (short(paper)) } }
                @if let Some(failed) = row.failed.filter(|failed| *failed > 0) { small { (count(failed)) " seeds failed" } }
            }))
            h3 { "Relative error of rotation, and time" }
            p.note { "RMSE from frame to frame in degrees, and wall time of the method; medians over seeds." }
            (pivot(rows, "Relative error of rotation, and time", |row, _| html! {
                (maybe(row.rpe_rotation_rmse_deg))
                @if let Some(seconds) = row.seconds { small { (short(seconds)) " s" } }
            }))
            @for (sequence, runs) in runs { (convergence(runs, &format!("Convergence on {sequence}"))) }
        }
    }
}

/// A table of one cell for each sequence and method; a cell is told whether its error is the least of its sequence.
fn pivot(rows: &[BenchmarkRow], label: &str, cell: impl Fn(&BenchmarkRow, bool) -> Markup) -> Markup {
    let (mut sequences, mut methods): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for row in rows {
        for (names, name) in [(&mut sequences, &row.sequence), (&mut methods, &row.method)] {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    let of = |sequence: &str, method: &str| {
        rows.iter().find(|row| row.sequence == sequence && row.method == method)
    };
    let least = |sequence: &str| {
        let errors = rows.iter().filter(|row| row.sequence == sequence).filter_map(|row| row.ape_rmse_cm);
        errors.fold(f64::INFINITY, f64::min)
    };
    html! {
        div.wide tabindex="0" role="group" aria-label=(label) {
            table.pivot {
                thead { tr { th scope="col" { "sequence" } @for method in &methods { th scope="col" { (method) } } } }
                tbody {
                    @for sequence in &sequences {
                        tr {
                            th scope="row" { (sequence) }
                            @for method in &methods {
                                td {
                                    @match of(sequence, method) {
                                        Some(row) => (cell(row, row.ape_rmse_cm == Some(least(sequence)))),
                                        None => (NONE),
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
