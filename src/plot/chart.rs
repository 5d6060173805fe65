//! A chart with two axes, a grid, curves and a legend.

use super::axis::Axis;
use super::svg::Svg;
use super::{COLOURS, FAINT, INK};

/// Size of ordinary text, and how wide a character of it is at most on average.
pub(super) const TEXT: f64 = 14.0;
const CHARACTER: f64 = 0.56;
/// Most places of one curve; of more, neighbours are averaged.
const MOST_PLACES: usize = 1500;
/// Longest name of a curve, characters.
const LONGEST_NAME: usize = 28;

/// Where something is in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// A chart in a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart {
    /// Between the axes.
    pub(super) area: Area,
    pub(super) x: Axis,
    pub(super) y: Axis,
}

/// What a curve is drawn with: its colour and its dashes, for those who see no colours.
pub(super) struct Pen {
    pub(super) colour: &'static str,
    pub(super) dashes: &'static str,
}

/// The pen of the n-th curve.
pub(super) fn pen(index: usize) -> Pen {
    const ORDER: [usize; 6] = [1, 0, 2, 3, 4, 5];
    const DASHES: [&str; 4] = ["", "8 3", "2 3", "10 3 2 3"];
    Pen { colour: COLOURS[ORDER[index % ORDER.len()]], dashes: DASHES[(index / ORDER.len()) % DASHES.len()] }
}

/// How wide a text is, at most.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    CHARACTER * size * text.chars().count() as f64
}

/// A name that is not too long for a legend.
pub(super) fn short_name(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        return name.to_owned();
    }
    name.chars().take(LONGEST_NAME - 1).chain(['…']).collect()
}

impl Chart {
    /// Grid, ticks, and what both axes are; the title stands 26 units over the chart, the axis' name 40 under it.
    pub(super) fn frame(&self, svg: &mut Svg, title: &str, x_name: &str) {
        let Area { left, top, width, height } = self.area;
        svg.words([left, top - 26.0], TEXT + 2.0, "start", INK, title);
        for tick in self.y.ticks() {
            let Some(place) = self.y.place(tick.number) else { continue };
            let y = top + height * (1.0 - place);
            svg.strokes(std::iter::once(&[[left, y], [left + width, y]][..]), 1.0, FAINT, 0.8);
            svg.words([left - 8.0, y + 5.0], TEXT, "end", INK, &tick.words);
        }
        let mut free_from = f64::MIN;
        for tick in self.x.ticks() {
            let Some(place) = self.x.place(tick.number) else { continue };
            let x = left + width * place;
            svg.strokes(std::iter::once(&[[x, top + height], [x, top + height + 5.0]][..]), 1.0, INK, 0.8);
            // Ticks whose texts would touch are left without.
            let half = 0.5 * text_width(&tick.words, TEXT);
            if x - half > free_from {
                svg.words([x, top + height + 20.0], TEXT, "middle", INK, &tick.words);
                free_from = x + half + 6.0;
            }
        }
        let bottom = [[left, top + height], [left + width, top + height]];
        svg.strokes(std::iter::once(&bottom[..]), 1.0, INK, 0.8);
        svg.words([left + 0.5 * width, top + height + 40.0], TEXT, "middle", INK, x_name);
    }

    /// Where numbers are in the picture; `None` outside the chart's axes, but for a hair.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (x, y) = (self.x.place(x)?, self.y.place(y)?);
        let inside = [x, y].iter().all(|place| (-0.001..=1.001).contains(place));
        let Area { left, top, width, height } = self.area;
        inside.then_some([left + width * x, top + height * (1.0 - y)])
    }

    /// A curve; gaps where `None` stands or a number has no place.
    pub(super) fn curve(&self, svg: &mut Svg, places: &[Option<[f64; 2]>], pen: &Pen) {
        let run = places.len().div_ceil(MOST_PLACES).max(1);
        let drawn: Vec<Option<[f64; 2]>> = places.chunks(run).map(|run| self.place(mean(run)?)).collect();
        let strokes = drawn.split(Option::is_none).filter(|run| !run.is_empty());
        let strokes: Vec<Vec<[f64; 2]>> =
            strokes.map(|run| run.iter().flatten().copied().collect()).collect();
        svg.dashed(strokes.iter().map(Vec::as_slice), 2.0, pen.colour, pen.dashes);
    }

    /// The names of curves, in lines right over the chart, so that the last line ends 8 units above it; gives how many lines.
    pub(super) fn legend<'a>(
        svg: &mut Svg,
        area: Area,
        names: impl Iterator<Item = &'a str> + Clone,
    ) -> usize {
        let entries: Vec<(Pen, String)> =
            names.enumerate().map(|(index, name)| (pen(index), short_name(name))).collect();
        let (mut line, mut left) = (0, area.left);
        for (pen, name) in entries {
            let width = 28.0 + text_width(&name, TEXT) + 18.0;
            if left > area.left && left + width > area.left + area.width {
                (line, left) = (line + 1, area.left);
            }
            let y = area.top + 20.0 * line as f64;
            svg.dashed(
                std::iter::once(&[[left, y - 5.0], [left + 22.0, y - 5.0]][..]),
                3.0,
                pen.colour,
                pen.dashes,
            );
            svg.words([left + 28.0, y], TEXT, "start", INK, &name);
            left += width;
        }
        line + 1
    }
}

/// The middle of neighbouring places; `None` without one.
fn mean(run: &[Option<[f64; 2]>]) -> Option<[f64; 2]> {
    let there = run.iter().flatten();
    let count = there.clone().count();
    let sum = there.fold([0.0; 2], |sum, place| [sum[0] + place[0], sum[1] + place[1]]);
    (count > 0).then(|| sum.map(|sum| sum / count as f64))
}
