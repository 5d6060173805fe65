//! A panel with what a frame shows: points, and segments in the colours of their groups, in the image's border.

use std::collections::BTreeMap;

use super::super::chart::Area;
use super::super::scene_shapes::ranked;
use super::legend::{Entry, Sample};
use super::scene_view::NAMED;
use super::sheet::{Mark, Sheet, Stroke};
use super::style::Style;
use super::theme::Colours;
use crate::structure::{Camera, FrameBundle, LineId, StructuralGroup, registry};

/// Diameter of a point and width of a segment, points.
const DOT: f64 = 1.8;
const SEGMENT: f64 = 1.0;

/// A line segment in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Start and end, pixels from the outer corner of the top-left pixel.
    pub ends: [[f64; 2]; 2],
    /// Rank of its group among those of the sequence; `None` of a line in no group.
    pub group: Option<usize>,
}

/// What a frame shows.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasurementImage {
    /// Width and height of the image, pixels.
    pub size: [f64; 2],
    /// Points, pixels from the outer corner of the top-left pixel.
    pub points: Vec<[f64; 2]>,
    /// Segments.
    pub segments: Vec<Segment>,
    /// Names of the sequence's groups of lines, by rank.
    pub groups: Vec<String>,
}

/// The groups of a sequence, the largest first: their ranks give the same colours as in a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RankedGroups {
    rank_of: BTreeMap<LineId, usize>,
    names: Vec<String>,
}

impl RankedGroups {
    /// Ranks the groups of a sequence.
    #[must_use]
    pub fn of(groups: &[StructuralGroup]) -> Self {
        let (largest, rank_of) = ranked(groups);
        let of_lines = largest.iter().filter(|group| !group.line_ids.is_empty());
        Self { rank_of, names: of_lines.map(|group| group.group_id.to_string()).collect() }
    }
}

/// The colour of a group: the colours of the theme, round by round darker.
pub(super) fn group_colour(colours: &Colours, group: Option<usize>) -> String {
    const DARKER: [f64; 3] = [1.0, 0.62, 0.38];
    let Some(group) = group else { return colours.quiet.to_owned() };
    let colour = colours.series[group % colours.series.len()];
    let shade = DARKER[group / colours.series.len() % DARKER.len()];
    if shade == 1.0 { colour.to_owned() } else { darker(colour, shade) }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a byte")]
fn darker(colour: &str, part: f64) -> String {
    let channel =
        |at: usize| colour.get(at..at + 2).and_then(|hex| u8::from_str_radix(hex, 16).ok()).unwrap_or(0);
    let dark = |at: usize| (f64::from(channel(at)) * part).round() as u8;
    format!("#{:02x}{:02x}{:02x}", dark(1), dark(3), dark(5))
}

impl MeasurementImage {
    /// What a frame measured, or its observations if it has no measurement.
    ///
    /// * `groups` — those of the sequence.
    #[must_use]
    pub fn of(camera: &Camera, frame: &FrameBundle, groups: &RankedGroups) -> Self {
        let corner = if camera.pixel_origin == registry::PIXEL_CENTER { 0.5 } else { 0.0 };
        let pixel = |u: f64, v: f64| [u + corner, v + corner];
        macro_rules! image {
            ($points:expr, $lines:expr) => {
                Self {
                    size: [f64::from(camera.width), f64::from(camera.height)],
                    points: $points.iter().map(|row| pixel(row.u, row.v)).collect(),
                    segments: $lines
                        .iter()
                        .map(|row| Segment {
                            ends: [pixel(row.start_u, row.start_v), pixel(row.end_u, row.end_v)],
                            group: groups.rank_of.get(&row.line_id).copied(),
                        })
                        .collect(),
                    groups: groups.names.clone(),
                }
            };
        }
        if frame.point_measurements.is_empty() && frame.line_measurements.is_empty() {
            image!(frame.point_observations, frame.line_observations)
        } else {
            image!(frame.point_measurements, frame.line_measurements)
        }
    }

    /// Height over width.
    pub(super) fn aspect(&self) -> f64 {
        let aspect = self.size[1] / self.size[0];
        if aspect.is_finite() && aspect > 0.0 { aspect.clamp(0.05, 20.0) } else { 0.75 }
    }

    /// What its colours mean.
    pub(super) fn entries(&self, style: &Style) -> Vec<Entry> {
        let mut entries = Vec::new();
        if !self.points.is_empty() {
            entries.push(Entry {
                sample: Sample::Dot(style.colours.points.to_owned(), 1.6 * DOT),
                name: "points".to_owned(),
            });
        }
        let stroke = |group, name: &str| Entry {
            sample: Sample::Stroke(group_colour(style.colours, group), 1.4 * SEGMENT),
            name: name.to_owned(),
        };
        if self.segments.iter().any(|segment| segment.group.is_some()) {
            // All of the sequence, so that the frames of a figure have one legend.
            let named = self.groups.iter().enumerate().take(NAMED);
            entries.extend(named.map(|(rank, name)| stroke(Some(rank), name)));
            if self.groups.len() > NAMED {
                entries.push(stroke(Some(NAMED), &format!("{} more", self.groups.len() - NAMED)));
            }
            if self.segments.iter().any(|segment| segment.group.is_none()) {
                entries.push(stroke(None, "no group"));
            }
        } else if !self.segments.is_empty() {
            entries.push(stroke(None, "lines"));
        }
        entries
    }

    /// Draws it in the middle of an area.
    pub(super) fn draw(&self, sheet: &mut Sheet, style: &Style, area: Area) {
        let scale = (area.width / self.size[0]).min(area.height / self.size[1]);
        let size = self.size.map(|length| length * scale);
        let corner = [area.left + 0.5 * (area.width - size[0]), area.top + 0.5 * (area.height - size[1])];
        let place = |[u, v]: [f64; 2]| [corner[0] + u * scale, corner[1] + v * scale];
        // What lies far outside is not drawn, for its numbers would be huge.
        let near = |pixel: &[f64; 2]| {
            pixel.iter().zip(self.size).all(|(number, size)| (-size..=2.0 * size).contains(number))
        };
        sheet.clip(corner, size);
        let mut groups: Vec<Option<usize>> = self.segments.iter().map(|segment| segment.group).collect();
        groups.sort_unstable();
        groups.dedup();
        for group in groups {
            let segments = self
                .segments
                .iter()
                .filter(|segment| segment.group == group && segment.ends.iter().all(near));
            let strokes: Vec<[[f64; 2]; 2]> = segments.map(|segment| segment.ends.map(place)).collect();
            let colour = group_colour(style.colours, group);
            sheet.strokes("segments", strokes.iter().map(<[_; 2]>::as_slice), Stroke::new(&colour, SEGMENT));
        }
        let points = self.points.iter().filter(|pixel| near(pixel)).map(|pixel| place(*pixel));
        sheet.marks("points", Mark::Circle, points, DOT, style.colours.points);
        sheet.end();
        sheet.framed("border", corner, size, Stroke::new(style.colours.ink, 0.6));
    }
}

#[cfg(test)]
mod tests {
    use super::super::Theme;
    use super::*;

    #[test]
    fn fifteen_groups_have_colours_of_their_own() {
        for theme in [Theme::Light, Theme::Dark] {
            let colours: Vec<String> =
                (0..15).map(|group| group_colour(theme.colours(), Some(group))).collect();
            assert!((0..15).all(|place| !colours[..place].contains(&colours[place])), "{colours:?}");
            assert!(!colours.contains(&theme.colours().points.to_owned()));
        }
        assert_eq!(darker("#ff8040", 0.5), "#804020");
    }
}
