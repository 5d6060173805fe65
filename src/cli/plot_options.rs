//! Values on the command line of `os plot`: files, widths, frames.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use crate::evaluate::{Alignment, EvaluateOptions, Step};
use crate::plot::ViewFrom;
use crate::plot::paper::{Look, Theme};

/// Narrowest and widest figures, millimetres.
const WIDTHS_MM: Range<f64> = 20.0..1000.0;

/// What to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Figure {
    /// Points, lines by group and the camera's path, from --view.
    Scene,
    /// Points and lines in each frame.
    Features,
    /// Cells of 10 × 10 px of each frame with a feature.
    Cells,
    /// Both of these.
    Statistics,
    /// How many landmarks are shown by so many frames.
    Tracks,
    /// How many landmarks frames share that are so far apart.
    Covisibility,
    /// Paths of estimates and the truth, from above.
    Trajectories,
    /// Coordinates over time.
    Xyz,
    /// Roll, pitch and yaw over time.
    Rpy,
    /// Absolute error of translation along the path, or over time.
    Ape,
    /// Paths coloured by their absolute error.
    ApeMap,
    /// Histograms of relative errors from frame to frame.
    Rpe,
    /// Costs over the steps of optimisers.
    Convergence,
    /// What frames measured, in the border of the image.
    Measurements,
}

impl Figure {
    /// The figure of a name.
    pub(super) fn named(name: &Path) -> Option<Self> {
        Self::from_str(name.to_str()?, false).ok()
    }

    /// Its name.
    pub(super) fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

/// From where a scene or paths are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum View {
    /// From above at an angle.
    Oblique,
    /// From above.
    Top,
    /// From the side.
    Side,
}

impl View {
    pub(super) const fn direction(self) -> ViewFrom {
        match self {
            Self::Oblique => ViewFrom::OBLIQUE,
            Self::Top => ViewFrom::TOP,
            Self::Side => ViewFrom::SIDE,
        }
    }
}

/// What a figure is drawn on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ThemeName {
    /// On white, for print.
    Light,
    /// On near black, for slides.
    Dark,
}

impl From<ThemeName> for Theme {
    fn from(name: ThemeName) -> Self {
        match name {
            ThemeName::Light => Self::Light,
            ThemeName::Dark => Self::Dark,
        }
    }
}

/// What errors are drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Over {
    /// The distance along the true path.
    Path,
    /// Time, or frames where they have no time.
    Time,
}

/// What may be moved to lay an estimate on the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum AlignName {
    /// Nothing.
    None,
    /// The first poses are laid upon each other.
    Origin,
    /// Rotation and translation (Umeyama).
    Se3,
    /// Rotation, translation and scale (Umeyama).
    Sim3,
    /// Scale alone.
    Scale,
}

impl AlignName {
    pub(super) const fn options(self) -> EvaluateOptions {
        let alignment = match self {
            Self::None => Alignment::NONE,
            Self::Origin => Alignment::ORIGIN,
            Self::Se3 => Alignment::SE3,
            Self::Sim3 => Alignment::SIM3,
            Self::Scale => Alignment::SCALE,
        };
        EvaluateOptions { alignment, step: Step::FRAME }
    }
}

/// How a figure is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileFormat {
    Svg,
    Pdf,
    Png,
}

/// A file and the format that its ending asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FigureFile {
    pub(super) path: PathBuf,
    pub(super) format: FileFormat,
}

/// The file of a figure.
pub(super) fn figure_file(text: &str) -> Result<FigureFile, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let format = match ending.as_deref() {
        Some("svg") => FileFormat::Svg,
        Some("pdf") => FileFormat::Pdf,
        Some("png") => FileFormat::Png,
        _ => return Err("expected a name that ends in .svg, .pdf or .png".to_owned()),
    };
    if format != FileFormat::Svg && !cfg!(feature = "figures") {
        return Err(
            "this program was built without PDF and PNG (feature `figures`); .svg is there".to_owned()
        );
    }
    Ok(FigureFile { path, format })
}

/// A width: the name of a preset, or millimetres.
pub(super) fn width_mm(text: &str) -> Result<f64, String> {
    match text {
        "single" => Ok(Look::IEEE_COLUMN_MM),
        "double" => Ok(Look::IEEE_PAGE_MM),
        "lncs" => Ok(Look::LNCS_TEXT_MM),
        _ => millimetres(text)
            .map_err(|wrong| format!("expected single, double, lncs or millimetres; {wrong}")),
    }
}

/// Millimetres, with or without `mm`.
pub(super) fn millimetres(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.strip_suffix("mm").unwrap_or(text).trim().parse().ok();
    number
        .filter(|number| WIDTHS_MM.contains(number))
        .ok_or_else(|| format!("expected millimetres from {} to {}", WIDTHS_MM.start, WIDTHS_MM.end))
}

/// A size of letters.
pub(super) fn font_pt(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|size| (3.0..=40.0).contains(size))
        .ok_or_else(|| "expected points from 3 to 40".to_owned())
}

/// Dots per inch.
pub(super) fn dots_per_inch(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|dots| (20.0..=2400.0).contains(dots))
        .ok_or_else(|| "expected 20 to 2400 dots per inch".to_owned())
}

/// Frames by their ids: `0,10,100..105` are the frames 0 and 10, and those from 100 up to but without 105.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct FrameIds(pub(super) Vec<Range<i64>>);

pub(super) fn frame_ids(text: &str) -> Result<FrameIds, String> {
    let wrong = |part: &str| {
        format!("expected ids of frames and ranges A..B with A below B, as 0,10,100..105, found {part:?}")
    };
    let range = |part: &str| -> Result<Range<i64>, String> {
        let number = |text: &str| text.trim().parse::<i64>().map_err(|_| wrong(part));
        let range = if let Some((first, last)) = part.split_once("..") {
            number(first)?..number(last)?
        } else {
            let id = number(part)?;
            id..id.checked_add(1).ok_or_else(|| wrong(part))?
        };
        if range.is_empty() { Err(wrong(part)) } else { Ok(range) }
    };
    Ok(FrameIds(text.split(',').map(range).collect::<Result<_, _>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_ids_and_ranges() {
        assert_eq!(frame_ids("0,10, 100..105").unwrap().0, [0..1, 10..11, 100..105]);
        assert_eq!(frame_ids("-3,4").unwrap().0, [-3..-2, 4..5]);
        for wrong in ["", "a", "5..5", "7..3", "1,,2", "1..", "9223372036854775807"] {
            assert!(frame_ids(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn widths_are_presets_or_millimetres() {
        assert_eq!(width_mm("single"), Ok(88.9));
        assert_eq!(width_mm("double"), Ok(182.0));
        assert_eq!(width_mm("120mm"), Ok(120.0));
        assert_eq!(width_mm("84"), Ok(84.0));
        assert!(["triple", "5", "NaN", "-90", "1e9"].iter().all(|wrong| width_mm(wrong).is_err()));
    }

    #[test]
    fn endings_say_the_format() {
        assert_eq!(figure_file("a/b.SVG").unwrap().format, FileFormat::Svg);
        assert!(figure_file("a.eps").is_err() && figure_file("pdf").is_err());
    }
}
