//! Colours of figures: on white for print, on dark for slides.

/// What a figure is drawn on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// On white.
    #[default]
    Light,
    /// On near black.
    Dark,
}

/// The colours of a theme.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Colours {
    /// Behind everything.
    pub(super) paper: &'static str,
    /// Text, axes, the camera's path.
    pub(super) ink: &'static str,
    /// What is there without meaning much: the truth under an estimate, lines of no group.
    pub(super) quiet: &'static str,
    /// Grids and edges of objects.
    pub(super) faint: &'static str,
    /// Points.
    pub(super) points: &'static str,
    /// Lines.
    pub(super) lines: &'static str,
    /// Estimates and groups: Okabe and Ito (2008), without the green of points and what the paper's colour hides. Each is at
    /// another lightness than its neighbours, so that grey prints tell them apart.
    pub(super) series: [&'static str; 5],
}

const LIGHT: Colours = Colours {
    paper: "#ffffff",
    ink: "#000000",
    quiet: "#8c8c8c",
    faint: "#dadde0",
    points: "#009e73",
    lines: "#d55e00",
    series: ["#0072b2", "#e69f00", "#d55e00", "#56b4e9", "#cc79a7"],
};

const DARK: Colours = Colours {
    paper: "#121416",
    ink: "#f2f2f2",
    quiet: "#9a9fa5",
    faint: "#3b4147",
    points: "#1fc997",
    lines: "#ff8a3d",
    series: ["#56b4e9", "#f0e442", "#ff8a3d", "#3a6fe0", "#e495c3"],
};

impl Theme {
    pub(super) const fn colours(self) -> &'static Colours {
        match self {
            Self::Light => &LIGHT,
            Self::Dark => &DARK,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lightness from 0 to 1 (ITU-R BT.709, without gamma).
    fn lightness(colour: &str) -> f64 {
        let channel = |at: usize| {
            let part = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap()) / 255.0;
            part.powf(2.2)
        };
        0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
    }

    #[test]
    fn what_is_drawn_stands_out_from_the_paper_and_neighbours_differ_in_grey() {
        for colours in [&LIGHT, &DARK] {
            let paper = lightness(colours.paper);
            for colour in colours.series.iter().chain([&colours.points, &colours.lines, &colours.quiet]) {
                let (light, dark) = (lightness(colour).max(paper), lightness(colour).min(paper));
                // WCAG asks for a contrast of 3 of what is not text; orange on white is under it and has dashes and marks.
                assert!((light + 0.05) / (dark + 0.05) > 2.0, "{colour}");
            }
            for pair in colours.series.windows(2) {
                assert!((lightness(pair[0]) - lightness(pair[1])).abs() > 0.08, "{pair:?}");
            }
        }
    }
}
