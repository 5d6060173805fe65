//! A panel with two axes: curves, and paths in a plane.

use super::super::axis::{Axis, Tick};
use super::super::chart::Area;
use super::super::heat;
use super::curve::{Curve, Drawn, Role};
use super::legend::{Entry, Sample};
use super::sheet::{Mark, Sheet, Stroke};
use super::style::{Margins, Style, TICK, printed};

/// Width of a bar of colours, and room before it, points.
const BAR: f64 = 6.0;
const BEFORE_BAR: f64 = 7.0;
/// Diameter of a mark, points.
const MARK: f64 = 3.4;
/// Marks along a curve that has more places than marks.
const MARKS: usize = 7;

/// How numbers are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// From 0 on.
    FromZero,
    /// From the least to the largest.
    Linear,
    /// From the least to the largest whole number, with ticks at whole numbers alone.
    Whole,
    /// Over powers of ten; what is not larger than 0 is a gap.
    Logarithmic,
    /// Over powers of ten from a number on; what is smaller is a gap.
    LogarithmicFrom(f64),
}

/// What the colours of a path mean: from 0 to a number.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourBar {
    /// The quantity with its unit.
    pub name: String,
    /// The number of the lightest colour.
    pub highest: f64,
}

/// A panel with two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// The quantity to the right, with its unit; without one, numbers at the axis are left out as well, for a chart that stands over
    /// another with the same axis.
    pub x_name: Option<String>,
    /// The quantity upward, with its unit.
    pub y_name: String,
    /// Axis to the right.
    pub x: Scale,
    /// Axis upward.
    pub y: Scale,
    /// Whether lengths are the same along both axes, as on a map.
    pub same_scale: bool,
    /// Height over width, where lengths are not the same.
    pub aspect: f64,
    /// What the colours of [`Drawn::Heat`] mean.
    pub colour_bar: Option<ColourBar>,
    /// The curves.
    pub curves: Vec<Curve>,
}

impl Chart {
    /// The least and the largest number along an axis; `None` without a finite one.
    fn bounds(&self, axis: usize, scale: Scale) -> Option<[f64; 2]> {
        let numbers = self.curves.iter().flat_map(|curve| {
            let width = if let (Drawn::Steps(width), 0) = (&curve.drawn, axis) { *width } else { 0.0 };
            curve.places.iter().flat_map(move |place| [place[axis], place[axis] + width])
        });
        let least = match scale {
            Scale::Logarithmic => f64::MIN_POSITIVE,
            Scale::LogarithmicFrom(least) => least.max(f64::MIN_POSITIVE),
            Scale::FromZero | Scale::Linear | Scale::Whole => f64::NEG_INFINITY,
        };
        numbers.filter(|number| number.is_finite() && *number >= least).fold(
            None,
            |bounds: Option<[f64; 2]>, number| {
                let [low, high] = bounds.unwrap_or([number; 2]);
                Some([low.min(number), high.max(number)])
            },
        )
    }

    /// Whether there is something to draw.
    pub(super) fn has_places(&self) -> bool {
        self.bounds(0, self.x).is_some() && self.bounds(1, self.y).is_some()
    }

    fn axes(&self, [width, height]: [f64; 2]) -> [Axis; 2] {
        let axis = |of: usize, scale: Scale| {
            let bounds = self.bounds(of, scale);
            let [low, high] = bounds.unwrap_or([0.0, 1.0]);
            // To the right curves go from border to border, upward they keep off them.
            let room = if of == 0 { 0.0 } else { 0.05 };
            match scale {
                Scale::FromZero => Axis::from_zero(high),
                Scale::Linear => Axis::linear(low, high).with_room(room),
                Scale::Whole => Axis::linear(low, high),
                Scale::Logarithmic => {
                    let [low, high] = bounds.unwrap_or([1.0, 10.0]);
                    Axis::logarithmic(low, high).with_room(room)
                }
                Scale::LogarithmicFrom(least) => {
                    Axis::logarithmic(least, bounds.map_or(10.0 * least, |[_, high]| high)).with_room(room)
                }
            }
        };
        if !self.same_scale {
            return [axis(0, self.x), axis(1, self.y)];
        }
        let [x, y] = [0, 1].map(|of| self.bounds(of, Scale::Linear).unwrap_or([0.0, 1.0]));
        // Units for a point of the drawing, with some room around the path.
        let per_point = (1.08 * (x[1] - x[0]) / width).max(1.08 * (y[1] - y[0]) / height);
        let per_point = if per_point.is_finite() && per_point > 0.0 { per_point } else { 1.0 / width };
        [(x, width), (y, height)].map(|([low, high], length)| {
            let (middle, half) = (0.5 * low + 0.5 * high, 0.5 * per_point * length);
            Axis::linear(middle - half, middle + half)
        })
    }

    fn x_ticks(&self, axis: &Axis, width: f64, style: &Style) -> Vec<Tick> {
        let mut ticks = axis.ticks_about((width / (4.2 * style.small)).clamp(2.0, 8.0));
        if self.x == Scale::Whole {
            ticks.retain(|tick| tick.number.fract() == 0.0);
        }
        ticks.into_iter().map(|tick| Tick { words: printed(&tick.words), ..tick }).collect()
    }

    fn y_ticks(axis: &Axis, height: f64, style: &Style) -> Vec<Tick> {
        let about = (height / (1.9 * style.small)).clamp(2.0, 6.0);
        let mut ticks = axis.ticks_about(about);
        // One number alone tells no scale.
        if ticks.len() < 2 {
            ticks = axis.ticks_about(2.0 * about);
        }
        ticks.into_iter().map(|tick| Tick { words: printed(&tick.words), ..tick }).collect()
    }

    /// Room that its numbers and names need.
    ///
    /// * `inner` — width and height between the axes, points.
    pub(super) fn margins(&self, style: &Style, inner: [f64; 2]) -> Margins {
        let [x, y] = self.axes(inner);
        let ticks = Self::y_ticks(&y, inner[1], style);
        let left = style.widest(ticks.iter().map(|tick| tick.words.as_str())) + TICK + 2.0 + 1.4 * style.text;
        let bottom = if self.x_name.is_some() {
            TICK + 1.2 * style.small + 1.35 * style.text
        } else {
            0.4 * style.small
        };
        let last = self
            .x_ticks(&x, inner[0], style)
            .last()
            .map_or(0.0, |tick| style.face.width(&tick.words, style.small));
        let mut right = if self.x_name.is_some() { 0.5 * last } else { 1.0 };
        if let Some(bar) = &self.colour_bar {
            let ticks = Self::y_ticks(&Axis::linear(0.0, bar.highest), inner[1], style);
            let words = style.widest(ticks.iter().map(|tick| tick.words.as_str()));
            right = BEFORE_BAR + BAR + TICK + 2.0 + words + 1.4 * style.text;
        }
        Margins { left, right, top: 0.4 * style.small, bottom }
    }

    /// How high it is between its axes if nobody says so.
    pub(super) fn height(&self, style: &Style, cell: f64, inner: f64) -> f64 {
        let name = style.face.width(&self.y_name, style.text);
        if !self.same_scale {
            return (self.aspect * cell).max(name);
        }
        let [x, y] = [0, 1].map(|of| self.bounds(of, Scale::Linear).unwrap_or([0.0, 1.0]));
        let aspect = (y[1] - y[0]) / (x[1] - x[0]);
        let aspect = if aspect.is_finite() { aspect.clamp(0.35, 1.05) } else { 0.7 };
        (aspect * inner).max(name)
    }

    /// Whether its curves are told apart by marks as well.
    fn has_marks(&self) -> bool {
        let series = self.curves.iter().filter(|curve| matches!(curve.role, Role::Series(_)));
        series.count() > 1
    }

    /// Names of its curves.
    pub(super) fn entries(&self, style: &Style) -> Vec<Entry> {
        let sample = |curve: &Curve| {
            let marked = match curve.drawn {
                // A colour out of the middle of the bar.
                Drawn::Heat(_) => return Sample::Stroke(heat::colour(heat::SHADES / 2), 1.8),
                Drawn::Marked => true,
                Drawn::Line | Drawn::Path => self.has_marks(),
                Drawn::Steps(_) => false,
            };
            Sample::Pen(curve.role.pen(style.colours), marked)
        };
        self.curves.iter().map(|curve| Entry { sample: sample(curve), name: curve.name.clone() }).collect()
    }

    /// Draws it.
    ///
    /// * `area` — between the axes.
    /// * `left` — room at its left, which names of axes share in a column.
    pub(super) fn draw(&self, sheet: &mut Sheet, style: &Style, area: Area, left: f64) {
        let Area { left: begin, top, width, height } = area;
        let axes = self.axes([width, height]);
        let (ink, bottom) = (style.colours.ink, top + height);
        let ticks = Self::y_ticks(&axes[1], height, style);
        let mut free_to = f64::MAX;
        for tick in &ticks {
            let Some(place) = axes[1].place(tick.number).filter(|place| (-0.001..=1.001).contains(place))
            else {
                continue;
            };
            let y = bottom - height * place;
            sheet.line("grid", [[begin, y], [begin + width, y]], Stroke::new(style.colours.faint, 0.4));
            sheet.line("tick", [[begin - TICK, y], [begin, y]], Stroke::new(ink, 0.6));
            if y + 0.5 * style.small < free_to {
                sheet.words(
                    [begin - TICK - 2.0, y + 0.35 * style.small],
                    style.small,
                    "end",
                    ink,
                    &tick.words,
                );
                free_to = y - 0.55 * style.small;
            }
        }
        for number in axes[1].minor_ticks() {
            let Some(place) = axes[1].place(number).filter(|place| (0.0..=1.0).contains(place)) else {
                continue;
            };
            let y = bottom - height * place;
            sheet.line("minor", [[begin - 0.6 * TICK, y], [begin, y]], Stroke::new(ink, 0.4));
        }
        self.foot(sheet, style, area, &axes[0]);
        let corner = [[begin, top], [begin, bottom], [begin + width, bottom]];
        sheet.strokes("axis", std::iter::once(&corner[..]), Stroke::new(ink, 0.6));
        sheet.upward_words(
            [begin - left + 0.85 * style.text, top + 0.5 * height],
            style.text,
            ink,
            &self.y_name,
        );
        let marked = self.has_marks();
        for curve in &self.curves {
            match &curve.drawn {
                Drawn::Heat(values) => self.heat(sheet, area, &axes, curve, values),
                _ => stroke(sheet, style, area, &axes, curve, marked),
            }
        }
        if let Some(bar) = &self.colour_bar {
            colour_bar(sheet, style, area, bar);
        }
    }

    fn foot(&self, sheet: &mut Sheet, style: &Style, area: Area, axis: &Axis) {
        let (ink, bottom) = (style.colours.ink, area.top + area.height);
        let mut free_from = f64::MIN;
        for tick in self.x_ticks(axis, area.width, style) {
            let Some(place) = axis.place(tick.number).filter(|place| (-0.001..=1.001).contains(place)) else {
                continue;
            };
            let x = area.left + area.width * place;
            sheet.line("tick", [[x, bottom], [x, bottom + TICK]], Stroke::new(ink, 0.6));
            // Ticks whose texts would touch are left without.
            let half = 0.5 * style.face.width(&tick.words, style.small);
            if self.x_name.is_some() && x - half > free_from {
                sheet.words([x, bottom + TICK + 1.05 * style.small], style.small, "middle", ink, &tick.words);
                free_from = x + half + 0.6 * style.small;
            }
        }
        if let Some(name) = &self.x_name {
            let y = bottom + TICK + 1.2 * style.small + style.text;
            sheet.words([area.left + 0.5 * area.width, y], style.text, "middle", ink, name);
        }
    }

    fn heat(&self, sheet: &mut Sheet, area: Area, axes: &[Axis; 2], curve: &Curve, values: &[f64]) {
        let highest = self.colour_bar.as_ref().map_or(1.0, |bar| bar.highest);
        let highest = if highest > 0.0 { highest } else { 1.0 };
        let places: Vec<Option<[f64; 2]>> =
            curve.places.iter().step_by(curve.every()).map(|place| placed(area, axes, *place)).collect();
        let values: Vec<f64> = values.iter().step_by(curve.every()).copied().collect();
        let mut strokes: Vec<Vec<[[f64; 2]; 2]>> = vec![Vec::new(); heat::SHADES];
        for (ends, values) in places.windows(2).zip(values.windows(2)) {
            let [Some(begin), Some(end)] = ends else { continue };
            strokes[heat::shade(0.5 * (values[0] + values[1]) / highest)].push([*begin, *end]);
        }
        for (shade, strokes) in strokes.iter().enumerate() {
            sheet.strokes(
                "heat",
                strokes.iter().map(<[_; 2]>::as_slice),
                Stroke::new(&heat::colour(shade), 1.8),
            );
        }
    }
}

/// Where numbers are in the drawing; `None` outside the axes, but for a hair.
fn placed(area: Area, axes: &[Axis; 2], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let (x, y) = (axes[0].place(x)?, axes[1].place(y)?);
    let inside = [x, y].iter().all(|place| (-0.002..=1.002).contains(place));
    inside.then_some([area.left + area.width * x, area.top + area.height * (1.0 - y)])
}

fn stroke(sheet: &mut Sheet, style: &Style, area: Area, axes: &[Axis; 2], curve: &Curve, marked: bool) {
    let pen = curve.role.pen(style.colours);
    let places: Vec<[f64; 2]> = match curve.drawn {
        Drawn::Steps(width) => outline(&curve.places, width),
        _ => curve.thinned(),
    };
    let drawn: Vec<Option<[f64; 2]>> = places.iter().map(|place| placed(area, axes, *place)).collect();
    let runs: Vec<Vec<[f64; 2]>> = drawn
        .split(Option::is_none)
        .filter(|run| !run.is_empty())
        .map(|run| run.iter().flatten().copied().collect())
        .collect();
    sheet.strokes("curve", runs.iter().map(Vec::as_slice), pen.stroke);
    let Some(mark) = pen.mark.or((curve.drawn == Drawn::Marked).then_some(Mark::Circle)) else {
        // A place between gaps has no length.
        let alone = runs.iter().filter(|run| run.len() == 1).map(|run| run[0]);
        return sheet.marks("mark", Mark::Circle, alone, pen.stroke.width, pen.stroke.colour);
    };
    match curve.drawn {
        Drawn::Marked => sheet.marks("mark", mark, drawn.iter().flatten().copied(), MARK, pen.stroke.colour),
        Drawn::Line | Drawn::Path if marked => {
            let there: Vec<[f64; 2]> = drawn.iter().flatten().copied().collect();
            let every = there.len().div_ceil(MARKS).max(1);
            // Curves that lie on each other have their marks beside each other.
            let shift = if let Role::Series(place) = curve.role { place * every / 4 % every } else { 0 };
            sheet.marks("mark", mark, there.into_iter().skip(shift).step_by(every), MARK, pen.stroke.colour);
        }
        _ => {}
    }
}

/// The outline of steps that stand on zero.
fn outline(places: &[[f64; 2]], width: f64) -> Vec<[f64; 2]> {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return Vec::new() };
    let mut outline = vec![[first[0], 0.0]];
    outline.extend(places.iter().flat_map(|[left, height]| [[*left, *height], [left + width, *height]]));
    outline.push([last[0] + width, 0.0]);
    outline
}

/// What the colours mean, at the right.
fn colour_bar(sheet: &mut Sheet, style: &Style, area: Area, bar: &ColourBar) {
    let (ink, left, bottom) =
        (style.colours.ink, area.left + area.width + BEFORE_BAR, area.top + area.height);
    let step = area.height / heat::SHADES as f64;
    for shade in 0..heat::SHADES {
        let y = bottom - step * (shade + 1) as f64;
        // A hair higher than its step, so that no paper is seen between; the first one ends the bar.
        let more = if shade == 0 { 0.0 } else { 0.3 };
        sheet.filled("shade", [left, y], [BAR, step + more], &heat::colour(shade));
    }
    let axis = Axis::linear(0.0, bar.highest);
    let ticks = Chart::y_ticks(&axis, area.height, style);
    for tick in &ticks {
        let Some(place) = axis.place(tick.number).filter(|place| (-0.001..=1.001).contains(place)) else {
            continue;
        };
        let y = bottom - area.height * place;
        sheet.line("tick", [[left + BAR, y], [left + BAR + TICK, y]], Stroke::new(ink, 0.6));
        sheet.words(
            [left + BAR + TICK + 2.0, y + 0.35 * style.small],
            style.small,
            "start",
            ink,
            &tick.words,
        );
    }
    let words = style.widest(ticks.iter().map(|tick| tick.words.as_str()));
    let x = left + BAR + TICK + 2.0 + words + 1.15 * style.text;
    sheet.upward_words([x, area.top + 0.5 * area.height], style.text, ink, &bar.name);
}
