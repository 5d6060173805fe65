//! Pictures of sequences: charts for pages and reports as SVG, and figures for papers as SVG, PDF and PNG in [`paper`].

mod axis;
mod chart;
mod curves_figure;
mod error;
mod evaluation_figure;
mod growth_figure;
mod heat;
mod page_chart;
pub mod paper;
mod scene;
mod scene_shapes;
mod svg;
mod trajectory_figure;
mod view;

pub use curves_figure::{ErrorCurve, NamedNumbers, convergence_figure, error_figure, histogram_figure};
pub use error::Error;
pub use evaluation_figure::{EvaluatedEstimate, evaluation_figure};
pub use growth_figure::{Growth, growth_figure};
pub use page_chart::{PageBars, PageCurve, Upward, page_bars, page_chart};
pub use scene::{Scene, scene_picture};
pub use trajectory_figure::{ComparedPath, LengthUnit, trajectory_figure};
pub use view::{Plane, ViewFrom, upward};

/// Background, so that a picture is readable on a dark page too.
const PAPER: &str = "#ffffff";
/// Text and the camera's path.
const INK: &str = "#1a1a1a";
/// What is there without meaning much.
const QUIET: &str = "#8c8c8c";
/// What stands behind everything else.
const FAINT: &str = "#cfd4d8";
/// Colours that are told apart with any kind of sight (Okabe and Ito 2008), without black and yellow.
const COLOURS: [&str; 6] = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const FONT: &str = "font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\"";
