//! What every panel of a figure is drawn with: its font, its colours, its sizes.

use super::face::Face;
use super::theme::{Colours, Theme};

/// Length of a tick, points.
pub(super) const TICK: f64 = 2.5;

/// What every panel is drawn with.
pub(super) struct Style {
    pub(super) face: Face,
    pub(super) colours: &'static Colours,
    /// Size of names and legends, points.
    pub(super) text: f64,
    /// Size of the numbers at axes, points.
    pub(super) small: f64,
}

/// Room around the inner box of a panel, points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Margins {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

impl Style {
    pub(super) fn new(theme: Theme, font_pt: f64) -> Self {
        Self { face: Face::new(), colours: theme.colours(), text: font_pt, small: 0.875 * font_pt }
    }

    /// How wide the widest of some numbers at an axis is.
    pub(super) fn widest<'a>(&self, words: impl Iterator<Item = &'a str>) -> f64 {
        words.map(|words| self.face.width(words, self.small)).fold(0.0, f64::max)
    }
}

/// A number at an axis as it is printed: with a minus, not a hyphen.
pub(super) fn printed(words: &str) -> String {
    words.replace('-', "−")
}
