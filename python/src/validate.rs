//! `validate`: every rule of the specification, held against a sequence.

use std::path::PathBuf;

use open_structure::validate::{Options, Report, validate as validate_path, validate_sequence};
use pyo3::prelude::*;

use crate::errors;
use crate::json;
use crate::sequence::Source;
use crate::work;

/// Holds a file or folder against every rule of the specification, however broken it is; gives a report with its findings.
///
/// * ``max_findings``: findings listed of each rule in each table; all are counted.
#[pyfunction]
#[pyo3(signature = (path, *, max_findings = 5))]
pub(crate) fn validate(py: Python<'_>, path: PathBuf, max_findings: usize) -> PyResult<Bound<'_, PyAny>> {
    let report = work::run(py, errors::of_validate, |watch| {
        let progress = |_, _| watch.progress();
        let options = Options { listed: max_findings, progress: Some(&progress), ..Options::default() };
        validate_path(&path, &options)
    })?;
    as_python(py, &report)
}

/// A sequence where it lies, or in memory.
pub(crate) fn of_source<'py>(
    py: Python<'py>,
    source: &Source,
    max_findings: usize,
) -> PyResult<Bound<'py, PyAny>> {
    match source {
        Source::File(reader) => validate(py, reader.path().to_owned(), max_findings),
        Source::Memory(sequence) => {
            let report = work::run(py, errors::of_validate, |watch| {
                let progress = |_, _| watch.progress();
                let options =
                    Options { listed: max_findings, progress: Some(&progress), ..Options::default() };
                Ok(validate_sequence(sequence, &options))
            })?;
            as_python(py, &report)
        }
    }
}

fn as_python<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyAny>> {
    let report = json::to_python(py, report)?;
    py.import("open_structure._report")?.getattr("Report")?.call_method1("from_json", (report,))
}
