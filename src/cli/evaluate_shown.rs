//! What `os evaluate` shows to people: a line for each estimate, or all statistics of some relations.

use std::io::Write;

use super::text;
use crate::evaluate::{EvaluateOptions, Evaluated, PointErrors, Relation, Statistics};

/// A line for each estimate.
pub(super) fn overview(
    rows: &[Evaluated],
    options: &EvaluateOptions,
    markdown: bool,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    let several = rows.iter().any(|row| row.sequence != rows[0].sequence);
    let points = rows.iter().any(|row| row.evaluation.points.is_some());
    let lines = rows.iter().any(|row| row.evaluation.lines.is_some());
    let mut header = vec!["ESTIMATE", "FRAMES", "MISSING", "APE cm", "RPE °"];
    if several {
        header.insert(0, "SEQUENCE");
    }
    if points {
        header.extend(["POINTS", "MISSING", "OFF cm"]);
    }
    if lines {
        header.extend(["LINES", "MISSING", "ANGLE °", "OFF cm", "COVERED %"]);
    }
    let absent = || "-".to_owned();
    let cells = |row: &Evaluated| {
        let found = &row.evaluation;
        // A map without a path misses no pose.
        let path = found.matched + found.extra > 0 || found.points.is_none() && found.lines.is_none();
        let counts = [found.matched, found.missing];
        let mut cells = vec![found.name.clone()];
        cells.extend(counts.map(|count| if path { count.to_string() } else { absent() }));
        if several {
            cells.insert(0, row.sequence.clone());
        }
        let absolute = found.absolute.as_ref().ok().map(|errors| errors.translation.statistics());
        let relative = found.relative.as_ref().ok().map(|errors| errors.rotation.statistics());
        cells.push(pair(absolute, 100.0));
        cells.push(pair(relative, 1.0_f64.to_degrees()));
        if points {
            let found = found.points.as_ref();
            cells.push(found.map_or_else(absent, |found| found.ids.len().to_string()));
            cells.push(found.map_or_else(absent, |found| found.missing.to_string()));
            cells.push(pair(found.and_then(PointErrors::statistics), 100.0));
        }
        if lines {
            let found = found.lines.as_ref();
            let of = |values: Option<&Vec<f64>>| values.and_then(|values| Statistics::of(values));
            cells.push(found.map_or_else(absent, |found| found.ids.len().to_string()));
            cells.push(found.map_or_else(absent, |found| found.missing.to_string()));
            cells.push(pair(of(found.map(|found| &found.angle_rad)), 1.0_f64.to_degrees()));
            cells.push(pair(of(found.map(|found| &found.distance_m)), 100.0));
            let covered = of(found.map(|found| &found.coverage));
            cells.push(covered.map_or_else(absent, |covered| format!("{:.0}", 100.0 * covered.mean)));
        }
        cells
    };
    let words = usize::from(several);
    table(&header, words, rows.iter().map(cells), markdown, out)?;
    let reference = rows.first().map_or("", |row| row.reference.as_str());
    let step = rows.first().map_or("", |row| row.step.as_str());
    writeln!(
        out,
        "\nrmse/median. APE: translation, {} alignment with {reference}. RPE: rotation, over {step}.",
        options.alignment
    )?;
    Ok(())
}

/// All statistics of some relations, a line for each estimate, metric and relation.
pub(super) fn statistics(
    rows: &[Evaluated],
    relations: &[Relation],
    markdown: bool,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    let several = rows.iter().any(|row| row.sequence != rows[0].sequence);
    let mut header = vec!["ESTIMATE", "ERROR", "COUNT", "max", "mean", "median", "min", "rmse", "sse", "std"];
    if several {
        header.insert(0, "SEQUENCE");
    }
    let mut lines = Vec::new();
    for row in rows {
        for relation in relations {
            let absolute = row.evaluation.absolute.as_ref().ok().map(|found| found.errors(*relation).ok());
            let relative = row.evaluation.relative.as_ref().ok().map(|found| found.errors(*relation).ok());
            for (metric, errors) in [("APE", absolute.flatten()), ("RPE", relative.flatten())] {
                let Some(errors) = errors else { continue };
                let found = errors.statistics();
                let unit = match relation.unit() {
                    "1" => String::new(),
                    unit => format!(", {unit}"),
                };
                let mut cells = vec![
                    row.evaluation.name.clone(),
                    format!("{metric} {}{unit}", name(*relation)),
                    found.count.to_string(),
                ];
                if several {
                    cells.insert(0, row.sequence.clone());
                }
                cells.extend(found.named().map(|(_, value)| six(value)));
                lines.push(cells);
            }
        }
    }
    table(&header, 1 + usize::from(several), lines.into_iter(), markdown, out)?;
    if let Some(row) = rows.first() {
        writeln!(out, "\nAlignment {} with {}. RPE over {}.", row.alignment, row.reference, row.step)?;
    }
    Ok(())
}

/// The name of a relation where its unit stands beside it.
fn name(relation: Relation) -> &'static str {
    match relation {
        Relation::AngleRad | Relation::AngleDeg => "rotation angle",
        relation => relation.name(),
    }
}

/// A table of columns of which those after the `words`-th are numbers.
fn table(
    header: &[&str],
    words: usize,
    rows: impl Iterator<Item = Vec<String>>,
    markdown: bool,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    if markdown {
        let escaped = |cell: &String| cell.replace('\\', "\\\\").replace('|', "\\|");
        let rule = (0..header.len()).map(|place| if place <= words { "---" } else { "--:" });
        writeln!(out, "| {} |\n|{}|", header.join(" | "), rule.collect::<Vec<_>>().join("|"))?;
        for row in rows {
            writeln!(out, "| {} |", row.iter().map(escaped).collect::<Vec<_>>().join(" | "))?;
        }
        return Ok(());
    }
    let numbers: Vec<usize> = (words + 1..header.len()).collect();
    let mut table = text::table(header.iter().copied(), &numbers);
    for row in rows {
        table.add_row(row);
    }
    writeln!(out, "{}", text::lines(&table))?;
    Ok(())
}

/// `rmse/median` in another unit.
fn pair(found: Option<Statistics>, scale: f64) -> String {
    found.map_or_else(
        || "-".to_owned(),
        |found| format!("{}/{}", hundredths(found.rmse * scale), hundredths(found.median * scale)),
    )
}

/// Two decimals, or two digits of what is smaller than that.
fn hundredths(number: f64) -> String {
    if number == 0.0 || number.abs() >= 0.005 { format!("{number:.2}") } else { format!("{number:.0e}") }
}

/// Six decimals as evo prints, or as many digits of what is smaller.
fn six(number: f64) -> String {
    if number == 0.0 || number.abs() >= 1e-4 { format!("{number:.6}") } else { format!("{number:.3e}") }
}
