//! The font of figures: how wide its letters are.

use ttf_parser::Face as Parsed;

/// Arimo, as wide as Arial, Helvetica and Liberation Sans, so that an SVG looks alike with any of them.
pub(super) const ARIMO: &[u8] = include_bytes!("font/Arimo-Regular.ttf");
/// Families that are asked for in an SVG.
pub(super) const FAMILIES: &str = "Arimo, Arial, Helvetica, Liberation Sans, sans-serif";
/// How wide a letter is that the font does not have, of its size.
const UNKNOWN: f64 = 0.6;

/// The font.
pub(super) struct Face {
    /// `None` if the font that comes along could not be read: then widths are guessed.
    parsed: Option<Parsed<'static>>,
}

impl Face {
    pub(super) fn new() -> Self {
        Self { parsed: Parsed::parse(ARIMO, 0).ok() }
    }

    /// How wide a text is at a size, both in points; without kerning, which makes it narrower.
    pub(super) fn width(&self, text: &str, size: f64) -> f64 {
        let Some(face) = &self.parsed else { return UNKNOWN * size * text.chars().count() as f64 };
        let per_em = f64::from(face.units_per_em().max(1));
        let advance = |letter| {
            let glyph = face.glyph_index(letter)?;
            face.glyph_hor_advance(glyph).map(|advance| f64::from(advance) / per_em)
        };
        size * text.chars().map(|letter| advance(letter).unwrap_or(UNKNOWN)).sum::<f64>()
    }

    /// A text that is not wider than some room; cut with an ellipsis if it has to be.
    pub(super) fn fitted(&self, text: &str, size: f64, room: f64) -> String {
        if self.width(text, size) <= room {
            return text.to_owned();
        }
        let mut short = String::new();
        for letter in text.chars() {
            if self.width(&short, size)
                + self.width("…", size)
                + self.width(letter.encode_utf8(&mut [0; 4]), size)
                > room
            {
                break;
            }
            short.push(letter);
        }
        short.push('…');
        short
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_arial() {
        let face = Face::new();
        // Advances of Arial, in 2048ths: 0 has 1139, W 1933, i 455.
        assert!((face.width("0", 2048.0) - 1139.0).abs() < 1e-9);
        assert!((face.width("Wi", 2048.0) - 2388.0).abs() < 1e-9);
    }

    #[test]
    fn every_sign_that_figures_write_is_in_the_font() {
        let face = Face::new();
        let parsed = face.parsed.as_ref().unwrap();
        for sign in "0123456789.,·⁰¹²³⁴⁵⁶⁷⁸⁹⁻−–×°…()½aZäöüßéσµχ".chars()
        {
            assert!(parsed.glyph_index(sign).is_some(), "{sign}");
        }
    }

    #[test]
    fn a_long_name_is_cut_to_its_room() {
        let face = Face::new();
        let name = "a-very-long-name-of-an-estimate";
        let short = face.fitted(name, 8.0, 50.0);
        assert!(
            short.ends_with('…') && face.width(&short, 8.0) <= 50.0 && short.chars().count() > 5,
            "{short}"
        );
        assert_eq!(face.fitted(name, 8.0, 500.0), name);
    }
}
