//! The stations of the way over whole sequences in memory: what a program does between reading and writing.
//!
//! The rooms below take what they need and nothing else; a station finds it in a sequence, chooses what is left open by what the
//! sequence has, and puts the result back. The command line and the Python package both stand on these, so that the same options
//! give the same tables.
//!
//! ```
//! use open_structure::stations::{MeasureRequest, TrackRequest, measure, simulate, simulation_recipe, track};
//! use open_structure::simulate::noise::{NoiseModel, NoiseRecipe};
//!
//! let (mut recipe, folder) = simulation_recipe("sphere2")?;
//! recipe.seed = 7;
//! let simulated = simulate(&recipe, &folder, &|_, _, _| {})?;
//! let noise = NoiseRecipe::new(NoiseModel::FirstRelease);
//! let (measured, _) = measure(&simulated, &MeasureRequest { seed: 7, ..MeasureRequest::new(noise) })?;
//! let (tracked, summary) = track(measured, &TrackRequest::default(), &|_, _| {})?;
//! assert_eq!(summary.frames, tracked.frames.len());
//! # Ok::<(), open_structure::stations::Error>(())
//! ```

mod adjust;
mod enter;
mod error;
mod evaluate;
mod graph;
mod measure;
mod named;
mod simulate;
mod track;

pub use adjust::{AdjustRequest, AdjustedSequence, adjust, adjust_json, graph_to_adjust};
pub use enter::{QUATERNION_TOLERANCE, enter};
pub use error::Error;
pub use evaluate::{EvaluateRequest, evaluate, evaluated};
pub use graph::{GraphCounts, GraphKind, GraphRequest, GraphSummary, estimate_of, graph};
pub use measure::{MeasureRequest, MeasureSummary, complete_depths, measure, measured_manifest};
pub use named::{check_cameras, check_name, check_sequence_name};
pub use simulate::{simulate, simulation_recipe};
pub use track::{TrackRequest, TrackSummary, track};
