//! What `os evaluate` and `os adjust` printed.

use maud::{Markup, html};

use super::charts::Table;
use super::json_results::{AdjustmentRow, EvaluationRow};
use super::numbers::{NONE, count, maybe};

pub(super) fn evaluations(rows: &[EvaluationRow]) -> Markup {
    let scaled = |number: Option<f64>, scale: f64| maybe(number.map(|number| number * scale));
    let degrees = 1.0_f64.to_degrees();
    let whole = |number: Option<u64>| number.map_or_else(|| NONE.to_owned(), count);
    let row = |row: &EvaluationRow| {
        vec![
            row.sequence.clone(),
            row.estimate.clone(),
            whole(row.poses_matched),
            whole(row.poses_missing),
            scaled(row.ape_translation_rmse_m, 100.0),
            scaled(row.ape_translation_median_m, 100.0),
            scaled(row.rpe_rotation_rmse_rad, degrees),
            scaled(row.rpe_rotation_median_rad, degrees),
            scaled(row.point_distance_rmse_m, 100.0),
            scaled(row.line_distance_rmse_m, 100.0),
            format!("{} with {}, over {}", row.alignment, row.reference, row.rpe_delta),
        ]
    };
    let header = [
        "sequence",
        "estimate",
        "frames",
        "missing",
        "APE rmse, cm",
        "APE median, cm",
        "RPE rmse, °",
        "RPE median, °",
        "points rmse, cm",
        "lines rmse, cm",
        "alignment, step",
    ];
    let table = Table {
        header: header.map(str::to_owned).to_vec(),
        rows: rows.iter().map(row).collect(),
        note: None,
    };
    let problems = || rows.iter().filter_map(|row| Some((row, row.why_not.as_ref()?)));
    html! {
        section.card aria-labelledby="evaluations" {
            h2 id="evaluations" { "Evaluations" }
            p.note { "As os evaluate printed them: APE of translation, RPE of rotation." }
            (table.markup())
            @if problems().next().is_some() {
                ul.problems { @for (row, why) in problems() { li { b { (row.sequence) ", " (row.estimate) } ": " (why) } } }
            }
        }
    }
}

pub(super) fn adjustments(rows: &[AdjustmentRow]) -> Markup {
    let cost = |cost: Option<f64>| cost.map_or_else(|| NONE.to_owned(), |cost| format!("{cost:.4e}"));
    let row = |row: &AdjustmentRow| {
        vec![
            row.estimate.clone(),
            row.graph.clone(),
            row.ending.clone(),
            count(row.iterations),
            cost(row.initial_cost),
            cost(row.final_cost),
            maybe(row.residual_rms_sigma),
            count(row.residuals),
            count(row.unknowns),
        ]
    };
    let header = [
        "estimate",
        "graph",
        "ending",
        "steps",
        "cost before",
        "cost after",
        "rms of residuals, σ",
        "residuals",
        "unknowns",
    ];
    let table = Table {
        header: header.map(str::to_owned).to_vec(),
        rows: rows.iter().map(row).collect(),
        note: None,
    };
    html! {
        section.card aria-labelledby="adjustments" {
            h2 id="adjustments" { "Adjustments" }
            p.note { "As os adjust printed them; its steps stand with the sequence that it wrote." }
            (table.markup())
        }
    }
}
