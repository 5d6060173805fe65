//! Paths from above, coloured by how far they are off.

use nalgebra::Vector3;

use super::axis::Axis;
use super::chart::{Area, TEXT, short_name, text_width};
use super::error::Error;
use super::svg::Svg;
use super::view::{Plane, ViewFrom};
use super::{INK, PAPER, QUIET, heat};

/// Most paths in one picture; of more, the first are drawn.
const MOST_PATHS: usize = 12;
/// Most places of one path.
const MOST_PLACES: usize = 3000;
const WIDTH: f64 = 1200.0;
const MARGIN: f64 = 40.0;
const HEAD: f64 = 66.0;
/// Height of a path with its title.
const ROW: f64 = 430.0;
/// Room at the right of a path for its colours.
const COLOURS: f64 = 84.0;

/// A path that is compared with its reference.
#[derive(Clone, Copy, Debug)]
pub struct ComparedPath<'a> {
    /// Name of the estimate.
    pub name: &'a str,
    /// Where the reference's poses are, metres.
    pub reference: &'a [[f64; 3]],
    /// Where the estimate's poses are after its alignment, metres; as many.
    pub estimate: &'a [[f64; 3]],
    /// How far each is off, metres; as many.
    pub error_m: &'a [f64],
}

/// Paths from above, each with its reference in grey, coloured by their errors, with a bar of a round length.
///
/// Returns SVG text; of more than a dozen paths, the first are drawn.
///
/// * `upward` — a unit vector along the axis of `world` that points up; see [`super::upward`].
///
/// # Errors
/// [`Error::Nothing`] when no path has a place with finite coordinates.
pub fn trajectory_figure(
    title: &str,
    paths: &[ComparedPath<'_>],
    upward: Vector3<f64>,
) -> Result<String, Error> {
    let height = HEAD + maps_height(paths.len());
    let mut svg = Svg::new(WIDTH, height, PAPER, &format!("Trajectories of {title} and their errors"));
    svg.words([MARGIN, 36.0], 22.0, "start", INK, title);
    let area = Area { left: MARGIN, top: HEAD, width: WIDTH - 2.0 * MARGIN, height: 0.0 };
    if !draw_maps(&mut svg, area, paths, upward)? {
        return Err(Error::Nothing { name: title.to_owned() });
    }
    Ok(svg.finish())
}

/// How high so many paths are.
pub(super) fn maps_height(paths: usize) -> f64 {
    let paths = paths.min(MOST_PATHS);
    ROW * paths.div_ceil(columns(paths)) as f64
}

fn columns(paths: usize) -> usize {
    match paths {
        0 | 1 => 1,
        2..=4 => 2,
        _ => 3,
    }
}

/// Draws paths from an area's top left corner on; whether there was one.
pub(super) fn draw_maps(
    svg: &mut Svg,
    area: Area,
    paths: &[ComparedPath<'_>],
    upward: Vector3<f64>,
) -> Result<bool, Error> {
    let plane = Plane::new(ViewFrom::TOP, upward)?;
    let columns = columns(paths.len().min(MOST_PATHS));
    let width = area.width / columns as f64;
    let mut drawn = false;
    for (index, path) in paths.iter().take(MOST_PATHS).enumerate() {
        let left = area.left + width * (index % columns) as f64;
        let top = area.top + ROW * (index / columns) as f64;
        let panel = Area { left, top, width: width - 30.0, height: ROW - 30.0 };
        drawn |= draw_map(svg, panel, path, &plane);
    }
    Ok(drawn)
}

/// Draws one path; whether it has a place.
fn draw_map(svg: &mut Svg, panel: Area, path: &ComparedPath<'_>, plane: &Plane) -> bool {
    let every = path.reference.len().max(path.estimate.len()).div_ceil(MOST_PLACES).max(1);
    let flat = |places: &[[f64; 3]]| -> Vec<Option<[f64; 2]>> {
        places.iter().step_by(every).map(|place| plane.place(Vector3::from(*place))).collect()
    };
    let (reference, estimate) = (flat(path.reference), flat(path.estimate));
    let errors: Vec<f64> = path.error_m.iter().step_by(every).copied().collect();
    svg.words([panel.left, panel.top + 18.0], TEXT + 2.0, "start", INK, &short_name(path.name));
    let room = Area {
        top: panel.top + 36.0,
        width: panel.width - COLOURS,
        height: panel.height - 36.0 - 40.0,
        ..panel
    };
    let Some(fit) = Fit::new(reference.iter().chain(&estimate).flatten(), room) else {
        svg.words([panel.left, panel.top + 44.0], TEXT, "start", QUIET, "no pose with finite numbers");
        return false;
    };
    let placed: Vec<[f64; 2]> = reference.iter().flatten().map(|place| fit.place(*place)).collect();
    svg.strokes(std::iter::once(placed.as_slice()), 2.0, QUIET, 0.7);
    let worst = errors.iter().copied().filter(|error| error.is_finite()).fold(0.0, f64::max);
    let unit = LengthUnit::of(worst);
    let colours = Axis::linear(0.0, worst * unit.per_metre);
    let mut strokes: Vec<Vec<[[f64; 2]; 2]>> = vec![Vec::new(); heat::SHADES];
    for (ends, errors) in estimate.windows(2).zip(errors.windows(2)) {
        let [Some(begin), Some(end)] = ends else { continue };
        let error = 0.5 * (errors[0] + errors[1]) * unit.per_metre;
        let shade = colours.place(error).map_or(heat::SHADES - 1, heat::shade);
        strokes[shade].push([fit.place(*begin), fit.place(*end)]);
    }
    for (shade, strokes) in strokes.iter().enumerate() {
        svg.strokes(strokes.iter().map(<[_; 2]>::as_slice), 3.5, &heat::colour(shade), 1.0);
    }
    if let Some(Some(first)) = estimate.first() {
        svg.dots(std::iter::once(fit.place(*first)), 9.0, INK, 1.0);
    }
    bar(svg, panel, &fit);
    scale(svg, panel, &colours, &unit);
    true
}

/// A unit of length for numbers of a size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    /// Its sign, such as `cm`.
    pub name: &'static str,
    /// How many of it are a metre.
    pub per_metre: f64,
}

impl LengthUnit {
    /// The unit in which the largest of some lengths is between 1 and 100 or so.
    #[must_use]
    pub fn of(metres: f64) -> Self {
        match metres {
            m if m >= 1.0 => Self { name: "m", per_metre: 1.0 },
            m if m >= 0.01 => Self { name: "cm", per_metre: 100.0 },
            m if m >= 1e-5 => Self { name: "mm", per_metre: 1000.0 },
            m if m > 0.0 => Self { name: "nm", per_metre: 1e9 },
            _ => Self { name: "cm", per_metre: 100.0 },
        }
    }
}

/// The way from metres of a plane to the picture, the same along both axes.
struct Fit {
    middle: [f64; 2],
    scale: f64,
    centre: [f64; 2],
}

impl Fit {
    fn new<'a>(places: impl Iterator<Item = &'a [f64; 2]>, room: Area) -> Option<Self> {
        let bounds = places.fold(None, |bounds: Option<[[f64; 2]; 2]>, [x, y]| {
            let [low, high] = bounds.unwrap_or([[*x, *y], [*x, *y]]);
            Some([[low[0].min(*x), low[1].min(*y)], [high[0].max(*x), high[1].max(*y)]])
        });
        let [low, high] = bounds?;
        let scale = (room.width / (high[0] - low[0])).min(room.height / (high[1] - low[1]));
        let scale = if scale.is_finite() && scale > 0.0 { scale.min(1e6) } else { 1.0 };
        let centre = [room.left + 0.5 * room.width, room.top + 0.5 * room.height];
        Some(Self { middle: [0, 1].map(|axis| 0.5 * low[axis] + 0.5 * high[axis]), scale, centre })
    }

    fn place(&self, [right, up]: [f64; 2]) -> [f64; 2] {
        let far = |number: f64| if number.is_finite() { number.clamp(-1e4, 1e4) } else { 0.0 };
        [
            far(self.centre[0] + (right - self.middle[0]) * self.scale),
            far(self.centre[1] - (up - self.middle[1]) * self.scale),
        ]
    }
}

/// A bar of a round length, in the lower left corner.
fn bar(svg: &mut Svg, panel: Area, fit: &Fit) {
    let metres = 110.0 / fit.scale;
    let power = libm::pow(10.0, libm::floor(libm::log10(metres)));
    let round = [5.0, 2.0, 1.0].into_iter().find(|part| part * power <= metres).unwrap_or(1.0) * power;
    if !(round.is_finite() && round > 0.0) {
        return;
    }
    let (left, y) = (panel.left, panel.top + panel.height - 8.0);
    let right = left + round * fit.scale;
    svg.strokes(
        std::iter::once(&[[left, y - 6.0], [left, y], [right, y], [right, y - 6.0]][..]),
        2.0,
        INK,
        1.0,
    );
    let words = match round {
        round if !(1e-3..1e5).contains(&round) => format!("{round:e} m"),
        round => {
            let decimals = [1.0, 0.1, 0.01].iter().filter(|power| round < 0.99 * **power).count();
            format!("{round:.decimals$} m")
        }
    };
    svg.words([right + 10.0, y], TEXT, "start", INK, &words);
}

/// What the colours mean, at the right.
fn scale(svg: &mut Svg, panel: Area, colours: &Axis, unit: &LengthUnit) {
    let (top, height) = (panel.top + 44.0, panel.height - 36.0 - 56.0);
    let left = panel.left + panel.width - COLOURS + 24.0;
    let step = height / heat::SHADES as f64;
    for shade in 0..heat::SHADES {
        // A hair higher than its step, so that no paper is seen between.
        let y = top + height - step * (shade + 1) as f64;
        svg.element(&format!(
            "<rect x=\"{left:.1}\" y=\"{y:.1}\" width=\"14\" height=\"{:.1}\" fill=\"{}\"/>",
            step + 0.3,
            heat::colour(shade)
        ));
    }
    for tick in colours.ticks() {
        let Some(place) = colours.place(tick.number) else { continue };
        let y = top + height * (1.0 - place);
        svg.strokes(std::iter::once(&[[left + 14.0, y], [left + 18.0, y]][..]), 1.0, INK, 1.0);
        svg.words([left + 22.0, y + 5.0], TEXT, "start", INK, &tick.words);
    }
    let words = format!("APE, {}", unit.name);
    svg.words([left + 30.0 - 0.5 * text_width(&words, TEXT), top - 14.0], TEXT, "start", INK, &words);
}
