//! Rules over a sequence, findings out.
//!
//! ```no_run
//! use std::path::Path;
//! use open_structure::validate::{Options, validate};
//!
//! let report = validate(Path::new("box1.mcap"), &Options::default())?;
//! for finding in &report.findings {
//!     println!("{}: expected {}, found {}", finding.rule, finding.expected, finding.found);
//! }
//! assert!(report.conformant);
//! # Ok::<(), open_structure::validate::Error>(())
//! ```
//!
//! Every table is read once, whatever its length, and memory is bounded by frames and landmarks. What
//! cannot be decoded is a finding, and the rest is checked all the same.

mod collection;
mod container;
mod correspondences;
mod depth_noise;
mod estimates;
mod finding;
mod fit;
mod frame_rows;
mod frame_statistics;
mod frames;
mod graphs;
mod group_parts;
mod groups;
mod ids;
mod landmarks;
mod line_rows;
mod manifest;
mod mix;
mod noise;
mod point_rows;
mod positive;
mod report;
mod rules;
mod run;
mod source;
mod stored;
mod tables;
#[cfg(test)]
mod tests;
mod truth;
mod world;

use std::path::{Path, PathBuf};

pub use finding::Finding;
pub use report::{REPORT_VERSION, Report, RuleCount, report_schema};
pub use rules::{RULES, Rule, Severity, rule, rules_for};

use crate::structure::Sequence;

/// Findings of a rule that are listed of each table unless more are asked for.
const LISTED: usize = 10;

/// How to validate.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Most findings that are listed of each rule in each table; all are counted.
    pub listed: usize,
    /// Threads; by default as many as there are cores.
    pub jobs: Option<usize>,
    /// Told the rows that are done and the rows that are expected, from any thread.
    pub progress: Option<&'a (dyn Fn(u64, u64) + Sync)>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self { listed: LISTED, jobs: None, progress: None }
    }
}

/// Why nothing could be looked at.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The path does not exist, or the system does not give it.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
}

/// Validates a sequence in a file or folder, however broken; of a collection its catalogue, not the sequences themselves.
///
/// The report is the same for any number of threads.
///
/// # Errors
/// [`Error::Io`] when there is nothing to look at; everything else is a finding.
pub fn validate(path: &Path, options: &Options<'_>) -> Result<Report, Error> {
    on_threads(options, || stored::validate(path, options))
}

/// Validates a sequence in memory, whose tables are taken to be those that have rows.
///
/// The rules of containers, digests and encodings say nothing here.
#[must_use]
pub fn validate_sequence(sequence: &Sequence, options: &Options<'_>) -> Report {
    on_threads(options, || stored::validate_sequence(sequence, options))
}

fn on_threads<T: Send>(options: &Options<'_>, work: impl FnOnce() -> T + Send) -> T {
    let pool =
        options.jobs.and_then(|jobs| rayon::ThreadPoolBuilder::new().num_threads(jobs.max(1)).build().ok());
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
