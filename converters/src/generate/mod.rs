//! From a raw RGB-D sequence to the rows of ours: detect, fuse, find again, measure.
//!
//! Frames are gone through twice. In the first pass points and segments are detected in each image, lifted into the world by
//! depth and true pose, and fused into landmarks. In the second, when landmarks have their final places, each frame's depth
//! map tells which of them it sees. Observations are then the exact projections of landmarks, made when they are written.

mod describe;
mod documented;
mod error;
mod first_pass;
mod generated;
mod ledger;
mod options;
mod overlay;
mod second_pass;

pub use describe::TOOL;
pub use documented::documented;
pub use error::Error;
pub use generated::{Generated, generate};
pub use ledger::Ledger;
pub use options::{DepthOptions, Options};
pub use overlay::overlay;

/// Told the stage, what is done, and of how much; from one thread.
pub type Progress<'a> = dyn Fn(&'static str, u64, u64) + Sync + 'a;
