//! Results as tables: Parquet for programs, Markdown for people.

use super::{Method, Outcome, Results, Row, Spread};
use crate::structure::ResultTable;

/// Every cell as a row.
#[must_use]
pub fn cells_table(results: &Results) -> ResultTable {
    let cells = &results.cells;
    let estimated = |number: &dyn Fn(&Outcome) -> Option<f64>| -> Vec<Option<f64>> {
        cells.iter().map(|cell| number(&cell.outcome)).collect()
    };
    macro_rules! numbers {
        ($field:ident) => {
            estimated(&|outcome| match outcome {
                Outcome::Estimated { $field, .. } => Some(*$field),
                Outcome::Failed { .. } => None,
            })
        };
    }
    macro_rules! counts {
        ($found:pat => $count:expr) => {
            cells.iter().map(|cell| match &cell.outcome {
                $found => $count,
                _ => None,
            })
        };
    }
    let sequence = cells.iter().map(|cell| Some(cell.key.sequence.as_str()));
    let method = cells.iter().map(|cell| Some(cell.key.method.as_str()));
    let seed = cells.iter().map(|cell| i64::try_from(cell.key.seed).ok());
    let reason = cells.iter().map(|cell| match &cell.outcome {
        Outcome::Failed { reason } => Some(reason.as_str()),
        Outcome::Estimated { .. } => None,
    });
    ResultTable::new("cells")
        .text("sequence", "name of the sequence", sequence)
        .text("method", "method, or estimate of the sequence", method)
        .integer("seed", "1", "seed of noise and samples", seed)
        .number(
            "ape_rmse_m",
            "m",
            "absolute error of translation after SE(3) alignment, RMSE",
            numbers!(ape_rmse_m),
        )
        .number("ape_median_m", "m", "the same, median over frames", numbers!(ape_median_m))
        .number(
            "ape_sim3_rmse_m",
            "m",
            "absolute error of translation after Sim(3) alignment, RMSE",
            numbers!(ape_sim3_rmse_m),
        )
        .number(
            "rpe_rotation_rmse_deg",
            "deg",
            "relative error of rotation, delta 1 frame, RMSE",
            numbers!(rpe_rotation_rmse_deg),
        )
        .number(
            "rpe_rotation_median_deg",
            "deg",
            "the same, median over frames",
            numbers!(rpe_rotation_median_deg),
        )
        .integer(
            "frames",
            "1",
            "frames with a pose",
            counts!(Outcome::Estimated { frames, .. } => i64::try_from(*frames).ok()),
        )
        .integer(
            "predicted",
            "1",
            "frames whose pose no measurement supports",
            counts!(Outcome::Estimated { predicted, .. } => i64::try_from(*predicted).ok()),
        )
        .integer(
            "iterations",
            "1",
            "iterations of an optimiser",
            counts!(Outcome::Estimated { iterations: Some(count), .. } => i64::try_from(*count).ok()),
        )
        .number(
            "cost",
            "1",
            "last cost of an optimiser",
            estimated(&|outcome| match outcome {
                Outcome::Estimated { cost, .. } => *cost,
                Outcome::Failed { .. } => None,
            }),
        )
        .number(
            "seconds",
            "s",
            "wall time of the method alone",
            cells.iter().map(|cell| Method::of_name(&cell.key.method).map(|_| cell.seconds)),
        )
        .text("failed", "why there is no estimate", reason)
}

/// The cost over the iterations of every cell that has one.
#[must_use]
pub fn curves_table(results: &Results) -> ResultTable {
    let points: Vec<_> = results
        .cells
        .iter()
        .flat_map(|cell| cell.curve.iter().map(move |point| (&cell.key, point)))
        .collect();
    ResultTable::new("curves")
        .text("sequence", "name of the sequence", points.iter().map(|(key, _)| Some(key.sequence.as_str())))
        .text("method", "method", points.iter().map(|(key, _)| Some(key.method.as_str())))
        .integer("seed", "1", "seed", points.iter().map(|(key, _)| i64::try_from(key.seed).ok()))
        .integer("iteration", "1", "iteration, from 0", points.iter().map(|(_, point)| Some(point.iteration)))
        .number(
            "cost",
            "1",
            "half the sum of robust squared whitened residuals",
            points.iter().map(|(_, point)| Some(point.cost)),
        )
        .integer(
            "accepted",
            "1",
            "1 where the step was taken",
            points.iter().map(|(_, point)| Some(i64::from(point.accepted))),
        )
}

/// One row for each sequence and method: medians over seeds, their spread, the bound, and the paper's figures.
#[must_use]
pub fn summary_table(results: &Results) -> ResultTable {
    let rows = &results.rows;
    let median = |spread: &dyn Fn(&Row) -> Option<Spread>| -> Vec<Option<f64>> {
        rows.iter().map(|row| spread(row).map(|spread| spread.median)).collect()
    };
    let ape = |part: &dyn Fn(Spread) -> f64| -> Vec<Option<f64>> {
        rows.iter().map(|row| row.ape_rmse_cm.map(part)).collect()
    };
    ResultTable::new("summary")
        .text("sequence", "name of the sequence", rows.iter().map(|row| Some(row.sequence.as_str())))
        .text(
            "method",
            "method, or estimate of the sequence",
            rows.iter().map(|row| Some(row.method.as_str())),
        )
        .integer(
            "seeds",
            "1",
            "cells with an estimate",
            rows.iter().map(|row| row.ape_rmse_cm.map(|spread| whole(spread.count))),
        )
        .integer(
            "failed",
            "1",
            "cells without one",
            rows.iter().map(|row| Some(row.failed.as_ref().map_or(0, |(count, _)| whole(*count)))),
        )
        .number(
            "ape_rmse_cm",
            "cm",
            "absolute error of translation after SE(3) alignment, RMSE; median over seeds",
            ape(&|spread| spread.median),
        )
        .number("ape_rmse_cm_min", "cm", "the same, least over seeds", ape(&|spread| spread.min))
        .number("ape_rmse_cm_lower", "cm", "the same, lower quartile over seeds", ape(&|spread| spread.lower))
        .number("ape_rmse_cm_upper", "cm", "the same, upper quartile over seeds", ape(&|spread| spread.upper))
        .number("ape_rmse_cm_max", "cm", "the same, largest over seeds", ape(&|spread| spread.max))
        .number(
            "ape_median_cm",
            "cm",
            "the same, median over frames; median over seeds",
            median(&|row| row.ape_median_cm),
        )
        .number(
            "ape_sim3_rmse_cm",
            "cm",
            "after Sim(3) alignment, RMSE; median over seeds",
            median(&|row| row.ape_sim3_rmse_cm),
        )
        .number(
            "rpe_rotation_rmse_deg",
            "deg",
            "relative error of rotation, delta 1 frame, RMSE; median over seeds",
            median(&|row| row.rpe_rotation_rmse_deg),
        )
        .number(
            "rpe_rotation_median_deg",
            "deg",
            "the same, median over frames; median over seeds",
            median(&|row| row.rpe_rotation_median_deg),
        )
        .integer(
            "predicted",
            "1",
            "most frames of a cell whose pose no measurement supports",
            rows.iter().map(|row| Some(whole(row.predicted))),
        )
        .number("seconds", "s", "wall time of the method; median over seeds", median(&|row| row.seconds))
        .number(
            "bound_cm",
            "cm",
            "RMS of the absolute error of translation that the method's measurements allow; after Sim(3) alignment for monocular methods",
            rows.iter().map(|row| row.bound_cm),
        )
        .number("over_bound", "1", "median error over the bound, both with the bound's alignment", rows.iter().map(Row::over_bound))
        .number(
            "paper_ape_rmse_cm",
            "cm",
            "what the paper prints",
            rows.iter().map(|row| row.paper.as_ref().map(|paper| paper.ape_cm[0])),
        )
        .number(
            "paper_ape_median_cm",
            "cm",
            "what the paper prints",
            rows.iter().map(|row| row.paper.as_ref().map(|paper| paper.ape_cm[1])),
        )
        .number("over_paper", "1", "median error over the paper's", rows.iter().map(Row::over_paper))
}

/// A count as a whole number of a table.
fn whole(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// Digits that three figures need.
pub(super) fn figures(number: f64) -> String {
    let size = number.abs();
    let decimals = if size >= 99.95 {
        0
    } else if size >= 9.995 {
        1
    } else {
        2
    };
    format!("{number:.decimals$}")
}

/// One cell of the table for people: median, spread over seeds, median over frames.
pub(super) fn words(row: &Row) -> String {
    let Some(ape) = row.ape_rmse_cm else {
        return if row.failed.is_some() { "failed".to_owned() } else { "–".to_owned() };
    };
    let mut words = figures(ape.median);
    if ape.count > 1 {
        words += &format!(" ({}–{})", figures(ape.lower), figures(ape.upper));
    }
    if let Some((count, _)) = &row.failed {
        words += &format!(", {count} failed");
    }
    words
}

/// The methods and estimates of the results, in their order.
pub(super) fn methods(results: &Results) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for row in &results.rows {
        if !names.contains(&row.method.as_str()) {
            names.push(&row.method);
        }
    }
    names
}

/// The table for people: a line for each sequence, a column for each method, and below it how it compares.
///
/// * `label` — said above the table, such as date and commit.
#[must_use]
pub fn markdown(results: &Results, label: &str) -> String {
    let methods = methods(results);
    let mut text = String::new();
    if !label.is_empty() {
        text += &format!("{label}\n\n");
    }
    text += "Absolute error of translation after SE(3) alignment, RMSE in cm: median over seeds (quartiles); behind it what the paper prints.\n\n";
    text += &format!("| sequence | {} | bound |\n", methods.join(" | "));
    text += &format!("|---|{}--:|\n", "--:|".repeat(methods.len()));
    for sequence in results.sequences() {
        let cells = methods.iter().map(|method| {
            let Some(row) = results.row(sequence, method) else { return "–".to_owned() };
            let paper = row.paper.as_ref().filter(|_| is_the_papers(method));
            let paper = paper.map(|paper| format!(" / {}", paper.ape_cm[0]));
            format!("{}{}", words(row), paper.unwrap_or_default())
        });
        let cells: Vec<String> = cells.collect();
        let bounds = results.bounds.get(sequence);
        let bound = bounds.and_then(|bounds| bounds.get(Method::StructuralBa.name()));
        let bound = bound.map(|bound| bound.translation_rms_m * 100.0);
        let bound = bound.map_or_else(|| "–".to_owned(), figures);
        text += &format!("| {sequence} | {} | {bound} |\n", cells.join(" | "));
    }
    text += "\n| over all sequences | ";
    text += &methods.join(" | ");
    text += &format!(" |\n|---|{}\n", "--:|".repeat(methods.len()));
    let line = |name: &str, number: &dyn Fn(&str) -> Option<String>| {
        let cells: Vec<String> =
            methods.iter().map(|method| number(method).unwrap_or_else(|| "–".to_owned())).collect();
        format!("| {name} | {} |\n", cells.join(" | "))
    };
    text += &line("geometric mean, cm", &|method| {
        let (mean, _) = results.geometric_mean(method, |row| Some(row.ape_rmse_cm?.median))?;
        Some(figures(mean))
    });
    text += &line("over the paper's, geometric mean", &|method| {
        let (mean, count) = results.geometric_mean(method, Row::over_paper)?;
        Some(format!("{mean:.2} of {count}"))
    });
    text += &line("over its bound, median", &|method| {
        let ratios = results.rows.iter().filter(|row| row.method == method).filter_map(Row::over_bound);
        Spread::of(ratios).map(|spread| format!("{:.2}", spread.median))
    });
    text += "\nThe bound shown is that of all measurements. Methods without depth have a bound of their own, and what they are over it is taken after an alignment that scales: `bound_cm` and `ape_sim3_rmse_cm` of `summary.parquet`. Over the paper's: over what it prints for its own method of that kind.\n";
    text
}

/// Whether a column stands for one of the paper's own methods.
fn is_the_papers(method: &str) -> bool {
    Method::of_name(method).is_some_and(|method| {
        matches!(
            method,
            Method::FrameToFrameClassic | Method::MapToFrameClassic | Method::PointBa | Method::PointLineBa
        )
    })
}
