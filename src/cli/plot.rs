//! `os plot`: a figure for a paper, of sequences and their estimates.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::ValueEnum as _;
use clap::error::ErrorKind;
use nalgebra::Point3;

use super::plot_options::{
    AlignName, Figure, FigureFile, FileFormat, FrameIds, Over, ThemeName, View, dots_per_inch, figure_file,
    font_pt, frame_ids, millimetres, width_mm,
};
use super::{Outcome, evaluate_output, inputs, misused, parsed, plot_compared, plot_figures, text};
use crate::format::Partial;
use crate::plot::ViewFrom;
use crate::plot::paper::{Look, PaperFigure};
use crate::simulate::{self, Recipe};
use crate::storage;
use crate::structure::Manifest;

/// Draw a figure for a paper, as SVG, PDF or PNG: scenes, measurements, statistics, trajectories, errors, convergence.
///
/// Figures have the width of a column, letters of 8 pt, no title (a paper has a caption) and colours that people with any kind of
/// sight tell apart; dashes and marks tell curves apart in grey. Several sequences make several panels. PDF and PNG have the font
/// with them; an SVG asks for Arimo, Arial, Helvetica or Liberation Sans, which are equally wide.
#[derive(clap::Args, Debug)]
#[command(after_help = "Figures:
  scene          points, lines by group and the camera's path; --view, --azimuth, --elevation
  measurements   what frames measured; --frames 0,10,100..105
  features       points and lines in each frame
  cells          occupied and covered cells in each frame
  statistics     features and cells
  tracks         landmarks by the number of frames that show them
  covisibility   landmarks that frames share, by how far the frames are apart
  trajectories   paths of the estimates and the truth from above; --view
  xyz, rpy       coordinates, or roll, pitch and yaw, over time
  ape            absolute error of translation along the path; --over time
  ape-map        paths coloured by their absolute error
  rpe            histograms of relative errors from frame to frame
  convergence    costs over the steps of optimisers

Examples:
  os plot box1.mcap -o box1.svg
  os plot scene box1 corridor1 --width double -o scenes.pdf
  os plot measurements box1 --frames 0,100,200..202 -o frames.pdf
  os plot ape adjusted.mcap --align sim3 -o ape.pdf
  os plot trajectories adjusted.mcap --width 60 --dpi 600 -o paths.png

Exit codes: 0 done, 1 failed, 2 misused, 3 done, but an estimate could not be compared.")]
pub(super) struct Args {
    /// What to draw (a scene if no figure is named), then sequences: MCAP files or Parquet folders; for convergence also folders
    /// of `os benchmark`.
    #[arg(required = true, value_name = "[FIGURE] INPUT")]
    inputs: Vec<PathBuf>,
    /// Output: a file that ends in .svg, .pdf or .png.
    #[arg(short, long, value_name = "FILE", value_parser = figure_file)]
    output: FigureFile,
    /// What to draw, in place of a figure before the inputs.
    #[arg(long, value_enum, hide_possible_values = true)]
    figure: Option<Figure>,
    /// Width: `single` (a column of the IEEE, 88.9 mm), `double` (its page, 182 mm), `lncs` (122 mm), or millimetres.
    #[arg(long, value_name = "WIDTH", default_value = "single", value_parser = width_mm)]
    width: f64,
    /// Height, millimetres [default: what suits the figure].
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    height: Option<f64>,
    /// Panels side by side [default: what suits the width]; not for xyz and rpy.
    #[arg(long, value_name = "N", value_parser = parsed::at_least_one)]
    columns: Option<usize>,
    /// Size of letters, points.
    #[arg(long, value_name = "PT", default_value = "8", value_parser = font_pt)]
    font_size: f64,
    /// Dots per inch of a PNG [default: 600].
    #[arg(long, value_name = "DPI", value_parser = dots_per_inch)]
    dpi: Option<f64>,
    /// What it is drawn on.
    #[arg(long, value_enum, default_value_t = ThemeName::Light)]
    theme: ThemeName,
    /// From where a scene or paths are looked at [default: oblique for scenes, top for paths].
    #[arg(long, value_enum)]
    view: Option<View>,
    /// Angle about the upward axis, degrees; in place of that of the view.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    azimuth: Option<f64>,
    /// Angle over the horizon, degrees from -90 to 90; in place of that of the view.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    elevation: Option<f64>,
    /// Frames whose measurements are drawn: ids, and ranges A..B up to but without B [default: four over the sequence].
    #[arg(long, value_name = "IDS", allow_hyphen_values = true, value_parser = frame_ids)]
    frames: Option<FrameIds>,
    /// Draw only this estimate; may be given several times.
    #[arg(long, value_name = "NAME")]
    estimate: Vec<String>,
    /// What may be moved to lay estimates on the truth [default: se3].
    #[arg(long, value_enum, value_name = "KIND")]
    align: Option<AlignName>,
    /// What absolute errors are drawn over [default: path].
    #[arg(long, value_enum)]
    over: Option<Over>,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

/// Dots per inch of a PNG.
#[cfg(feature = "figures")]
const DPI: f64 = 600.0;

/// What a figure is made of: inputs, and what was asked for.
pub(super) struct Wanted<'a> {
    pub(super) figure: Figure,
    pub(super) inputs: &'a [PathBuf],
    pub(super) columns: Option<usize>,
    /// Whether the figure is as wide as more than a column.
    pub(super) wide: bool,
    pub(super) frames: Option<&'a FrameIds>,
    pub(super) estimates: &'a [String],
    pub(super) align: AlignName,
    pub(super) over: Over,
    view: Option<View>,
    azimuth: Option<f64>,
    elevation: Option<f64>,
}

impl Wanted<'_> {
    /// From where is looked, if nobody says so from `otherwise`.
    pub(super) fn view(&self, otherwise: View) -> ViewFrom {
        let named = self.view.unwrap_or(otherwise).direction();
        ViewFrom {
            azimuth_degrees: self.azimuth.unwrap_or(named.azimuth_degrees),
            elevation_degrees: self.elevation.unwrap_or(named.elevation_degrees),
        }
    }

    /// How many panels stand side by side.
    ///
    /// * `narrow`, `wide` — in a column, and over a page.
    pub(super) fn columns(&self, panels: usize, narrow: usize, wide: usize) -> usize {
        self.columns.unwrap_or(if self.wide { wide } else { narrow }).min(panels).max(1)
    }
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let (figure, inputs) = args.figure();
    let FigureFile { path: output, format } = &args.output;
    args.refuse_idle(figure, *format);
    evaluate_output::refuse_input(output, inputs)?;
    let inputs = &inputs::sequences(inputs)?;
    // Reserved before the work begins.
    let partial = Partial::file(output, args.force)?;
    let wanted = Wanted {
        figure,
        inputs,
        columns: args.columns,
        wide: args.width > 110.0,
        frames: args.frames.as_ref(),
        estimates: &args.estimate,
        align: args.align.unwrap_or(AlignName::Se3),
        over: args.over.unwrap_or(Over::Path),
        view: args.view,
        azimuth: args.azimuth,
        elevation: args.elevation,
    };
    let (drawn, outcome) = draw(&wanted)?;
    let look = Look {
        width_mm: args.width,
        height_mm: args.height,
        font_pt: args.font_size,
        theme: args.theme.into(),
    };
    let svg = drawn.svg(&look)?;
    let bytes = match format {
        FileFormat::Svg => svg.into_bytes(),
        #[cfg(feature = "figures")]
        FileFormat::Pdf => crate::plot::paper::pdf(&svg, &drawn.title)?,
        #[cfg(feature = "figures")]
        FileFormat::Png => crate::plot::paper::png(&svg, args.dpi.unwrap_or(DPI))?,
        #[cfg(not(feature = "figures"))]
        FileFormat::Pdf | FileFormat::Png => {
            anyhow::bail!("{}: built without the feature `figures`", output.display())
        }
    };
    fs::write(partial.path(), &bytes).with_context(|| output.display().to_string())?;
    partial.finish()?;
    writeln!(stdout, "{}: {}", output.display(), text::bytes(bytes.len() as u64))?;
    Ok(outcome)
}

fn draw(wanted: &Wanted<'_>) -> anyhow::Result<(PaperFigure, Outcome)> {
    let mut problems = Vec::new();
    let figure = match wanted.figure {
        Figure::Scene => plot_figures::scene(wanted)?,
        Figure::Features | Figure::Cells | Figure::Statistics | Figure::Tracks | Figure::Covisibility => {
            plot_figures::statistics(wanted)?
        }
        Figure::Convergence => plot_figures::convergence(wanted)?,
        Figure::Measurements => plot_figures::measurements(wanted)?,
        Figure::Trajectories | Figure::Xyz | Figure::Rpy | Figure::Ape | Figure::ApeMap | Figure::Rpe => {
            plot_compared::figure(wanted, &mut problems)?
        }
    };
    let mut stderr = io::stderr();
    for problem in &problems {
        writeln!(stderr, "warning: {problem}")?;
    }
    Ok((figure, if problems.is_empty() { Outcome::Done } else { Outcome::Findings }))
}

impl Args {
    /// Refuses options that change nothing about a figure.
    fn refuse_idle(&self, figure: Figure, format: FileFormat) {
        use Figure as F;
        let of_estimates = matches!(figure, F::Trajectories | F::Xyz | F::Rpy | F::Ape | F::ApeMap | F::Rpe);
        let is_seen = matches!(figure, F::Scene | F::Trajectories | F::ApeMap);
        let options = [
            ("--frames", self.frames.is_some(), figure == F::Measurements),
            ("--estimate", !self.estimate.is_empty(), of_estimates || figure == F::Convergence),
            ("--align", self.align.is_some(), of_estimates),
            ("--over", self.over.is_some(), figure == F::Ape),
            ("--view", self.view.is_some(), is_seen),
            ("--azimuth", self.azimuth.is_some(), is_seen),
            ("--elevation", self.elevation.is_some(), is_seen),
            ("--columns", self.columns.is_some(), !matches!(figure, F::Xyz | F::Rpy)),
        ];
        for (option, is_given, has_effect) in options {
            if is_given && !has_effect {
                let words = format!("{option} does not go with the figure {}", figure.name());
                misused("plot", ErrorKind::ArgumentConflict, &words);
            }
        }
        if self.dpi.is_some() && format != FileFormat::Png {
            misused("plot", ErrorKind::ArgumentConflict, "--dpi goes with a file that ends in .png");
        }
    }

    /// The figure and its inputs: the first of several arguments is a figure if it is the name of one.
    fn figure(&self) -> (Figure, &[PathBuf]) {
        let named = self.inputs.first().and_then(|first| Figure::named(first));
        match (self.figure, named, self.inputs.as_slice()) {
            (Some(figure), _, inputs) => (figure, inputs),
            (None, Some(figure), [_, inputs @ ..]) if !inputs.is_empty() => (figure, inputs),
            (None, Some(figure), [first]) if !storage::exists(first) => {
                let words = format!("{}: expected a sequence after the figure's name", figure.name());
                misused("plot", ErrorKind::MissingRequiredArgument, &words)
            }
            (None, None, [first, _, ..]) if !storage::exists(first) && first.extension().is_none() => {
                let known = Figure::value_variants().iter().map(|figure| figure.name()).collect::<Vec<_>>();
                let words = format!(
                    "{}: neither a figure nor a sequence; figures are {}",
                    first.display(),
                    known.join(", ")
                );
                misused("plot", ErrorKind::InvalidValue, &words)
            }
            (None, _, inputs) => (Figure::Scene, inputs),
        }
    }
}

/// The name of an input, for a caption: that of its file or folder.
pub(super) fn caption(path: &Path) -> String {
    super::evaluate::name_of(path)
}

/// Edges of a simulated scene, made again from the recipe in the manifest; none where that cannot be done, as
/// with a mesh that is not here.
pub(super) fn edges(manifest: &Manifest) -> Vec<[Point3<f64>; 2]> {
    let recipe = manifest.generator.parameters.get("recipe");
    let recipe: Option<Recipe> = recipe.and_then(|text| serde_json::from_str(text).ok());
    let scene = recipe.and_then(|recipe| simulate::scene::Scene::build(&recipe.scene, "".as_ref()).ok());
    scene.map(|scene| scene.edges.iter().map(|edge| [edge.start, edge.end]).collect()).unwrap_or_default()
}
