//! Results as one HTML file that needs nothing else.

use super::tables::{figures, methods, words};
use super::{Results, Row};

const STYLE: &str = "
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 76rem; padding: 0 1rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .7rem; text-align: right; border-bottom: 1px solid color-mix(in srgb, currentColor 20%, transparent); }
th:first-child, td:first-child { text-align: left; }
td.best { font-weight: 700; }
small { opacity: .7; }
figure { margin: 1rem 0; background: #fff; border-radius: .3rem; }
figure svg { width: 100%; height: auto; }
@media print { body { margin: 0; max-width: none; } }
";

/// The report of a benchmark.
///
/// * `label` — said at the top, such as date and commit.
/// * `figures` — title and SVG of pictures, such as convergence curves.
#[must_use]
pub fn html(results: &Results, label: &str, pictures: &[(String, String)]) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Open-Structure benchmark</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>Open-Structure benchmark</h1>\n"
    );
    if !label.is_empty() {
        page += &format!("<p>{}</p>\n", escaped(label));
    }
    page += "<h2>Absolute error of translation</h2>\n<p>RMSE after SE(3) alignment, cm: median over seeds (quartiles). Below it the ratio to the bound, which is the error that what the method reads allows (of methods without depth both after an alignment that scales), and what the paper prints for its own method of that kind. Bold: the least of a sequence.</p>\n";
    page += &table(results);
    page += "<h2>Rotation and time</h2>\n<p>Relative error of rotation, delta 1 frame, RMSE in degrees, and wall time in seconds; medians over seeds.</p>\n";
    page += &rotations(results);
    let failed: Vec<&Row> = results.rows.iter().filter(|row| row.failed.is_some()).collect();
    if !failed.is_empty() {
        page += "<h2>Failed</h2>\n<ul>\n";
        for row in failed {
            let (count, reason) = row.failed.clone().unwrap_or_default();
            let (sequence, method) = (escaped(&row.sequence), escaped(&row.method));
            page += &format!("<li>{sequence}, {method}: {count} times: {}</li>\n", escaped(&reason));
        }
        page += "</ul>\n";
    }
    for (title, svg) in pictures {
        page += &format!(
            "<h2>{}</h2>\n<figure role=\"img\" aria-label=\"{}\">{svg}</figure>\n",
            escaped(title),
            escaped(title)
        );
    }
    page + "</main>\n</body>\n</html>\n"
}

fn table(results: &Results) -> String {
    let methods = methods(results);
    let mut text = head(&methods);
    for sequence in results.sequences() {
        let median = |method: &str| Some(results.row(sequence, method)?.ape_rmse_cm?.median);
        let best = methods.iter().filter_map(|method| median(method)).fold(f64::INFINITY, f64::min);
        text += &format!("<tr><td>{}</td>", escaped(sequence));
        for method in &methods {
            let Some(row) = results.row(sequence, method) else {
                text += "<td>–</td>";
                continue;
            };
            let class = if median(method) == Some(best) { " class=\"best\"" } else { "" };
            let mut notes = Vec::new();
            if let Some(over) = row.over_bound() {
                notes.push(format!("{over:.2} × bound"));
            }
            if let Some(paper) = &row.paper {
                let note = paper.note.as_ref().map(|note| format!(" ({note})")).unwrap_or_default();
                notes.push(format!("paper {}{note}", paper.ape_cm[0]));
            }
            text += &format!(
                "<td{class}>{}<br><small>{}</small></td>",
                escaped(&words(row)),
                escaped(&notes.join(", "))
            );
        }
        text += "</tr>\n";
    }
    text + "</tbody>\n</table>\n</div>\n"
}

fn rotations(results: &Results) -> String {
    let methods = methods(results);
    let mut text = head(&methods);
    for sequence in results.sequences() {
        text += &format!("<tr><td>{}</td>", escaped(sequence));
        for method in &methods {
            let row = results.row(sequence, method);
            let rotation = row.and_then(|row| row.rpe_rotation_rmse_deg);
            let seconds = row.and_then(|row| row.seconds);
            let rotation = rotation.map_or_else(|| "–".to_owned(), |spread| format!("{:.3}", spread.median));
            let seconds = seconds.map_or_else(String::new, |spread| format!("{} s", figures(spread.median)));
            text += &format!("<td>{rotation}<br><small>{seconds}</small></td>");
        }
        text += "</tr>\n";
    }
    text + "</tbody>\n</table>\n</div>\n"
}

fn head(methods: &[&str]) -> String {
    let columns = methods
        .iter()
        .fold(String::new(), |columns, method| columns + "<th scope=\"col\">" + &escaped(method) + "</th>");
    format!(
        "<div class=\"wide\">\n<table>\n<thead><tr><th scope=\"col\">sequence</th>{columns}</tr></thead>\n<tbody>\n"
    )
}

/// Text as HTML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
