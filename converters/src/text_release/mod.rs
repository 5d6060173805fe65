//! The first text release of the data, read: which sequences lie on disk, and what their files hold, number by number.
//!
//! Nothing is judged here. Whether an observation is truth or measurement, which camera took it, and which of several
//! blocks of landmarks is meant is for whoever uses the rows. What cannot be used is told with file and line:
//!
//! ```no_run
//! use open_structure_converters::text_release::{Limits, discover, read};
//!
//! let limits = Limits::default();
//! for source in discover(&["dataset".into()], &limits)?.sequences {
//!     let sequence = read(&source, &limits)?;
//!     println!("{}: {} trajectories", sequence.name, sequence.trajectories.len());
//!     for problem in sequence.problems.listed() {
//!         println!("{problem}");
//!     }
//! }
//! # Ok::<(), open_structure_converters::text_release::Error>(())
//! ```

mod blocks;
mod discover;
mod error;
mod fields;
mod kind;
mod model;
mod parameters;
mod parse;
mod place;
mod problem;
mod read;
mod source;

pub use discover::{Discovery, Part, SequenceSource, discover};
pub use error::Error;
pub use kind::FileKind;
pub use model::{
    Association, Block, GroupLine, LineObservationLine, NamedMap, NamedTrajectory, PointFile, PointLine,
    PointObservationLine, PoseFile, PoseLine, Provenance, Row, Rows, SegmentFile, SegmentLine, TextSequence,
};
pub use parameters::parse_parameters;
pub use parse::{BareLine, parse};
pub use place::Role;
pub use problem::{FileProblems, LISTED_PER_KIND, Problem, ProblemCount, ProblemKind, Problems};
pub use read::read;
pub use source::{
    Budget, Container, Limits, Source, SourceFile, is_archive, provenance_of_bytes, provenance_of_file,
};
