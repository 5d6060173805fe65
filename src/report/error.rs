//! What can keep a report from being made.

use std::path::PathBuf;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A sequence that cannot be read.
    #[error(transparent)]
    Format(#[from] crate::format::Error),
    /// A sequence that cannot be validated.
    #[error(transparent)]
    Validate(#[from] crate::validate::Error),
    /// A file that the system does not give.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file that is neither a sequence nor JSON.
    #[error(
        "{}: expected a sequence, a folder of results, or what a command prints with --json, found {found}",
        path.display()
    )]
    UnknownInput {
        /// The file or folder.
        path: PathBuf,
        /// What it is instead.
        found: String,
    },
    /// JSON that cannot be read.
    #[error("{}: JSON that cannot be read: {cause}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        cause: serde_json::Error,
    },
    /// JSON that none of the commands prints.
    #[error("{}: object {object}: expected what os evaluate, os adjust or os benchmark prints with --json, found {found}", path.display())]
    UnknownJson {
        /// The file.
        path: PathBuf,
        /// Which object of the file, counted from 1.
        object: usize,
        /// Its members.
        found: String,
    },
    /// Data of the page that cannot be written as JSON.
    #[error("the data of the page: {0}")]
    Encode(serde_json::Error),
}
