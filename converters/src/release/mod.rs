//! From what was read of the first text release to sequences of the format: judged, recovered, counted.
//!
//! ```no_run
//! use open_structure_converters::release::{Options, convert};
//! use open_structure_converters::text_release::{Limits, discover, read};
//!
//! let limits = Limits::default();
//! for source in discover(&["dataset".into()], &limits)?.sequences {
//!     let converted = convert(&read(&source, &limits)?, &Options::default())?;
//!     println!("{}: {} frames", converted.sequence.manifest.name, converted.sequence.frames.len());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod convert;
mod decide;
mod describe;
mod estimates;
mod graph;
mod groups;
mod judged;
mod landmarks;
mod ledger;
mod line_fit;
mod noise;
mod poses;
mod recover;
mod remarks;
mod residual;
mod rows;
mod tables;

pub use convert::{Converted, Error, Options, convert};
pub use decide::{Judgement, NOISE_FREE_PX, Verdict};
pub use describe::Findings;
pub use graph::INITIAL;
pub use noise::FoundNoise;
pub use recover::UNREFINED;
pub use residual::Spread;
