//! `os plot`: a picture of a sequence.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use nalgebra::Point3;

use super::{Outcome, stats, text};
use crate::format;
use crate::plot::{Scene, ViewFrom, scene_picture, statistics_figure};
use crate::simulate::{self, Recipe};
use crate::structure::{LineLandmark, Manifest, PointLandmark, StructuralGroup};

/// Draw a sequence as SVG: its scene with the camera's path, or statistics over its frames.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os plot box1.mcap -o box1.svg
  os plot box1 -o top.svg --view top
  os plot box1 -o box1.svg --azimuth 30 --elevation 20
  os plot box1 -o statistics.svg --figure statistics")]
pub(super) struct Args {
    /// Sequence: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Output: an SVG file.
    #[arg(short, long, value_name = "FILE.svg")]
    output: PathBuf,
    /// What to draw.
    #[arg(long, value_enum, default_value_t = Figure::Scene)]
    figure: Figure,
    /// From where the scene is looked at.
    #[arg(long, value_enum, default_value_t = View::Oblique)]
    view: View,
    /// Angle about the upward axis, degrees; in place of that of the view.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    azimuth: Option<f64>,
    /// Angle over the horizon, degrees from -90 to 90; in place of that of the view.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    elevation: Option<f64>,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Figure {
    /// Points, lines by group, the camera's path.
    Scene,
    /// Features and occupied cells of each frame.
    Statistics,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum View {
    /// From above at an angle.
    Oblique,
    /// From above.
    Top,
    /// From the side.
    Side,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let output = &args.output;
    if output.exists() && !args.force {
        anyhow::bail!("{}: exists; --force replaces it", output.display());
    }
    if output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("svg")) {
        anyhow::bail!("{}: expected a name that ends in .svg", output.display());
    }
    let picture = match args.figure {
        Figure::Scene => {
            let reader = format::open(&args.sequence)?;
            let (points, lines) = (reader.table::<PointLandmark>()?, reader.table::<LineLandmark>()?);
            let groups = reader.table::<StructuralGroup>()?;
            let edges = edges(reader.manifest());
            let scene = Scene {
                edges: &edges,
                manifest: reader.manifest(),
                frames: reader.frame_list()?,
                points: &points,
                lines: &lines,
                groups: &groups,
            };
            scene_picture(&scene, args.view())?
        }
        Figure::Statistics => {
            let analysed = stats::analyse(&args.sequence)?;
            statistics_figure(&analysed.sequence.name, &analysed.frames)
        }
    };
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty());
    let mut file = tempfile::NamedTempFile::new_in(folder.unwrap_or_else(|| ".".as_ref()))?;
    file.write_all(picture.as_bytes())?;
    if args.force {
        file.persist(output)?;
    } else {
        file.persist_noclobber(output)?;
    }
    let size = fs::metadata(output).map_or(0, |found| found.len());
    writeln!(stdout, "{}: {}", output.display(), text::bytes(size))?;
    Ok(Outcome::Done)
}

/// Edges of a simulated scene, made again from the recipe in the manifest; none where that cannot be done, as
/// with a mesh that is not here.
fn edges(manifest: &Manifest) -> Vec<[Point3<f64>; 2]> {
    let recipe = manifest.generator.parameters.get("recipe");
    let recipe: Option<Recipe> = recipe.and_then(|text| serde_json::from_str(text).ok());
    let scene = recipe.and_then(|recipe| simulate::scene::Scene::build(&recipe.scene, "".as_ref()).ok());
    scene.map(|scene| scene.edges.iter().map(|edge| [edge.start, edge.end]).collect()).unwrap_or_default()
}

impl Args {
    fn view(&self) -> ViewFrom {
        let named = match self.view {
            View::Oblique => ViewFrom::OBLIQUE,
            View::Top => ViewFrom::TOP,
            View::Side => ViewFrom::SIDE,
        };
        ViewFrom {
            azimuth_degrees: self.azimuth.unwrap_or(named.azimuth_degrees),
            elevation_degrees: self.elevation.unwrap_or(named.elevation_degrees),
        }
    }
}
