//! Figures for papers: panels at a size in millimetres, as SVG, PDF and PNG, readable without colours too.
//!
//! A figure is drawn once, as SVG in points; PDF and PNG are made of that (feature `figures`), with letters of a font that comes along.

mod bars;
mod chart;
mod curve;
mod error;
mod face;
mod figure;
mod histogram;
mod legend;
mod measurement_image;
#[cfg(feature = "figures")]
mod rendered;
mod scene_view;
mod sheet;
mod style;
mod theme;

pub use bars::{BarKind, Bars};
pub use chart::{Chart, ColourBar, Scale};
pub use curve::{Curve, Drawn, Role, with_gaps};
pub use error::PaperError;
pub use figure::{Content, Look, Panel, PaperFigure};
pub use histogram::{Histogram, histogram};
pub use measurement_image::{MeasurementImage, RankedGroups, Segment};
#[cfg(feature = "figures")]
pub use rendered::{pdf, png};
pub use scene_view::SceneView;
pub use theme::Theme;

/// Points of a millimetre: a point is the 72nd part of an inch.
const POINTS_PER_MM: f64 = 72.0 / 25.4;
