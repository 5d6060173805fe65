//! The paper's figure of a sequence: features and occupied cells of each frame.

use super::svg::Svg;
use super::{COLOURS, INK, PAPER, QUIET};
use crate::structure::FrameStatistics;

const WIDTH: f64 = 1200.0;
const HEIGHT: f64 = 420.0;
/// Most places of one curve; of more frames, neighbours are averaged.
const MOST_PLACES: usize = 1000;

/// A column of the statistics.
type Column = fn(&FrameStatistics) -> f64;

/// Two charts side by side: points and lines in each frame; cells occupied, and covered by any part of a feature.
///
/// Returns SVG text.
///
/// # Source
/// Open-Structure (Li et al. 2024), the figure of section II-B; covered cells are ours.
#[must_use]
pub fn statistics_figure(name: &str, frames: &[FrameStatistics]) -> String {
    let mut svg = Svg::new(WIDTH, HEIGHT, PAPER, &format!("Statistics of the frames of {name}"));
    svg.words([40.0, 34.0], 22.0, "start", INK, name);
    let features: [(&str, Column); 2] =
        [("points", |frame| frame.point_count as f64), ("lines", |frame| frame.line_count as f64)];
    let cells: [(&str, Column); 2] = [
        ("with a point or an end of a line", |frame| frame.occupied_cells as f64),
        ("with any part of one", |frame| frame.covered_cells.map_or(f64::NAN, |cells| cells as f64)),
    ];
    chart(&mut svg, 80.0, "features in each frame", frames, &features);
    chart(&mut svg, 680.0, "cells of 10 × 10 px in each frame", frames, &cells);
    svg.finish()
}

fn chart(svg: &mut Svg, left: f64, title: &str, frames: &[FrameStatistics], columns: &[(&str, Column); 2]) {
    const TOP: f64 = 110.0;
    const BOTTOM: f64 = 360.0;
    const LENGTH: f64 = 480.0;
    svg.words([left, 76.0], 17.0, "start", INK, title);
    let curves = columns.map(|(_, column)| averaged(frames, column));
    let most = curves.iter().flatten().copied().filter(|number| number.is_finite()).fold(1.0, f64::max);
    let (step, top) = ticks(most);
    let y = |number: f64| BOTTOM - (BOTTOM - TOP) * number / top;
    let mut tick = 0.0;
    while tick <= top + 0.5 * step {
        svg.strokes(std::iter::once(&[[left, y(tick)], [left + LENGTH, y(tick)]][..]), 1.0, QUIET, 0.35);
        svg.words([left - 8.0, y(tick) + 5.0], 14.0, "end", INK, &format!("{tick}"));
        tick += step;
    }
    let mut legend = left;
    for (((words, _), curve), colour) in columns.iter().zip(&curves).zip([COLOURS[1], COLOURS[0]]) {
        let across = LENGTH / (curve.len().max(2) - 1) as f64;
        let places: Vec<Option<[f64; 2]>> = curve
            .iter()
            .enumerate()
            .map(|(place, number)| number.is_finite().then(|| [left + across * place as f64, y(*number)]))
            .collect();
        // A gap in the numbers is a gap in the curve.
        let runs: Vec<Vec<[f64; 2]>> =
            places.split(Option::is_none).map(|run| run.iter().flatten().copied().collect()).collect();
        svg.strokes(runs.iter().map(Vec::as_slice).filter(|run| !run.is_empty()), 2.0, colour, 1.0);
        svg.strokes(std::iter::once(&[[legend, 94.0], [legend + 20.0, 94.0]][..]), 4.0, colour, 1.0);
        svg.words([legend + 28.0, 99.0], 14.0, "start", INK, words);
        legend += 60.0 + 7.0 * words.chars().count() as f64;
    }
    if let (Some(first), Some(last)) = (frames.first(), frames.last()) {
        svg.words([left, BOTTOM + 22.0], 14.0, "start", INK, &first.frame_id.0.to_string());
        svg.words([left + LENGTH, BOTTOM + 22.0], 14.0, "end", INK, &last.frame_id.0.to_string());
        svg.words([left + 0.5 * LENGTH, BOTTOM + 22.0], 14.0, "middle", INK, "frame");
    }
}

/// Means over runs of neighbouring frames, at most a thousand of them.
fn averaged(frames: &[FrameStatistics], column: Column) -> Vec<f64> {
    let run = frames.len().div_ceil(MOST_PLACES).max(1);
    frames.chunks(run).map(|run| run.iter().map(column).sum::<f64>() / run.len() as f64).collect()
}

/// A round step between ticks, and the first tick that is not under a number of at least 1.
fn ticks(most: f64) -> (f64, f64) {
    let power = libm::pow(10.0, libm::floor(libm::log10(most)));
    let steps = [0.2, 0.5, 1.0, 2.0].map(|part| part * power);
    let step = steps.into_iter().find(|step| most / step <= 6.0).unwrap_or(power).max(1.0);
    (step, step * (most / step).ceil())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        for most in [1.0, 3.0, 9.9, 10.0, 59.0, 128.0, 999.0, 1e6] {
            let (step, top) = ticks(most);
            assert!(top >= most && top / step <= 6.0 && step >= 1.0, "{most}: {step} {top}");
        }
    }

    #[test]
    fn a_figure_of_any_number_of_frames_is_small_and_has_no_number_that_is_none() {
        for count in [0, 1, 2, 50_000] {
            let figure = statistics_figure("a & b", &vec![FrameStatistics::default(); count]);
            assert!(figure.len() < 100_000 && !figure.contains("NaN") && !figure.contains("inf"), "{count}");
            assert!(figure.contains("a &amp; b"));
        }
    }
}
