//! The names of what is drawn, in lines over the panels.

use super::curve::Pen;
use super::sheet::{Mark, Sheet, Stroke};
use super::style::Style;

/// Length of a sample, and room after it and after its name, in sizes of the text.
const SAMPLE: f64 = 2.2;
const AFTER_SAMPLE: f64 = 0.45;
const AFTER_NAME: f64 = 1.3;
/// Height of a line of the legend, in sizes of the text.
pub(super) const LINE: f64 = 1.35;

/// What stands beside a name.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sample {
    /// A stroke with its mark.
    Pen(Pen, bool),
    /// A stroke of a colour and a width.
    Stroke(String, f64),
    /// A dot.
    Dot(String, f64),
    /// A filled box, or its border alone.
    Patch(String, bool),
}

/// A name and its sample.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) sample: Sample,
    pub(super) name: String,
}

/// Names laid out in lines.
pub(super) struct Legend {
    lines: Vec<Vec<Entry>>,
}

fn width(style: &Style, name: &str) -> f64 {
    (SAMPLE + AFTER_SAMPLE + AFTER_NAME) * style.text + style.face.width(name, style.text)
}

impl Legend {
    /// Lays names out in lines of a width; a name that is longer than a line is cut.
    pub(super) fn new(style: &Style, entries: &[Entry], room: f64) -> Self {
        let longest = (room - (SAMPLE + AFTER_SAMPLE) * style.text).max(0.0);
        let mut lines: Vec<Vec<Entry>> = Vec::new();
        let mut used = f64::MAX;
        for entry in entries {
            let entry = Entry { name: style.face.fitted(&entry.name, style.text, longest), ..entry.clone() };
            let wide = width(style, &entry.name);
            if used + wide - AFTER_NAME * style.text > room {
                lines.push(Vec::new());
                used = 0.0;
            }
            used += wide;
            if let Some(line) = lines.last_mut() {
                line.push(entry);
            }
        }
        Self { lines }
    }

    /// How high it is, with the room under it.
    pub(super) fn height(&self, style: &Style) -> f64 {
        if self.lines.is_empty() { 0.0 } else { (LINE * self.lines.len() as f64 + 0.25) * style.text }
    }

    /// Draws it from a left upper corner on.
    pub(super) fn draw(&self, sheet: &mut Sheet, style: &Style, [left, top]: [f64; 2]) {
        for (place, line) in self.lines.iter().enumerate() {
            let y = top + LINE * style.text * place as f64 + style.text;
            let mut x = left;
            for entry in line {
                draw_sample(sheet, style, &entry.sample, [x, y - 0.33 * style.text]);
                let words = x + (SAMPLE + AFTER_SAMPLE) * style.text;
                sheet.words([words, y], style.text, "start", style.colours.ink, &entry.name);
                x += width(style, &entry.name);
            }
        }
    }
}

fn draw_sample(sheet: &mut Sheet, style: &Style, sample: &Sample, [x, y]: [f64; 2]) {
    let length = SAMPLE * style.text;
    let middle = [x + 0.5 * length, y];
    match sample {
        Sample::Pen(pen, marked) => {
            sheet.line("sample", [[x, y], [x + length, y]], pen.stroke);
            if let Some(mark) = pen.mark.filter(|_| *marked) {
                sheet.marks("sample", mark, std::iter::once(middle), 3.6, pen.stroke.colour);
            }
        }
        Sample::Stroke(colour, width) => {
            sheet.line("sample", [[x, y], [x + length, y]], Stroke::new(colour, *width));
        }
        Sample::Dot(colour, diameter) => {
            sheet.marks("sample", Mark::Circle, std::iter::once(middle), *diameter, colour);
        }
        Sample::Patch(colour, filled) => {
            let size = [1.4 * style.text, 0.7 * style.text];
            let corner = [middle[0] - 0.5 * size[0], y - 0.5 * size[1]];
            if *filled {
                sheet.filled("sample", corner, size, colour);
            } else {
                sheet.framed("sample", corner, size, Stroke::new(colour, 0.9));
            }
        }
    }
}
