//! What can go wrong when an archive is unpacked.

use std::io;
use std::path::{Path, PathBuf};

/// Errors of this room.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{}: {cause}", path.display())]
    Io {
        /// File or folder concerned.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// The file is no archive of a kind that is known.
    #[error("{}: expected a zip, tar or tar.gz archive, found {found}", archive.display())]
    Kind {
        /// The file.
        archive: PathBuf,
        /// What it looks like.
        found: String,
    },
    /// The archive cannot be read on.
    #[error("{}: damaged {kind}{}: {detail}", archive.display(), entry.as_ref().map(|name| format!(", entry {name}")).unwrap_or_default())]
    Damaged {
        /// The archive.
        archive: PathBuf,
        /// Its kind.
        kind: &'static str,
        /// The entry, where one was being read.
        entry: Option<String>,
        /// What its reader said.
        detail: String,
    },
    /// An entry has a name that is not to be followed.
    #[error("{}: entry {name}: {reason}", archive.display())]
    Name {
        /// The archive.
        archive: PathBuf,
        /// The name, printable and cut short.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Two entries have one name, or one is a file and another needs a folder of that name.
    #[error("{}: entry {name}: something of that name is there already", archive.display())]
    Twice {
        /// The archive.
        archive: PathBuf,
        /// The name.
        name: String,
    },
    /// The archive holds more than is permitted.
    #[error("{}: more than {limit} {what}: this is no archive of a dataset", archive.display())]
    TooMuch {
        /// The archive.
        archive: PathBuf,
        /// What there is too much of.
        what: &'static str,
        /// What is permitted.
        limit: u64,
    },
    /// An entry is encrypted, or packed by a method that is not known.
    #[error("{}: entry {name}: expected a stored or deflated file, found {found}", archive.display())]
    Method {
        /// The archive.
        archive: PathBuf,
        /// The entry.
        name: String,
        /// How it is packed.
        found: String,
    },
    /// None of the files that are wanted is there.
    #[error("{}: expected {expected}, found none among {entries} entries", archive.display())]
    Nothing {
        /// The archive.
        archive: PathBuf,
        /// What is wanted.
        expected: String,
        /// Entries of the archive.
        entries: u64,
    },
    /// Something stands where the folder is to appear.
    #[error("{}: exists already", path.display())]
    Exists {
        /// The path.
        path: PathBuf,
    },
}

impl Error {
    /// An error of the operating system about a path.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |cause| Self::Io { path, cause }
    }
}
