//! Why a text release cannot be read at all. What is merely unusable in it is a [`super::Problem`].

use std::io;
use std::path::{Path, PathBuf};

/// Why a text release cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A path leads nowhere.
    #[error("{path}: no such file or folder")]
    Missing {
        /// The path.
        path: PathBuf,
    },
    /// A file that is no archive stands where one, or a folder, should.
    #[error("{path}: expected a zip archive or a folder, found a file that is neither")]
    NotAnArchive {
        /// The file.
        path: PathBuf,
    },
    /// No sequence stands below the given paths.
    #[error(
        "{}: no sequence found; expected association.txt or venom_sequence.txt, or another file of a sequence, in \
         observation.zip or baseline.zip, in folders of these names, or in folders of any name",
        list(paths)
    )]
    NothingFound {
        /// The paths.
        paths: Vec<PathBuf>,
    },
    /// Two sequences in different places would get the same name.
    #[error("two sequences are named {name}: one at {first}, one at {second}")]
    SameName {
        /// The name.
        name: String,
        /// Where the first stands.
        first: String,
        /// Where the second stands.
        second: String,
    },
    /// The system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// An archive that is cut off or broken.
    #[error("{archive}: not a readable zip archive: {reason}")]
    Archive {
        /// The archive.
        archive: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A file of an archive that cannot be unpacked.
    #[error("{file}: damaged in the archive: {reason}")]
    Damaged {
        /// The file, `archive.zip/inner.txt`.
        file: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A file of an archive needs a password.
    #[error("{file}: encrypted; expected a file that opens without a password")]
    Encrypted {
        /// The file, `archive.zip/inner.txt`.
        file: String,
    },
    /// A file of an archive is packed in a way that is not understood.
    #[error("{file}: expected a stored or deflated file, found compression {method}")]
    Compression {
        /// The file, `archive.zip/inner.txt`.
        file: String,
        /// The way it is packed.
        method: String,
    },
    /// An archive or a folder with more files than any sequence has.
    #[error("{container}: expected at most {limit} entries, found {found} or more")]
    TooManyEntries {
        /// The archive or folder.
        container: String,
        /// The limit.
        limit: usize,
        /// How many there are.
        found: usize,
    },
    /// A file that is, or unpacks to, more than the limit.
    #[error("{file}: expected at most {limit} bytes, found more")]
    FileTooLarge {
        /// The file.
        file: String,
        /// The limit.
        limit: u64,
    },
    /// The files of a sequence together are, or unpack to, more than the limit.
    #[error("{file}: expected at most {limit} bytes in all files of the sequence, found more")]
    SequenceTooLarge {
        /// The file that went over.
        file: String,
        /// The limit.
        limit: u64,
    },
}

impl Error {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| {
            if source.kind() == io::ErrorKind::NotFound {
                Self::Missing { path }
            } else {
                Self::Io { path, source }
            }
        }
    }
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
