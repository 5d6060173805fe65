//! A panel with a scene: points, lines in the colours of their groups, the path of the camera, seen with parallel rays.

use std::collections::BTreeMap;

use super::super::chart::Area;
use super::super::scene_shapes::{Fit, Shapes, metres_in_words, ranked, round_length};
use super::super::view::{Plane, ViewFrom, upward};
use super::super::{Error, Scene};
use super::legend::{Entry, Sample};
use super::measurement_image::group_colour;
use super::sheet::{Mark, Sheet, Stroke};
use super::style::Style;
use crate::structure::LineId;

/// Most points that are drawn: more hide each other in a column.
const MOST_DOTS: usize = 6000;
/// Groups that the legend names.
pub(super) const NAMED: usize = 15;
/// Free around the scene, points.
const MARGIN: f64 = 6.0;
/// Length of an axis, points.
const AXIS: f64 = 13.0;

/// A scene as it is seen from somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneView {
    shapes: Shapes,
    rank_of: BTreeMap<LineId, usize>,
    /// Names of the groups, the largest first.
    groups: Vec<String>,
}

impl SceneView {
    /// Looks at a scene.
    ///
    /// # Errors
    /// [`Error::View`] for angles that are none, [`Error::Nothing`] without a landmark or a true pose that has a place.
    pub fn new(scene: &Scene<'_>, view: ViewFrom) -> Result<Self, Error> {
        let plane = Plane::new(view, upward(&scene.manifest.cameras, scene.frames))?;
        let shapes = Shapes::of(scene, &plane);
        if shapes.bounds().is_none() {
            return Err(Error::Nothing { name: scene.manifest.name.clone() });
        }
        let (largest, rank_of) = ranked(scene.groups);
        let groups = largest.iter().map(|group| group.group_id.to_string()).collect();
        Ok(Self { shapes, rank_of, groups })
    }

    pub(super) fn has_places(&self) -> bool {
        self.shapes.bounds().is_some()
    }

    /// Height over width.
    pub(super) fn aspect(&self) -> f64 {
        let Some([low, high]) = self.shapes.bounds() else { return 0.6 };
        let aspect = (high[1] - low[1]) / (high[0] - low[0]);
        if aspect.is_finite() { (1.05 * aspect).clamp(0.35, 1.05) } else { 0.6 }
    }

    /// Names of its groups and of what else has a colour.
    pub(super) fn entries(&self, style: &Style) -> Vec<Entry> {
        let mut entries = Vec::new();
        if !self.shapes.dots.is_empty() {
            entries.push(Entry {
                sample: Sample::Dot(style.colours.points.to_owned(), 2.4),
                name: "points".to_owned(),
            });
        }
        let drawn =
            |rank: usize| self.shapes.lines.iter().any(|(line, _)| self.rank_of.get(line) == Some(&rank));
        let named = self.groups.iter().enumerate().take(NAMED).filter(|(rank, _)| drawn(*rank));
        entries.extend(named.map(|(rank, name)| Entry {
            sample: Sample::Stroke(group_colour(style.colours, Some(rank)), 1.4),
            name: name.clone(),
        }));
        let more = (NAMED..self.groups.len()).filter(|rank| drawn(*rank)).count();
        if more > 0 {
            // Their colours are those of groups that are named.
            entries.push(Entry {
                sample: Sample::Stroke(group_colour(style.colours, Some(NAMED)), 1.4),
                name: format!("{more} more"),
            });
        }
        if self.shapes.lines.iter().any(|(line, _)| !self.rank_of.contains_key(line)) {
            entries.push(Entry {
                sample: Sample::Stroke(style.colours.quiet.to_owned(), 1.4),
                name: "no group".to_owned(),
            });
        }
        if !self.shapes.path.is_empty() {
            entries.push(Entry {
                sample: Sample::Stroke(style.colours.ink.to_owned(), 0.8),
                name: "camera".to_owned(),
            });
        }
        entries
    }

    /// Draws it in an area.
    pub(super) fn draw(&self, sheet: &mut Sheet, style: &Style, area: Area) {
        let room = Area {
            left: area.left + MARGIN,
            top: area.top + MARGIN,
            width: (area.width - 2.0 * MARGIN).max(1.0),
            height: (area.height - 2.0 * MARGIN - 0.8 * style.small).max(1.0),
        };
        let Some(fit) = Fit::new(&self.shapes, room) else { return };
        let (shapes, colours) = (&self.shapes, style.colours);
        sheet.clip([area.left, area.top], [area.width, area.height]);
        let edges: Vec<[[f64; 2]; 2]> = shapes
            .edges
            .iter()
            .filter_map(|[start, end]| Some([fit.place(*start)?, fit.place(*end)?]))
            .collect();
        sheet.strokes("edges", edges.iter().map(<[_; 2]>::as_slice), Stroke::new(colours.faint, 0.4));
        let every = shapes.dots.len().div_ceil(MOST_DOTS).max(1);
        let dots = shapes.dots.iter().step_by(every).filter_map(|dot| fit.place(*dot));
        // Fewer points may be larger.
        let diameter = (2.4 - 0.4 * libm::log10(shapes.dots.len().max(1) as f64)).clamp(0.8, 1.8);
        sheet.marks("points", Mark::Circle, dots, diameter, colours.points);
        let mut strokes: BTreeMap<Option<usize>, Vec<[[f64; 2]; 2]>> = BTreeMap::new();
        for (line, [start, end]) in &shapes.lines {
            let Some(stroke) = fit.place(*start).zip(fit.place(*end)) else { continue };
            strokes.entry(self.rank_of.get(line).copied()).or_default().push(stroke.into());
        }
        for (rank, strokes) in strokes {
            let colour = group_colour(colours, rank);
            sheet.strokes("lines", strokes.iter().map(<[_; 2]>::as_slice), Stroke::new(&colour, 0.9));
        }
        let path: Vec<[f64; 2]> = shapes.path.iter().filter_map(|place| fit.place(*place)).collect();
        sheet.strokes("path", std::iter::once(path.as_slice()), Stroke::new(colours.ink, 0.7));
        let cameras = shapes.camera_strokes(&fit, [4.0, 11.0]);
        sheet.strokes("cameras", cameras.iter().map(Vec::as_slice), Stroke::new(colours.ink, 0.4));
        if let (Some(first), Some(last)) = (path.first(), path.last()) {
            sheet.ring(*last, 2.2, Stroke::new(colours.ink, 0.7));
            sheet.marks("begin", Mark::Circle, std::iter::once(*first), 2.8, colours.ink);
        }
        sheet.end();
        self.axes(sheet, style, area);
        scale(sheet, style, area, &fit);
    }

    /// The axes of the world, in the lower left corner.
    fn axes(&self, sheet: &mut Sheet, style: &Style, area: Area) {
        let ways = self.shapes.axes.map(|[right, up]| [AXIS * right, -AXIS * up]);
        let least = |axis: usize| ways.iter().map(|way| way[axis]).fold(0.0, f64::min);
        let most = |axis: usize| ways.iter().map(|way| way[axis]).fold(0.0, f64::max);
        let room = 0.7 * style.small;
        let origin = [area.left + room - least(0) + 1.0, area.top + area.height - room - most(1) - 1.0];
        for (name, [right, down]) in ["x", "y", "z"].iter().zip(ways) {
            let length = libm::hypot(right, down);
            // An axis that points at the viewer has no length and no name.
            if length < 0.1 * AXIS {
                continue;
            }
            sheet.line(
                "world",
                [origin, [origin[0] + right, origin[1] + down]],
                Stroke::new(style.colours.ink, 0.8),
            );
            let beyond = 1.0 + 0.55 * style.small / length;
            let place = [origin[0] + beyond * right, origin[1] + beyond * down + 0.3 * style.small];
            sheet.words(place, style.small, "middle", style.colours.ink, name);
        }
    }
}

/// A bar of a round length, in the lower right corner.
fn scale(sheet: &mut Sheet, style: &Style, area: Area, fit: &Fit) {
    let Some(round) = round_length(0.2 * area.width / fit.scale) else { return };
    let (right, y) = (area.left + area.width - 2.0, area.top + area.height - 2.5);
    let left = right - round * fit.scale;
    let bar = [[left, y - 2.0], [left, y], [right, y], [right, y - 2.0]];
    sheet.strokes("scale", std::iter::once(&bar[..]), Stroke::new(style.colours.ink, 0.8));
    sheet.words(
        [0.5 * (left + right), y - 3.0],
        style.small,
        "middle",
        style.colours.ink,
        &metres_in_words(round),
    );
}
