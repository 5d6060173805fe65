//! How what a program takes grows with the size of what it is given.

use super::axis::Axis;
use super::chart::{Area, Chart, TEXT};
use super::svg::Svg;
use super::{COLOURS, INK, PAPER, QUIET};

const WIDTH: f64 = 1200.0;
/// Height of a chart between its axes.
const HEIGHT: f64 = 320.0;
const LEFT: f64 = 100.0;
const RIGHT: f64 = 40.0;
/// Over a chart: its title and what its lines are.
const HEAD: f64 = 60.0;
/// Under a chart: its ticks and its axis' name.
const FOOT: f64 = 60.0;
/// Over the first chart.
const TITLE: f64 = 50.0;

/// Something that was measured at several sizes.
#[derive(Clone, Copy, Debug)]
pub struct Growth<'a> {
    /// What was measured, with its unit, such as `time of an iteration, s`.
    pub quantity: &'a str,
    /// What sizes are counted in, such as `observations`.
    pub size: &'a str,
    /// Sizes and what was measured at them, larger than 0; others are passed over.
    pub places: &'a [[f64; 2]],
}

impl Growth<'_> {
    /// The power of the size with which the quantity grows: 1 where twice the size takes twice as much.
    ///
    /// The slope k of the line `log y = k log x + c` that fits by least squares; `None` without two different sizes.
    #[must_use]
    pub fn exponent(&self) -> Option<f64> {
        self.line().map(|(exponent, _)| exponent)
    }

    fn sound(&self) -> impl Iterator<Item = [f64; 2]> + Clone + '_ {
        let positive = |number: &f64| *number > 0.0 && number.is_finite();
        self.places.iter().copied().filter(move |place| place.iter().all(positive))
    }

    /// Exponent k and factor a of `a x^k`.
    fn line(&self) -> Option<(f64, f64)> {
        let logs = || self.sound().map(|place| place.map(libm::log));
        let count = logs().count() as f64;
        let sum = logs().fold([0.0; 2], |sum, [x, y]| [sum[0] + x, sum[1] + y]);
        let [mean_x, mean_y] = sum.map(|sum| sum / count);
        let (mut square, mut product) = (0.0, 0.0);
        for [x, y] in logs() {
            square += (x - mean_x) * (x - mean_x);
            product += (x - mean_x) * (y - mean_y);
        }
        let exponent = product / square;
        // One size alone gives 0/0 but for rounding.
        (square > 1e-12 && exponent.is_finite()).then(|| (exponent, libm::exp(mean_y - exponent * mean_x)))
    }
}

/// A chart for each thing that grows, over powers of ten both ways: what was measured, the power that fits it, and what it would be if
/// it grew as the size does from the smallest one on.
///
/// Returns SVG text.
#[must_use]
pub fn growth_figure(title: &str, growths: &[Growth<'_>]) -> String {
    let each = HEAD + HEIGHT + FOOT;
    let mut svg =
        Svg::new(WIDTH, TITLE + each * growths.len() as f64, PAPER, &format!("Growth with size: {title}"));
    svg.words([40.0, 36.0], 22.0, "start", INK, title);
    for (index, growth) in growths.iter().enumerate() {
        let top = TITLE + each * index as f64 + HEAD;
        let area = Area { left: LEFT, top, width: WIDTH - LEFT - RIGHT, height: HEIGHT };
        draw(&mut svg, area, growth, COLOURS[index % COLOURS.len()]);
    }
    svg.finish()
}

fn draw(svg: &mut Svg, area: Area, growth: &Growth<'_>, colour: &str) {
    let bounds = |of: usize| {
        let [low, high] = growth.sound().fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], place| {
            [low.min(place[of]), high.max(place[of])]
        });
        if low <= high { [low, high] } else { [1.0, 10.0] }
    };
    let ([least, most], [low, high]) = (bounds(0), bounds(1));
    let chart = Chart {
        area,
        x: Axis::logarithmic(least, most).with_room(0.06),
        y: Axis::logarithmic(low, high).with_room(0.12),
    };
    chart.frame(svg, growth.quantity, growth.size);
    let mut words = "grey: proportional to the size".to_owned();
    if let Some(first) = growth.sound().min_by(|one, other| one[0].total_cmp(&other[0])) {
        let proportional = [first, [most, first[1] * (most / first[0])]];
        stroke(svg, &chart, proportional, QUIET, "2 4");
    }
    if let Some((exponent, factor)) = growth.line() {
        let fitted = [least, most].map(|size| [size, factor * libm::pow(size, exponent)]);
        stroke(svg, &chart, fitted, colour, "8 3");
        words = format!("dashed: the power {exponent:.2} of the size, fitted; {words}");
    }
    svg.words([area.left, area.top - 6.0], TEXT, "start", INK, &words);
    svg.dots(growth.sound().filter_map(|place| chart.place(place)), 9.0, colour, 1.0);
}

/// A straight line between two places, as far as it lies in the chart.
fn stroke(svg: &mut Svg, chart: &Chart, [from, to]: [[f64; 2]; 2], colour: &str, dashes: &str) {
    const PIECES: u32 = 200;
    let between = |part: f64, of: usize| libm::pow(to[of] / from[of], part) * from[of];
    let places: Vec<[f64; 2]> = (0..=PIECES)
        .map(|piece| f64::from(piece) / f64::from(PIECES))
        .filter_map(|part| chart.place([between(part, 0), between(part, 1)]))
        .collect();
    svg.dashed(std::iter::once(places.as_slice()), 2.0, colour, dashes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn growth(places: &[[f64; 2]]) -> Growth<'_> {
        Growth { quantity: "time, s", size: "observations", places }
    }

    proptest! {
        #[test]
        fn the_power_of_a_power_is_found(
            exponent in -3.0..3.0_f64, factor in 1e-6..1e6_f64, sizes in prop::collection::vec(1.0..1e8_f64, 2..9),
        ) {
            let low = sizes.iter().copied().fold(f64::INFINITY, f64::min);
            let high = sizes.iter().copied().fold(0.0, f64::max);
            prop_assume!(high > 1.01 * low);
            let places: Vec<[f64; 2]> = sizes.iter().map(|size| [*size, factor * size.powf(exponent)]).collect();
            // Rounding of logarithms of up to 70, over sizes that differ by a hundredth.
            prop_assert!((growth(&places).exponent().unwrap() - exponent).abs() < 1e-6);
        }
    }

    #[test]
    fn one_size_has_no_power_and_numbers_without_logarithms_are_passed_over() {
        assert_eq!(growth(&[]).exponent(), None);
        assert_eq!(growth(&[[7.0, 1.0], [7.0, 2.0]]).exponent(), None);
        let places = [[1.0, 3.0], [0.0, 1.0], [2.0, f64::NAN], [3.0, -1.0], [10.0, 300.0]];
        assert!((growth(&places).exponent().unwrap() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn every_place_is_a_dot_and_the_power_is_said() {
        let places = [[1e5, 0.1], [1e6, 1.0], [1e7, 10.0]];
        let picture = growth_figure("corridors", &[growth(&places), growth(&[])]);
        assert_eq!(picture.matches("h0").count(), places.len());
        assert!(picture.contains("the power 1.00 of the size"), "{picture}");
        assert!(!picture.contains("NaN") && !picture.contains("inf"));
    }
}
