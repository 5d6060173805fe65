//! Charts for a page: their colours, dashes and fonts come from the page's style sheet, by class.

use std::fmt::Write as _;

use super::axis::Axis;
use super::svg::escaped;

/// Size of the drawing; small, so that its text is readable on a phone.
const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 232.0;
/// Between the axes.
const LEFT: f64 = 54.0;
const TOP: f64 = 12.0;
const ACROSS: f64 = WIDTH - LEFT - 14.0;
const HIGH: f64 = HEIGHT - TOP - 44.0;
/// Most places of one curve; of more, neighbours are averaged.
const MOST_PLACES: usize = 600;
/// How wide a character is at most on average.
const CHARACTER: f64 = 7.4;
/// The same of letters that are a size smaller.
const TIGHT_CHARACTER: f64 = 6.3;

/// How numbers are laid out along the upward axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Upward {
    /// From 0 on.
    FromZero,
    /// From the least to the largest.
    Linear,
    /// Over powers of ten; what is not larger than 0 is a gap.
    Logarithmic,
}

/// A curve of a chart.
#[derive(Clone, Copy, Debug)]
pub struct PageCurve<'a> {
    /// Classes of the style sheet.
    pub class: &'a str,
    /// Numbers to the right and upward; a number that is not finite is a gap.
    pub places: &'a [[f64; 2]],
}

/// Bars of one kind, one for each category.
#[derive(Clone, Copy, Debug)]
pub struct PageBars<'a> {
    /// Classes of the style sheet.
    pub class: &'a str,
    /// Heights; those that are not finite are left out.
    pub heights: &'a [f64],
}

/// A chart of curves.
///
/// Returns an `svg` element. Its attribute `data-area` has left, top, width and height of what lies between the axes, `data-x` the
/// numbers at both ends of the axis to the right, so that a page can mark a place.
///
/// * `title` — what it shows, for those who cannot see it.
/// * `x_name` — what the axis to the right is, with its unit.
#[must_use]
pub fn page_chart(title: &str, x_name: &str, upward: Upward, curves: &[PageCurve<'_>]) -> String {
    let all = || curves.iter().flat_map(|curve| curve.places.iter().copied());
    let [left, right] = bounds(all().map(|place| place[0])).unwrap_or([0.0, 1.0]);
    let numbers = all().map(|place| place[1]);
    let y = match upward {
        Upward::FromZero => Axis::from_zero(bounds(numbers).map_or(1.0, |[_, high]| high)),
        Upward::Linear => {
            let [low, high] = bounds(numbers).unwrap_or([0.0, 1.0]);
            Axis::linear(low, high).with_room(0.05)
        }
        Upward::Logarithmic => {
            let [low, high] = bounds(numbers.filter(|number| *number > 0.0)).unwrap_or([1.0, 10.0]);
            Axis::logarithmic(low, high).with_room(0.05)
        }
    };
    let x = Axis::linear(left, right);
    let data = format!(" data-area=\"{LEFT} {TOP} {ACROSS} {HIGH}\" data-x=\"{left} {right}\"");
    let mut svg = opened(title, &data);
    let counted = upward == Upward::FromZero && all().all(|place| place[1].fract() == 0.0);
    upward_grid(&mut svg, &y, counted);
    let mut free_from = f64::MIN;
    // What is counted has no parts: a frame, a step.
    let whole = all().all(|place| place[0].fract() == 0.0);
    for tick in x.ticks().into_iter().filter(|tick| !whole || tick.number.fract() == 0.0) {
        let Some(place) = x.place(tick.number) else { continue };
        let half = 0.5 * CHARACTER * tick.words.chars().count() as f64;
        let at = LEFT + ACROSS * place;
        // Ticks whose texts would touch are left out.
        if at - half > free_from {
            under(&mut svg, at, "middle", &tick.words);
            free_from = at + half + 8.0;
        }
    }
    for curve in curves {
        let run = curve.places.len().div_ceil(MOST_PLACES).max(1);
        let placed = |run: &[[f64; 2]]| -> Option<[f64; 2]> {
            let [across, up] = mean(run)?;
            let place = [x.place(across)?, y.place(up)?];
            let inside = place.iter().all(|part| (-0.01..=1.01).contains(part));
            inside.then(|| [LEFT + ACROSS * place[0], TOP + HIGH * (1.0 - place[1])])
        };
        let places: Vec<Option<[f64; 2]>> = curve.places.chunks(run).map(placed).collect();
        let mut path = String::new();
        for stroke in places.split(Option::is_none) {
            for (index, [x, y]) in stroke.iter().flatten().enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
            }
            // A place alone is a dot.
            if stroke.len() == 1 {
                path += "h0";
            }
        }
        let _ = write!(svg, "<path class=\"curve {}\" d=\"{path}\"/>", escaped(curve.class));
    }
    closed(svg, x_name)
}

/// A chart of bars that stand beside each other by category.
///
/// Returns an `svg` element.
///
/// * `title` — what it shows, for those who cannot see it.
/// * `x_name` — what the categories are.
#[must_use]
pub fn page_bars(title: &str, x_name: &str, categories: &[String], kinds: &[PageBars<'_>]) -> String {
    let most = bounds(kinds.iter().flat_map(|kind| kind.heights.iter().copied()));
    let y = Axis::from_zero(most.map_or(1.0, |[_, high]| high));
    let mut svg = opened(title, "");
    let whole = kinds.iter().flat_map(|kind| kind.heights).all(|height| height.fract() == 0.0);
    upward_grid(&mut svg, &y, whole);
    let room = ACROSS / categories.len().max(1) as f64;
    // Letters that are a size smaller, where names would touch.
    let longest = categories.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let tight = CHARACTER * longest as f64 + 4.0 > room;
    let character = if tight { TIGHT_CHARACTER } else { CHARACTER };
    if tight {
        svg += "<g class=\"tight\">";
    }
    let width = (0.8 * room / kinds.len().max(1) as f64).min(40.0);
    let mut free_from = f64::MIN;
    for (place, category) in categories.iter().enumerate() {
        let middle = LEFT + room * (place as f64 + 0.5);
        let half = 0.5 * character * category.chars().count() as f64;
        if middle - half > free_from {
            under(&mut svg, middle, "middle", category);
            free_from = middle + half + 2.0;
        }
        for (index, kind) in kinds.iter().enumerate() {
            let Some(part) = kind.heights.get(place).and_then(|height| y.place(*height)) else { continue };
            let x = middle + width * (index as f64 - 0.5 * kinds.len() as f64);
            let (top, high) = (TOP + HIGH * (1.0 - part), HIGH * part);
            let _ = write!(
                svg,
                "<rect class=\"bar {}\" x=\"{x:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{high:.1}\"/>",
                escaped(kind.class),
                width - 1.5
            );
        }
    }
    if tight {
        svg += "</g>";
    }
    closed(svg, x_name)
}

fn opened(title: &str, data: &str) -> String {
    format!(
        "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\"{data}>",
        escaped(title)
    )
}

fn closed(mut svg: String, x_name: &str) -> String {
    let bottom = TOP + HIGH;
    let _ = write!(svg, "<path class=\"axis\" d=\"M{LEFT} {bottom}h{ACROSS}\"/>");
    let _ = write!(
        svg,
        "<text class=\"name\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text></svg>",
        LEFT + ACROSS,
        HEIGHT - 6.0,
        escaped(x_name)
    );
    svg
}

/// Lines across, each with its number at the left.
///
/// * `whole` — whether only whole numbers have one.
fn upward_grid(svg: &mut String, y: &Axis, whole: bool) {
    for tick in y.ticks().into_iter().filter(|tick| !whole || tick.number.fract() == 0.0) {
        let Some(place) = y.place(tick.number).filter(|place| (-0.001..=1.001).contains(place)) else {
            continue;
        };
        let height = TOP + HIGH * (1.0 - place);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{LEFT} {height:.1}h{ACROSS}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 7.0,
            height + 4.0,
            escaped(&tick.words)
        );
    }
}

fn under(svg: &mut String, x: f64, anchor: &str, words: &str) {
    let y = TOP + HIGH + 17.0;
    let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"{anchor}\">{}</text>", escaped(words));
}

fn bounds(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    numbers.filter(|number| number.is_finite()).fold(None, |bounds: Option<[f64; 2]>, number| {
        let [low, high] = bounds.unwrap_or([number; 2]);
        Some([low.min(number), high.max(number)])
    })
}

/// The middle of neighbouring places that are finite; `None` without one.
fn mean(run: &[[f64; 2]]) -> Option<[f64; 2]> {
    let finite = || run.iter().filter(|place| place.iter().all(|part| part.is_finite()));
    let count = finite().count();
    let sum = finite().fold([0.0; 2], |sum, place| [sum[0] + place[0], sum[1] + place[1]]);
    (count > 0).then(|| sum.map(|sum| sum / count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_gap_in_the_numbers_is_a_gap_in_the_curve() {
        let places = [[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 1.0], [4.0, 2.0]];
        let svg =
            page_chart("t", "frame", Upward::FromZero, &[PageCurve { class: "points", places: &places }]);
        let path = svg.split("class=\"curve points\" d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!(path.matches('M').count(), 2, "{path}");
        assert!(svg.contains("data-x=\"0 4\""));
    }

    #[test]
    fn bars_are_as_high_as_their_numbers() {
        let categories = ["1".to_owned(), "2".to_owned()];
        let svg =
            page_bars("t", "frames", &categories, &[PageBars { class: "points", heights: &[5.0, 10.0] }]);
        let heights: Vec<f64> = svg
            .split(" height=\"")
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap().parse().unwrap())
            .collect();
        // Written to a tenth.
        assert!(
            (heights[1] - 2.0 * heights[0]).abs() < 0.11 && (heights[1] - HIGH).abs() < 0.11,
            "{heights:?}"
        );
    }

    proptest! {
        #[test]
        fn any_numbers_make_a_chart_of_numbers(
            places in prop::collection::vec(prop::array::uniform2(any::<f64>()), 0..8),
            heights in prop::collection::vec(any::<f64>(), 0..5),
        ) {
            for upward in [Upward::FromZero, Upward::Linear, Upward::Logarithmic] {
                let curve = PageCurve { class: "a", places: &places };
                let svg = page_chart("<t> & t", "x", upward, &[curve, curve]);
                prop_assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
                prop_assert!(svg.contains("&lt;t&gt; &amp; t") && svg.ends_with("</svg>"));
            }
            let categories = vec!["1–2".to_owned(); 4];
            let svg = page_bars("t", "x", &categories, &[PageBars { class: "a", heights: &heights }]);
            prop_assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn a_chart_of_many_numbers_is_small() {
        let places: Vec<[f64; 2]> = (0..100_000).map(f64::from).map(|n| [n, n.sin()]).collect();
        assert!(
            page_chart("t", "x", Upward::Linear, &[PageCurve { class: "a", places: &places }]).len() < 12_000
        );
    }
}
