//! JSON of the library as dictionaries and lists of Python.

use pyo3::prelude::*;
use serde::Serialize;

use crate::errors;

/// A value as Python's own `json` reads it.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|cause| errors::internal(&cause.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}
