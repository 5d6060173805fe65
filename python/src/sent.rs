//! Objects on their way to another process: what `__reduce__` gives.

use pyo3::prelude::*;

/// A function of Python and what it takes to make an object again.
pub(crate) type Sent<'py, T> = PyResult<(Bound<'py, PyAny>, T)>;
