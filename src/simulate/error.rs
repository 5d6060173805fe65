//! What can go wrong when a sequence is made up.

use std::path::PathBuf;

use crate::geometry;

/// An error of the room `simulate`.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A value of a recipe cannot be used.
    #[error("{place}: expected {expected}, found {found}")]
    Value {
        /// Where the value stands, such as `trajectory.frames`.
        place: String,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file does not hold what it should.
    #[error("{}{}: expected {expected}, found {found}", path.display(), line.map(|line| format!(", line {line}")).unwrap_or_default())]
    Content {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, where there are lines.
        line: Option<usize>,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Numbers that make no pose, camera or line.
    #[error("{place}: {source}")]
    Geometry {
        /// Where the numbers stand.
        place: String,
        /// What is wrong with them.
        source: geometry::Error,
    },
}

impl Error {
    /// A value that cannot be used.
    pub(crate) fn value(
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl std::fmt::Display,
    ) -> Self {
        Self::Value { place: place.into(), expected: expected.into(), found: found.to_string() }
    }
}
