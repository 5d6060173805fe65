//! What can be wrong with a raw dataset.

use std::io;
use std::path::PathBuf;

/// What is wrong, and in which file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// A folder is not of the dataset.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Layout {
        /// The folder.
        path: PathBuf,
        /// What the dataset has there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A line of a list cannot be used.
    #[error("{}:{line}: expected {expected}, found {found}", path.display())]
    Line {
        /// The list.
        path: PathBuf,
        /// The line, counted from 1.
        line: u64,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// An image cannot be used.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Image {
        /// The image.
        path: PathBuf,
        /// What it should be.
        expected: String,
        /// What it is.
        found: String,
    },
}

impl Error {
    /// A file that could not be read.
    pub fn io(path: impl Into<PathBuf>, cause: io::Error) -> Self {
        Self::Io { path: path.into(), cause }
    }

    /// A folder, or a file as a whole, that is not of the dataset.
    pub fn layout(path: impl Into<PathBuf>, expected: impl ToString, found: impl ToString) -> Self {
        Self::Layout { path: path.into(), expected: expected.to_string(), found: found.to_string() }
    }

    /// A line of a list that cannot be used.
    pub fn line(path: impl Into<PathBuf>, line: u64, expected: impl ToString, found: impl ToString) -> Self {
        Self::Line { path: path.into(), line, expected: expected.to_string(), found: found.to_string() }
    }

    /// An image that cannot be used.
    pub fn image(path: impl Into<PathBuf>, expected: impl ToString, found: impl ToString) -> Self {
        Self::Image { path: path.into(), expected: expected.to_string(), found: found.to_string() }
    }
}
