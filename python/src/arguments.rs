//! Arguments of functions: sequences by object or by path, choices by name.

use std::path::PathBuf;
use std::sync::Arc;

use open_structure::structure;
use pyo3::prelude::*;

use crate::errors;
use crate::sequence::Sequence;

/// A sequence as a function takes it: the object, or where it lies.
pub(crate) struct Given<'py> {
    sequence: Bound<'py, Sequence>,
}

impl<'py> FromPyObject<'_, 'py> for Given<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(sequence) = object.cast::<Sequence>() {
            return Ok(Self { sequence: sequence.to_owned() });
        }
        let path: PathBuf = object.extract().map_err(|_| {
            let found = object
                .get_type()
                .name()
                .map_or_else(|_| "something else".to_owned(), |name| name.to_string());
            pyo3::exceptions::PyTypeError::new_err(format!("expected a Sequence or a path, found {found}"))
        })?;
        let opened = object.py().get_type::<Sequence>().call_method1("open", (path,))?;
        Ok(Self { sequence: opened.cast_into::<Sequence>()? })
    }
}

impl Given<'_> {
    /// The rows in memory.
    pub(crate) fn rows(&self) -> PyResult<Arc<structure::Sequence>> {
        self.sequence.get().in_memory(self.sequence.py())
    }

    /// What the sequence is called in tables of results.
    pub(crate) fn title(&self) -> String {
        self.sequence.get().title()
    }
}

/// The value of a name.
pub(crate) fn choice<T: Copy>(option: &str, found: &str, choices: &[(&str, T)]) -> PyResult<T> {
    if let Some((_, value)) = choices.iter().find(|(name, _)| *name == found) {
        return Ok(*value);
    }
    let names: Vec<String> = choices.iter().map(|(name, _)| format!("`{name}`")).collect();
    Err(errors::option(format!("{option}: expected one of {}, found `{found}`", names.join(", "))))
}

/// A whole number over zero.
pub(crate) fn at_least_one(option: &str, found: usize) -> PyResult<usize> {
    if found > 0 {
        Ok(found)
    } else {
        Err(errors::option(format!("{option}: expected a whole number over zero, found 0")))
    }
}

/// A finite number over zero.
pub(crate) fn positive(option: &str, found: f64) -> PyResult<f64> {
    let right = found > 0.0 && found.is_finite();
    if right {
        Ok(found)
    } else {
        Err(errors::option(format!("{option}: expected a number over zero, found {found}")))
    }
}

/// A finite number that is not below zero.
pub(crate) fn not_negative(option: &str, found: f64) -> PyResult<f64> {
    let right = found >= 0.0 && found.is_finite();
    if right {
        Ok(found)
    } else {
        Err(errors::option(format!("{option}: expected a number not below zero, found {found}")))
    }
}
