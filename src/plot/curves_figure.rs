//! Numbers over time, histograms, and costs over the steps of an optimiser.

use super::axis::Axis;
use super::chart::{Area, Chart, pen};
use super::svg::Svg;
use super::trajectory_figure::LengthUnit;
use super::{INK, PAPER};

const WIDTH: f64 = 1200.0;
/// Height of a chart between its axes.
const HEIGHT: f64 = 280.0;
const LEFT: f64 = 100.0;
const RIGHT: f64 = 40.0;
/// Under a chart: its ticks and what it shows.
const FOOT: f64 = 60.0;
/// Bins of a histogram.
const BINS: usize = 40;
/// Errors that differ more than so many times from each other are drawn over powers of ten.
const FAR_APART: f64 = 15.0;
/// A step of more than so many usual ones is a gap.
const GAP: f64 = 10.0;

/// Errors of one estimate over time.
#[derive(Clone, Copy, Debug)]
pub struct ErrorCurve<'a> {
    /// Name of the estimate.
    pub name: &'a str,
    /// Seconds since the begin, rising.
    pub seconds: &'a [f64],
    /// Errors, metres; as many.
    pub error_m: &'a [f64],
}

/// Some numbers under a name.
#[derive(Clone, Copy, Debug)]
pub struct NamedNumbers<'a> {
    /// Name, for the legend.
    pub name: &'a str,
    /// The numbers.
    pub numbers: &'a [f64],
}

/// Absolute errors over time, a curve for each estimate; where estimates differ much, over powers of ten.
///
/// Returns SVG text.
#[must_use]
pub fn error_figure(title: &str, curves: &[ErrorCurve<'_>]) -> String {
    one_chart(title, "Errors over time of", curves.iter().map(|curve| curve.name), |svg, area| {
        draw_errors(svg, area, curves);
    })
}

/// How often errors of each size occur, a curve for each estimate; what is beyond 99 % of all is in the last bin.
///
/// Returns SVG text.
///
/// * `quantity` — what the numbers are, with their unit, such as `RPE of rotation, deg`.
#[must_use]
pub fn histogram_figure(title: &str, quantity: &str, estimates: &[NamedNumbers<'_>]) -> String {
    one_chart(title, "Histogram of errors of", estimates.iter().map(|estimate| estimate.name), |svg, area| {
        draw_histogram(svg, area, quantity, estimates);
    })
}

/// Costs over the steps of optimisers, over powers of ten; a cost that is no number larger than 0 is a gap.
///
/// Returns SVG text.
///
/// * `runs` — cost before the first step, after it, and so on.
#[must_use]
pub fn convergence_figure(title: &str, runs: &[NamedNumbers<'_>]) -> String {
    one_chart(title, "Convergence of", runs.iter().map(|run| run.name), |svg, area| {
        draw_convergence(svg, area, runs);
    })
}

/// A picture of one chart with its legend.
fn one_chart<'a>(
    title: &str,
    what: &str,
    names: impl Iterator<Item = &'a str> + Clone,
    draw: impl Fn(&mut Svg, Area),
) -> String {
    let head = 60.0;
    let height = head + chart_height(names.clone());
    let mut svg = Svg::new(WIDTH, height, PAPER, &format!("{what} {title}"));
    svg.words([40.0, 36.0], 22.0, "start", INK, title);
    draw(&mut svg, chart_area(head, names.clone()));
    legend(&mut svg, head, names);
    svg.finish()
}

/// How high a chart is with its title, legend and axis.
pub(super) fn chart_height<'a>(names: impl Iterator<Item = &'a str> + Clone) -> f64 {
    chart_area(0.0, names).top + HEIGHT + FOOT
}

fn legend_area(top: f64) -> Area {
    Area { left: LEFT, top: top + 20.0, width: WIDTH - LEFT - RIGHT, height: 0.0 }
}

/// Where a chart is whose legend begins at a height.
pub(super) fn chart_area<'a>(top: f64, names: impl Iterator<Item = &'a str> + Clone) -> Area {
    // The legend is measured by drawing it elsewhere.
    let lines = Chart::legend(&mut Svg::new(1.0, 1.0, PAPER, ""), legend_area(top), names);
    Area { left: LEFT, top: top + 20.0 * lines as f64 + 50.0, width: WIDTH - LEFT - RIGHT, height: HEIGHT }
}

/// Draws the legend of a chart, from a height on.
pub(super) fn legend<'a>(svg: &mut Svg, top: f64, names: impl Iterator<Item = &'a str> + Clone) {
    Chart::legend(svg, legend_area(top), names);
}

fn middle(numbers: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = numbers.iter().copied().filter(|number| number.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

fn bounds(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    numbers.filter(|number| number.is_finite()).fold(None, |bounds: Option<[f64; 2]>, number| {
        let [low, high] = bounds.unwrap_or([number; 2]);
        Some([low.min(number), high.max(number)])
    })
}

pub(super) fn draw_errors(svg: &mut Svg, area: Area, curves: &[ErrorCurve<'_>]) {
    let all = || curves.iter().flat_map(|curve| curve.error_m.iter().copied());
    let most = bounds(all()).map_or(0.0, |[_, high]| high);
    let medians = curves.iter().filter_map(|curve| middle(curve.error_m)).filter(|median| *median > 0.0);
    let [least_median, most_median] = bounds(medians).unwrap_or([1.0; 2]);
    let unit = LengthUnit::of(most);
    let logarithmic = most_median > FAR_APART * least_median;
    let y = if logarithmic {
        // Errors far under the usual ones would take the room of the others.
        Axis::logarithmic(0.1 * least_median * unit.per_metre, most * unit.per_metre).with_room(0.03)
    } else {
        Axis::from_zero(most * unit.per_metre)
    };
    let seconds = bounds(curves.iter().flat_map(|curve| curve.seconds.iter().copied())).unwrap_or([0.0, 1.0]);
    let chart = Chart { area, x: Axis::linear(seconds[0], seconds[1]), y };
    chart.frame(svg, &format!("APE of translation, {}", unit.name), "time, s");
    for (index, curve) in curves.iter().enumerate() {
        let steps: Vec<f64> = curve.seconds.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let gap = middle(&steps).map_or(f64::MAX, |usual| GAP * usual);
        let mut places: Vec<Option<[f64; 2]>> = Vec::with_capacity(curve.seconds.len());
        let mut before = None;
        for (second, error) in curve.seconds.iter().zip(curve.error_m) {
            if before.replace(*second).is_some_and(|before: f64| second - before > gap) {
                places.push(None);
            }
            places.push(Some([*second, error * unit.per_metre]));
        }
        chart.curve(svg, &places, &pen(index));
    }
}

pub(super) fn draw_histogram(svg: &mut Svg, area: Area, quantity: &str, estimates: &[NamedNumbers<'_>]) {
    let mut all: Vec<f64> = estimates.iter().flat_map(|estimate| estimate.numbers.iter().copied()).collect();
    all.retain(|number| number.is_finite());
    all.sort_unstable_by(f64::total_cmp);
    let most = all.get((all.len() * 99 / 100).min(all.len().saturating_sub(1))).copied().unwrap_or(0.0);
    let x = Axis::from_zero(most);
    let counts: Vec<Vec<f64>> = estimates.iter().map(|estimate| percents(estimate.numbers, &x)).collect();
    let highest = bounds(counts.iter().flatten().copied()).map_or(1.0, |[_, high]| high);
    let chart = Chart { area, x, y: Axis::from_zero(highest) };
    let beyond = all.last().is_some_and(|last| x.place(*last).is_none_or(|place| place > 1.0));
    let note = if beyond { "; the last bin holds what is beyond" } else { "" };
    chart.frame(svg, "pairs in each bin, %", &format!("{quantity}{note}"));
    for (index, counts) in counts.iter().enumerate() {
        let width = area.width / BINS as f64;
        let height = |count: f64| area.top + area.height * (1.0 - chart.y.place(count).unwrap_or(0.0));
        let mut outline = vec![[area.left, height(0.0)]];
        for (bin, count) in counts.iter().enumerate() {
            let left = area.left + width * bin as f64;
            outline.extend([[left, height(*count)], [left + width, height(*count)]]);
        }
        outline.push([area.left + area.width, height(0.0)]);
        svg.dashed(std::iter::once(outline.as_slice()), 2.0, pen(index).colour, pen(index).dashes);
    }
}

/// How many of some numbers are in each bin along an axis, percent.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
fn percents(numbers: &[f64], x: &Axis) -> Vec<f64> {
    let mut counts = vec![0.0; BINS];
    let finite = || numbers.iter().filter(|number| number.is_finite());
    let each = 100.0 / finite().count().max(1) as f64;
    for number in finite() {
        let place = x.place(*number).unwrap_or(1.0) * BINS as f64;
        counts[place.clamp(0.0, (BINS - 1) as f64) as usize] += each;
    }
    counts
}

fn draw_convergence(svg: &mut Svg, area: Area, runs: &[NamedNumbers<'_>]) {
    let costs = runs.iter().flat_map(|run| run.numbers.iter().copied()).filter(|cost| *cost > 0.0);
    let [low, high] = bounds(costs).unwrap_or([1.0, 10.0]);
    let longest = runs.iter().map(|run| run.numbers.len()).max().unwrap_or(0);
    let x = Axis::linear(0.0, longest.saturating_sub(1).max(1) as f64);
    let chart = Chart { area, x, y: Axis::logarithmic(low, high).with_room(0.04) };
    chart.frame(svg, "cost", "iteration");
    for (index, run) in runs.iter().enumerate() {
        let places: Vec<Option<[f64; 2]>> = run
            .numbers
            .iter()
            .enumerate()
            .map(|(step, cost)| (cost.is_finite() && *cost > 0.0).then_some([step as f64, *cost]))
            .collect();
        chart.curve(svg, &places, &pen(index));
        if places.len() < 60 {
            let dots = places.iter().flatten().filter_map(|place| chart.place(*place));
            svg.dots(dots, 6.0, pen(index).colour, 1.0);
        }
    }
}
