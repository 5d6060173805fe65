//! A drawing as SVG text: a few shapes, coordinates to a tenth of a unit.

use std::fmt::Write as _;

/// A drawing that grows.
#[derive(Clone, Debug)]
pub(super) struct Svg {
    text: String,
}

/// Text that may stand in XML.
pub(super) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            character if character.is_control() => safe.push('\u{fffd}'),
            character => safe.push(character),
        }
    }
    safe
}

impl Svg {
    /// An empty drawing with a background.
    ///
    /// * `title` — what it shows, for those who cannot see it.
    pub(super) fn new(width: f64, height: f64, background: &str, title: &str) -> Self {
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\">\n<title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" \
             fill=\"{background}\"/>\n",
            escaped(title)
        );
        Self { text }
    }

    /// Adds an element as it is.
    pub(super) fn element(&mut self, element: &str) {
        self.text.push_str(element);
        self.text.push('\n');
    }

    /// Adds dots.
    pub(super) fn dots(
        &mut self,
        dots: impl Iterator<Item = [f64; 2]>,
        diameter: f64,
        colour: &str,
        opacity: f64,
    ) {
        let mut path = String::new();
        for [x, y] in dots {
            let _ = write!(path, "M{x:.1} {y:.1}h0");
        }
        if !path.is_empty() {
            self.element(&format!(
                "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"{diameter}\" stroke-linecap=\"round\" \
                 stroke-opacity=\"{opacity}\" fill=\"none\"/>"
            ));
        }
    }

    /// Adds strokes, each through some places.
    pub(super) fn strokes<'a>(
        &mut self,
        strokes: impl Iterator<Item = &'a [[f64; 2]]>,
        width: f64,
        colour: &str,
        opacity: f64,
    ) {
        let mut path = String::new();
        for stroke in strokes {
            for (index, [x, y]) in stroke.iter().enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
            }
        }
        if !path.is_empty() {
            self.element(&format!(
                "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\" \
                 stroke-linecap=\"round\" stroke-linejoin=\"round\" fill=\"none\"/>"
            ));
        }
    }

    /// Adds strokes with dashes, such as `8 3`; without any where `dashes` is empty.
    pub(super) fn dashed<'a>(
        &mut self,
        strokes: impl Iterator<Item = &'a [[f64; 2]]>,
        width: f64,
        colour: &str,
        dashes: &str,
    ) {
        if dashes.is_empty() {
            return self.strokes(strokes, width, colour, 1.0);
        }
        self.element(&format!("<g stroke-dasharray=\"{dashes}\">"));
        self.strokes(strokes, width, colour, 1.0);
        self.element("</g>");
    }

    /// Adds a line of text; `anchor` is `start`, `middle` or `end`.
    pub(super) fn words(&mut self, [x, y]: [f64; 2], size: f64, anchor: &str, colour: &str, words: &str) {
        self.element(&format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\" {}>{}</text>",
            super::FONT,
            escaped(words)
        ));
    }

    /// The whole text.
    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}
