//! How far an estimate is from the truth: errors of trajectories with the definitions of evo, errors of maps, as figures.
//!
//! ```
//! use open_structure::evaluate::{Alignment, Step, absolute, relative};
//! use open_structure::geometry::Pose;
//! use open_structure::structure::FrameId;
//!
//! let at = |x: f64, y: f64| Pose::from_components([x, y, 0.0], [0.0, 0.0, 0.0, 1.0]);
//! let truth = [(FrameId(0), at(0.0, 0.0)?), (FrameId(1), at(1.0, 0.0)?), (FrameId(2), at(1.0, 1.0)?)];
//! let estimate = [(FrameId(0), at(5.0, 0.0)?), (FrameId(1), at(6.0, 0.0)?), (FrameId(2), at(6.0, 1.3)?)];
//!
//! let error = absolute(&truth, &estimate, Alignment::SE3)?;
//! assert!(error.translation.statistics().rmse < 0.15);
//! let error = relative(&truth, &estimate, Alignment::NONE, Step::FRAME)?;
//! assert!((error.translation.statistics().max - 0.3).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod absolute;
mod align;
mod alignment;
mod association;
mod error;
mod errors;
mod evaluation;
mod map_errors;
mod nearest_rotation;
mod reconstruction;
mod relation;
mod relative;
mod result_archive;
mod similarity;
mod statistics;
mod step;
#[cfg(test)]
mod strategies;
mod tables;

pub use absolute::{Absolute, absolute};
pub use align::align;
pub use alignment::{Alignment, AlignmentKind};
pub use association::Matched;
pub use error::Error;
pub use errors::Errors;
pub use evaluation::{EvaluateOptions, Evaluation, evaluate, evaluate_matched};
pub use map_errors::{LineErrors, PointErrors};
pub use reconstruction::Reconstruction;
pub use relation::Relation;
pub use relative::{Relative, relative};
pub use result_archive::{Member, ResultNames, absolute_members, relative_members};
pub use similarity::Similarity;
pub use statistics::Statistics;
pub use step::{Delta, LARGEST_ANGLE_SEARCH, Step};
pub use tables::{Evaluated, per_frame_table, summary_table};
