//! Errors of the library as exceptions of Python: `open_structure.Error` and its kinds.

use std::fmt::Display;
use std::io;
use std::path::Path;

use open_structure::{evaluate, format, simulate, stations, validate};
use pyo3::prelude::*;

/// What a user of Python would call it; the classes stand in `open_structure/_errors.py`.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A file is not what it should be.
    Format,
    /// An argument is not what it should be.
    Option,
    /// A step cannot be done with this sequence.
    Step,
    /// Nothing is there.
    NotFound,
    /// Something is there.
    Exists,
    /// The operating system refused.
    Access,
    /// A mistake of ours.
    Internal,
}

impl Kind {
    const fn class(self) -> &'static str {
        match self {
            Self::Format => "FormatError",
            Self::Option => "OptionError",
            Self::Step => "StepError",
            Self::NotFound => "NotFoundError",
            Self::Exists => "ExistsError",
            Self::Access => "AccessError",
            Self::Internal => "InternalError",
        }
    }

    fn with(
        self,
        arguments: impl for<'py> FnOnce(Python<'py>, Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>>,
    ) -> PyErr {
        Python::attach(|py| {
            let raised = py
                .import("open_structure._errors")
                .and_then(|module| module.getattr(self.class()))
                .and_then(|class| arguments(py, class));
            raised.map_or_else(|error| error, PyErr::from_value)
        })
    }

    fn says(self, message: &str) -> PyErr {
        self.with(|_, class| class.call1((message,)))
    }
}

/// An argument that cannot be used.
pub(crate) fn option(message: impl Display) -> PyErr {
    Kind::Option.says(&message.to_string())
}

/// A step that cannot be done.
pub(crate) fn step(message: impl Display) -> PyErr {
    Kind::Step.says(&message.to_string())
}

/// A mistake of ours, as what was said when it happened.
pub(crate) fn internal(message: &str) -> PyErr {
    Kind::Internal.says(&format!("{message}; this is a mistake of open_structure, not of yours"))
}

/// A name under which something stands already.
fn exists(path: &Path, message: &str) -> PyErr {
    Kind::Exists
        .with(|py, class| class.call1((py.import("errno")?.getattr("EEXIST")?, message, path.as_os_str())))
}

/// What the operating system said.
pub(crate) fn system(path: &Path, cause: &io::Error) -> PyErr {
    // The number is for what no operating system said, such as an object store.
    let (kind, number) = match cause.kind() {
        io::ErrorKind::NotFound => (Kind::NotFound, "ENOENT"),
        io::ErrorKind::AlreadyExists => (Kind::Exists, "EEXIST"),
        io::ErrorKind::PermissionDenied => (Kind::Access, "EACCES"),
        _ => (Kind::Access, "EIO"),
    };
    let text = cause.to_string();
    // Python says the number itself.
    let text = text.split(" (os error").next().unwrap_or_default();
    kind.with(|py, class| {
        let errno = match cause.raw_os_error() {
            Some(number) => number,
            None => py.import("errno")?.getattr(number)?.extract()?,
        };
        class.call1((errno, text, path.as_os_str()))
    })
}

/// An error of the room `format`.
pub(crate) fn of_format(error: format::Error) -> PyErr {
    match &error {
        format::Error::Io { path, cause } => system(path, cause),
        format::Error::Exists { path } => exists(path, "exists already; use another name, or force=True"),
        format::Error::NotReplaced { path, expected, found } => {
            exists(path, &format!("expected {expected} to replace, found {found}; use another name"))
        }
        _ => Kind::Format.says(&error.to_string()),
    }
}

/// An error of the room `stations`.
pub(crate) fn of_station(error: stations::Error) -> PyErr {
    use stations::Error;
    match &error {
        Error::RecipeFile { path, cause } => system(path, cause),
        Error::Simulate(simulate::Error::Io { path, source }) => system(path, source),
        Error::Name { .. }
        | Error::Taken { .. }
        | Error::Unknown { .. }
        | Error::Several { .. }
        | Error::Idle { .. }
        | Error::Row { .. }
        | Error::Twice { .. }
        | Error::FromImages { .. }
        | Error::RecipeSize { .. }
        | Error::Recipe { .. }
        | Error::RecipeJson { .. }
        | Error::Simulate(_)
        | Error::Threads(_) => option(&error),
        _ => step(&error),
    }
}

/// An error of the room `evaluate`.
pub(crate) fn of_evaluate(error: &evaluate::Error) -> PyErr {
    step(error)
}

/// An error of the room `validate`.
pub(crate) fn of_validate(error: validate::Error) -> PyErr {
    match &error {
        validate::Error::Io { path, cause } => system(path, cause),
        _ => Kind::Format.says(&error.to_string()),
    }
}
