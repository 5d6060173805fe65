//! How an adjustment went, for people.

use super::text;
use crate::adjust::{Summary, Tally};
use crate::structure::FrameId;

/// Names listed of a kind of frame or line before the rest is only counted.
const MOST_NAMES: usize = 8;

/// Names of some frames or lines, and how many there are beyond.
fn names(ids: &[i64]) -> String {
    let shown: Vec<String> = ids.iter().take(MOST_NAMES).map(i64::to_string).collect();
    let rest = ids.len().saturating_sub(MOST_NAMES);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

pub(super) fn as_text(graph: &str, name: &str, summary: &Summary) -> String {
    let mut lines = vec![format!("{name} from graph `{graph}`")];
    lines.push(format!(
        "  cost       {:.6e} -> {:.6e}, residuals {:.3} sigma RMS",
        summary.initial_cost, summary.final_cost, summary.residual_rms
    ));
    lines.push(format!("  ending     {}, {} steps", summary.ending.words(), summary.iterations));
    lines.push(format!(
        "  problem    {} residuals, {} unknowns, {} part{}",
        text::count(summary.residuals as u64),
        text::count(summary.unknowns as u64),
        summary.components,
        if summary.components == 1 { "" } else { "s" }
    ));
    for (what, tally) in tallies(summary) {
        if tally.used > 0 || !tally.excluded.is_empty() {
            let excluded = tally.excluded.iter();
            let excluded: Vec<String> = excluded
                .map(|(reason, count)| format!("{} left out: {}", text::count(*count as u64), reason.words()))
                .collect();
            let excluded =
                if excluded.is_empty() { String::new() } else { format!("; {}", excluded.join("; ")) };
            lines.push(format!("  {what:<10} {} used{excluded}", text::count(tally.used as u64)));
        }
    }
    let ids = |frames: &[FrameId]| names(&frames.iter().map(|frame| frame.0).collect::<Vec<_>>());
    for (what, frames) in [
        ("held", &summary.held),
        ("open", &summary.weak),
        ("carried", &summary.carried),
        ("unmeasured", &summary.unconstrained),
    ] {
        if !frames.is_empty() {
            lines.push(format!("  {what:<10} {} poses: frames {}", frames.len(), ids(frames)));
        }
    }
    if summary.grouped > 0 || !summary.released.is_empty() {
        let released: Vec<i64> = summary.released.iter().map(|line| line.line_id.0).collect();
        let released = if released.is_empty() {
            String::new()
        } else {
            format!("; {} contradict theirs: lines {}", released.len(), names(&released))
        };
        lines.push(format!("  groups     {} lines share their group's direction{released}", summary.grouped));
    }
    lines.join("\n") + "\n"
}

fn tallies(summary: &Summary) -> [(&'static str, &Tally); 6] {
    [
        ("poses", &summary.poses),
        ("points", &summary.points),
        ("lines", &summary.lines),
        ("of points", &summary.point_factors),
        ("of lines", &summary.line_factors),
        ("relative", &summary.relative_factors),
    ]
}
