//! A panel of bars that stand beside each other by category.

use super::super::axis::Axis;
use super::super::chart::Area;
use super::curve::Role;
use super::legend::{Entry, Sample};
use super::sheet::{Sheet, Stroke};
use super::style::{Margins, Style, TICK};

/// Width of the border of a bar, points.
const BORDER: f64 = 0.9;

/// Bars of one kind, one for each category.
#[derive(Clone, Debug, PartialEq)]
pub struct BarKind {
    /// Name for the legend.
    pub name: String,
    /// What it stands for.
    pub role: Role,
    /// Heights; those that are not finite are left out.
    pub heights: Vec<f64>,
}

/// Bars that stand beside each other by category; the first kind is filled, the others are borders, so that grey prints tell them apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    /// What the categories are.
    pub x_name: String,
    /// The quantity upward, with its unit.
    pub y_name: String,
    /// Names of the categories.
    pub categories: Vec<String>,
    /// The kinds.
    pub kinds: Vec<BarKind>,
}

impl Bars {
    fn axis(&self) -> Axis {
        let heights = self.kinds.iter().flat_map(|kind| kind.heights.iter().copied());
        Axis::from_zero(heights.filter(|height| height.is_finite()).fold(0.0, f64::max))
    }

    fn ticks(&self, height: f64, style: &Style) -> Vec<super::super::axis::Tick> {
        self.axis().ticks_about((height / (1.9 * style.small)).clamp(2.0, 6.0))
    }

    /// Whether there is something to draw.
    pub(super) fn has_bars(&self) -> bool {
        let mut heights = self.kinds.iter().flat_map(|kind| &kind.heights);
        !self.categories.is_empty() && heights.any(|height| height.is_finite() && *height > 0.0)
    }

    pub(super) fn margins(&self, style: &Style, height: f64) -> Margins {
        let ticks = self.ticks(height, style);
        let left = style.widest(ticks.iter().map(|tick| tick.words.as_str())) + TICK + 2.0 + 1.4 * style.text;
        Margins {
            left,
            right: 1.0,
            top: 0.4 * style.small,
            bottom: 2.0 + 1.2 * style.small + 1.35 * style.text,
        }
    }

    pub(super) fn height(&self, style: &Style, cell: f64) -> f64 {
        (0.42 * cell).max(style.face.width(&self.y_name, style.text))
    }

    /// Names of its kinds.
    pub(super) fn entries(&self, style: &Style) -> Vec<Entry> {
        let kinds = self.kinds.iter().enumerate();
        let colour = |kind: &BarKind| kind.role.pen(style.colours).stroke.colour.to_owned();
        kinds
            .map(|(place, kind)| Entry {
                sample: Sample::Patch(colour(kind), place == 0),
                name: kind.name.clone(),
            })
            .collect()
    }

    /// Draws it; see [`super::Chart`] for the arguments.
    pub(super) fn draw(&self, sheet: &mut Sheet, style: &Style, area: Area, left: f64) {
        let (ink, axis) = (style.colours.ink, self.axis());
        let bottom = area.top + area.height;
        for tick in self.ticks(area.height, style) {
            let Some(place) = axis.place(tick.number).filter(|place| (-0.001..=1.001).contains(place)) else {
                continue;
            };
            let y = bottom - area.height * place;
            sheet.line(
                "grid",
                [[area.left, y], [area.left + area.width, y]],
                Stroke::new(style.colours.faint, 0.4),
            );
            sheet.line("tick", [[area.left - TICK, y], [area.left, y]], Stroke::new(ink, 0.6));
            sheet.words(
                [area.left - TICK - 2.0, y + 0.35 * style.small],
                style.small,
                "end",
                ink,
                &tick.words,
            );
        }
        let room = area.width / self.categories.len().max(1) as f64;
        let width = (0.8 * room / self.kinds.len().max(1) as f64).min(22.0);
        let mut free_from = f64::MIN;
        for (place, category) in self.categories.iter().enumerate() {
            let middle = area.left + room * (place as f64 + 0.5);
            let half = 0.5 * style.face.width(category, style.small);
            if middle - half > free_from {
                sheet.words([middle, bottom + 2.0 + style.small], style.small, "middle", ink, category);
                free_from = middle + half + 0.4 * style.small;
            }
            for (index, kind) in self.kinds.iter().enumerate() {
                let height = kind.heights.get(place).filter(|height| **height > 0.0);
                let Some(part) = height.and_then(|height| axis.place(*height)) else { continue };
                let x = middle + width * (index as f64 - 0.5 * self.kinds.len() as f64);
                let colour = kind.role.pen(style.colours).stroke.colour;
                let (high, wide) = (area.height * part, width - 0.8);
                if index == 0 {
                    sheet.filled("bar", [x, bottom - high], [wide, high], colour);
                } else {
                    let inner = [(wide - BORDER).max(0.1), (high - 0.5 * BORDER).max(0.1)];
                    sheet.framed(
                        "bar",
                        [x + 0.5 * BORDER, bottom - inner[1]],
                        inner,
                        Stroke::new(colour, BORDER),
                    );
                }
            }
        }
        let corner = [[area.left, area.top], [area.left, bottom], [area.left + area.width, bottom]];
        sheet.strokes("axis", std::iter::once(&corner[..]), Stroke::new(ink, 0.6));
        let y = bottom + 2.0 + 1.2 * style.small + style.text;
        sheet.words([area.left + 0.5 * area.width, y], style.text, "middle", ink, &self.x_name);
        sheet.upward_words(
            [area.left - left + 0.85 * style.text, area.top + 0.5 * area.height],
            style.text,
            ink,
            &self.y_name,
        );
    }
}
