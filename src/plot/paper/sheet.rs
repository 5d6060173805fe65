//! The drawing of a figure as SVG: shapes and words in points, to a hundredth.

use std::fmt::Write as _;

use super::super::svg::escaped;
use super::POINTS_PER_MM;
use super::face::FAMILIES;
use super::theme::Colours;

/// A drawing that grows; all lengths are points.
pub(super) struct Sheet {
    text: String,
    clips: usize,
}

/// What strokes are drawn with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stroke<'a> {
    pub(super) colour: &'a str,
    pub(super) width: f64,
    /// Lengths of dashes and gaps; empty for none.
    pub(super) dashes: &'a str,
}

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Square,
    Triangle,
    Diamond,
    Wedge,
}

impl<'a> Stroke<'a> {
    pub(super) const fn new(colour: &'a str, width: f64) -> Self {
        Self { colour, width, dashes: "" }
    }
}

/// Writes a number with at most two decimals.
fn number(text: &mut String, number: f64) {
    let hundredths = (number * 100.0).round();
    let hundredths = if hundredths.is_finite() { hundredths } else { 0.0 };
    let shown = hundredths / 100.0;
    // Not −0.
    let shown = if shown == 0.0 { 0.0 } else { shown };
    let _ = write!(text, "{shown}");
}

fn numbers(text: &mut String, command: char, all: &[f64]) {
    text.push(command);
    for (place, one) in all.iter().enumerate() {
        if place > 0 {
            text.push(' ');
        }
        number(text, *one);
    }
}

impl Sheet {
    /// An empty drawing on its paper.
    ///
    /// * `size` — width and height.
    /// * `title` — what it shows, for those who cannot see it.
    pub(super) fn new(size: [f64; 2], colours: &Colours, title: &str) -> Self {
        let [width, height] = size;
        let [wide, high] = size.map(|length| length / POINTS_PER_MM);
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide:.2}mm\" height=\"{high:.2}mm\" viewBox=\"0 0 {width:.3} {height:.3}\" \
             font-family=\"{FAMILIES}\" role=\"img\">\n<title>{}</title>\n<rect width=\"{width:.3}\" height=\"{height:.3}\" fill=\"{}\"/>\n",
            escaped(title),
            colours.paper
        );
        Self { text, clips: 0 }
    }

    /// Adds strokes, each through some places; a stroke of one place is passed over.
    ///
    /// * `class` — what the strokes are.
    pub(super) fn strokes<'a>(
        &mut self,
        class: &str,
        strokes: impl Iterator<Item = &'a [[f64; 2]]>,
        stroke: Stroke<'_>,
    ) {
        let mut path = String::new();
        for places in strokes.filter(|places| places.len() > 1) {
            for (index, place) in places.iter().enumerate() {
                numbers(&mut path, if index == 0 { 'M' } else { 'L' }, place);
            }
        }
        if path.is_empty() {
            return;
        }
        let Stroke { colour, width, dashes } = stroke;
        let dashes =
            if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
        let cap = if dashes.is_empty() { "round" } else { "butt" };
        let _ = writeln!(
            self.text,
            "<path class=\"{class}\" d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"{cap}\" \
             stroke-linejoin=\"round\"{dashes}/>"
        );
    }

    /// Adds one straight stroke.
    pub(super) fn line(&mut self, class: &str, ends: [[f64; 2]; 2], stroke: Stroke<'_>) {
        self.strokes(class, std::iter::once(&ends[..]), stroke);
    }

    /// Adds filled marks of a diameter.
    pub(super) fn marks(
        &mut self,
        class: &str,
        mark: Mark,
        places: impl Iterator<Item = [f64; 2]>,
        diameter: f64,
        colour: &str,
    ) {
        let mut path = String::new();
        let half = 0.5 * diameter;
        for [x, y] in places {
            match mark {
                Mark::Circle => {
                    numbers(&mut path, 'M', &[x - half, y]);
                    for end in [diameter, -diameter] {
                        numbers(&mut path, 'a', &[half, half, 0.0, 1.0, 0.0, end, 0.0]);
                    }
                }
                Mark::Square => polygon(
                    &mut path,
                    &[[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]],
                ),
                Mark::Triangle => polygon(
                    &mut path,
                    &[
                        [x, y - 1.15 * half],
                        [x + 1.1 * half, y + 0.8 * half],
                        [x - 1.1 * half, y + 0.8 * half],
                    ],
                ),
                Mark::Wedge => polygon(
                    &mut path,
                    &[
                        [x, y + 1.15 * half],
                        [x + 1.1 * half, y - 0.8 * half],
                        [x - 1.1 * half, y - 0.8 * half],
                    ],
                ),
                Mark::Diamond => polygon(
                    &mut path,
                    &[[x, y - 1.25 * half], [x + 1.25 * half, y], [x, y + 1.25 * half], [x - 1.25 * half, y]],
                ),
            }
        }
        if !path.is_empty() {
            let _ = writeln!(self.text, "<path class=\"{class}\" d=\"{path}\" fill=\"{colour}\"/>");
        }
    }

    /// Adds a ring.
    pub(super) fn ring(&mut self, [x, y]: [f64; 2], radius: f64, stroke: Stroke<'_>) {
        let _ = writeln!(
            self.text,
            "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"/>",
            stroke.colour, stroke.width
        );
    }

    /// Adds a filled box.
    ///
    /// * `corner` — left and top.
    pub(super) fn filled(&mut self, class: &str, [x, y]: [f64; 2], [width, height]: [f64; 2], colour: &str) {
        let mut attributes = String::new();
        for (name, value) in [("x", x), ("y", y), ("width", width), ("height", height)] {
            let _ = write!(attributes, " {name}=\"");
            number(&mut attributes, value);
            attributes.push('"');
        }
        let _ = writeln!(self.text, "<rect class=\"{class}\"{attributes} fill=\"{colour}\"/>");
    }

    /// Adds the border of a box.
    pub(super) fn framed(
        &mut self,
        class: &str,
        [x, y]: [f64; 2],
        [width, height]: [f64; 2],
        stroke: Stroke<'_>,
    ) {
        let corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height], [x, y]];
        self.strokes(class, std::iter::once(&corners[..]), stroke);
    }

    /// Adds a line of text on its base line; `anchor` is `start`, `middle` or `end`.
    pub(super) fn words(&mut self, place: [f64; 2], size: f64, anchor: &str, colour: &str, words: &str) {
        self.turned_words(place, size, anchor, colour, words, "");
    }

    /// Adds a line of text that runs upward, its middle at a place.
    pub(super) fn upward_words(&mut self, place: [f64; 2], size: f64, colour: &str, words: &str) {
        let turned = format!(" transform=\"rotate(-90 {:.2} {:.2})\"", place[0], place[1]);
        self.turned_words(place, size, "middle", colour, words, &turned);
    }

    fn turned_words(
        &mut self,
        [x, y]: [f64; 2],
        size: f64,
        anchor: &str,
        colour: &str,
        words: &str,
        turned: &str,
    ) {
        let _ = writeln!(
            self.text,
            "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\"{turned}>{}</text>",
            escaped(words)
        );
    }

    /// What is drawn from here to [`Sheet::end`] is cut at a box.
    pub(super) fn clip(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        let id = self.clips;
        self.clips += 1;
        let _ = writeln!(
            self.text,
            "<clipPath id=\"clip{id}\"><rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{width:.2}\" height=\"{height:.2}\"/></clipPath>\n\
             <g clip-path=\"url(#clip{id})\">"
        );
    }

    /// What is drawn from here to [`Sheet::end`] is a panel.
    pub(super) fn panel(&mut self, index: usize) {
        let _ = writeln!(self.text, "<g id=\"panel{index}\">");
    }

    /// Ends what [`Sheet::clip`] or [`Sheet::panel`] began.
    pub(super) fn end(&mut self) {
        self.text.push_str("</g>\n");
    }

    /// The whole text.
    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

fn polygon(path: &mut String, corners: &[[f64; 2]]) {
    for (index, corner) in corners.iter().enumerate() {
        numbers(path, if index == 0 { 'M' } else { 'L' }, corner);
    }
    path.push('Z');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_no_more_digits_than_they_need() {
        for (given, written) in
            [(1.0, "1"), (-0.001, "0"), (2.499_9, "2.5"), (-12.346, "-12.35"), (f64::NAN, "0")]
        {
            let mut text = String::new();
            number(&mut text, given);
            assert_eq!(text, written);
        }
    }

    #[test]
    fn a_drawing_says_its_size_in_millimetres_and_in_points() {
        let colours = super::super::Theme::Light.colours();
        let text = Sheet::new([252.0, 72.0], colours, "<a>").finish();
        assert!(
            text.contains("width=\"88.90mm\" height=\"25.40mm\" viewBox=\"0 0 252.000 72.000\""),
            "{text}"
        );
        assert!(text.contains("<title>&lt;a&gt;</title>"));
    }
}
