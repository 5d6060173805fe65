//! A chart of blocks, for a terminal or a pipe.

use comfy_table::Table;

/// Height of a chart, lines.
const HEIGHT: usize = 6;
/// Width of a chart with its axis where nobody says how wide, columns.
const WIDTH_IN_A_PIPE: u16 = 80;
/// Charts of a few hundred frames say nothing more when they are wider.
const WIDEST: usize = 160;
/// Room for the numbers at the left, columns.
const AXIS: usize = 9;

/// Width of the terminal, or 80 columns in a pipe.
fn width() -> usize {
    let wide = usize::from(Table::new().width().unwrap_or(WIDTH_IN_A_PIPE));
    wide.clamp(AXIS + 10, WIDEST)
}

/// A chart of numbers over frames: a column for each frame, or for the mean of some neighbours; a number that is not there leaves a gap.
///
/// * `title` — with the unit, above the chart.
/// * `ids` — of the first and the last frame.
pub(super) fn chart(title: &str, numbers: &[Option<f64>], ids: [i64; 2]) -> String {
    chart_of_width(title, numbers, ids, width())
}

fn chart_of_width(title: &str, numbers: &[Option<f64>], [first, last]: [i64; 2], width: usize) -> String {
    let columns = columns(numbers, width.saturating_sub(AXIS).max(1));
    let most = columns.iter().flatten().copied().fold(0.0, f64::max);
    let mut text = format!("{title}\n");
    for line in (0..HEIGHT).rev() {
        let label = match line {
            0 => "0".to_owned(),
            line if line + 1 == HEIGHT => number(most),
            _ => String::new(),
        };
        let bar: String = columns.iter().map(|column| block(*column, most, line)).collect();
        text.push_str(format!("{label:>7} ┤{bar}").trim_end());
        text.push('\n');
    }
    text.push_str(&format!("{:>7} └{}\n", "", "─".repeat(columns.len())));
    let (first, last) = (first.to_string(), format!("frame {last}"));
    if numbers.len() > 1 && columns.len() > first.len() + last.len() {
        let room = columns.len() - first.len();
        text.push_str(&format!("{:>8} {first}{last:>room$}\n", ""));
    }
    text
}

/// The part of a column that is in one line of the chart.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=8 before")]
fn block(column: Option<f64>, most: f64, line: usize) -> char {
    const BLOCKS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let Some(column) = column else { return ' ' };
    if most <= 0.0 {
        return if line == 0 { '▁' } else { ' ' };
    }
    let eighths = column / most * (8 * HEIGHT) as f64 - (8 * line) as f64;
    // What is not zero is seen.
    let least = if line == 0 && column > 0.0 { 1.0 } else { 0.0 };
    BLOCKS[eighths.round().clamp(least, 8.0) as usize]
}

/// Means over runs of neighbours, at most `width` of them.
fn columns(numbers: &[Option<f64>], width: usize) -> Vec<Option<f64>> {
    let count = numbers.len().min(width);
    (0..count)
        .map(|column| {
            let run = &numbers[column * numbers.len() / count..(column + 1) * numbers.len() / count];
            let there = run.iter().flatten().filter(|number| number.is_finite());
            let (sum, count) = there.fold((0.0, 0_u32), |(sum, count), number| (sum + number, count + 1));
            (count > 0).then(|| sum / f64::from(count))
        })
        .collect()
}

/// A number in at most seven characters.
fn number(number: f64) -> String {
    match number.abs() {
        size if size >= 1e6 => format!("{number:.1e}"),
        size if size >= 100.0 || number.fract() == 0.0 => format!("{number:.0}"),
        size if size >= 10.0 => format!("{number:.1}"),
        _ => format!("{number:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_rises_from_nothing_to_the_top() {
        let numbers: Vec<Option<f64>> = (0..48).map(|number| Some(f64::from(number))).collect();
        let shown = chart_of_width("ramp", &numbers, [0, 47], AXIS + 48);
        let lines: Vec<&str> = shown.lines().collect();
        assert_eq!(lines[0], "ramp");
        assert!(lines[1].starts_with("     47 ┤") && lines[1].ends_with('█'), "{shown}");
        assert!(lines[HEIGHT].starts_with("      0 ┤ ▁"), "{shown}");
        assert!(lines.last().unwrap().ends_with("frame 47"));
    }

    #[test]
    fn no_line_is_wider_than_asked_for_and_nothing_is_shown_of_nothing() {
        for (count, width) in [(0, 80), (1, 80), (3, 80), (5000, 80), (5000, 25), (200, 160)] {
            for line in chart_of_width("t", &vec![Some(3.0); count], [-7, i64::MAX], width).lines() {
                assert!(line.chars().count() <= width, "{line}");
            }
        }
        let gaps = chart_of_width("t", &[None, Some(f64::NAN), Some(0.0)], [0, 2], 30);
        assert!(!gaps.contains('█'), "{gaps}");
    }

    #[test]
    fn columns_are_means_of_neighbours() {
        let numbers = [Some(1.0), Some(3.0), None, Some(5.0), None, None];
        assert_eq!(columns(&numbers, 3), [Some(2.0), Some(5.0), None]);
    }
}
