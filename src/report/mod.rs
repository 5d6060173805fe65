//! Sequences and results as one HTML file: what is in them, what was measured, how good estimates are, what breaks a rule.
//!
//! ```no_run
//! use std::path::Path;
//! use open_structure::report::{Report, ReportOptions};
//!
//! let report = Report::of(&[Path::new("box1.mcap")], &ReportOptions::default())?;
//! std::fs::write("report.html", report.html()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The page needs nothing else: no network, no other file. Its own code stands in `page/` and is bundled into `page/dist/`.

mod benchmark_section;
mod charts;
mod columns;
mod comparison;
mod comparison_section;
mod convergence;
mod error;
mod explorer_section;
mod features;
mod findings_section;
mod input;
mod json_results;
mod numbers;
mod page;
mod results_section;
mod scene;
mod sequence_report;
mod statistics_section;
mod summary_section;
mod view_data;

use std::path::Path;

use nalgebra::Point3;

use crate::structure::Manifest;

pub use comparison::{ComparedEstimate, Comparison, coordinates_and_angles};
pub use convergence::Run;
pub use error::Error;
pub use json_results::{AdjustmentRow, BenchmarkRow, EvaluationRow, Results};
pub use sequence_report::SequenceReport;

use input::Input;

/// Edges of the objects of a simulated scene, made again from its manifest: pairs of ends, `world`, metres.
pub type EdgesOf<'a> = dyn Fn(&Manifest) -> Vec<[Point3<f64>; 2]> + 'a;

/// How a report is made.
#[derive(Clone, Copy, Default)]
pub struct ReportOptions<'a> {
    /// Gives the edges of objects, which are drawn faintly; without it none are drawn.
    pub edges: Option<&'a EdgesOf<'a>>,
    /// Told what is done, and how far.
    pub progress: Option<&'a (dyn Fn(&'static str, u64, u64) + Sync)>,
}

/// What a page shows.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Sequences, in the order of the inputs.
    pub sequences: Vec<SequenceReport>,
    /// What other commands found.
    pub results: Results,
}

impl Report {
    /// Reads sequences, and what other commands wrote as JSON.
    ///
    /// * `inputs` — sequences (MCAP files or Parquet folders), folders of `os benchmark`, and files with what
    ///   `os evaluate --json`, `os adjust --json` and `os benchmark --json` print.
    ///
    /// # Errors
    /// Those of [`format::open`](crate::format::open) and of reading its tables; [`Error::UnknownInput`] and [`Error::Json`] for a
    /// file that is nothing of all this.
    pub fn of(inputs: &[&Path], options: &ReportOptions<'_>) -> Result<Self, Error> {
        let mut report = Self::default();
        for path in inputs {
            match Input::of(path)? {
                Input::Sequence => report.sequences.push(SequenceReport::of(path, options)?),
                Input::Results(results) => report.results.extend(*results),
            }
        }
        Ok(report)
    }

    /// The page. The same report gives the same bytes.
    ///
    /// # Errors
    /// [`Error::Encode`] when the data cannot be written as JSON.
    pub fn html(&self) -> Result<String, Error> {
        page::html(self)
    }

    /// Whether a sequence breaks a rule that it has to follow, or an estimate could not be compared.
    #[must_use]
    pub fn has_findings(&self) -> bool {
        self.sequences.iter().any(SequenceReport::has_findings)
    }
}
