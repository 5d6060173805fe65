//! What can go wrong when a dataset is fetched.

use std::io;
use std::path::{Path, PathBuf};

use crate::archive;

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
    /// A server does not have the file, or does not give it.
    #[error("{url}: the server answered {status}{}, expected the file {file}", reason.as_ref().map(|reason| format!(" {reason}")).unwrap_or_default())]
    Status {
        /// Where.
        url: String,
        /// The file.
        file: String,
        /// What the server answered.
        status: u16,
        /// In words.
        reason: Option<&'static str>,
    },
    /// The server cannot be reached, or does not keep to HTTP, however often it is asked.
    #[error("{url}: {detail}; attempts in vain: {attempts}{}", what_is_kept(file, *kept))]
    Connection {
        /// Where.
        url: String,
        /// The file.
        file: String,
        /// What went wrong at last.
        detail: String,
        /// How often it was tried.
        attempts: u32,
        /// Bytes of the file that came, which the next run goes on after.
        kept: u64,
    },
    /// The file has another length than it should.
    #[error("{place}: expected {expected} B of {file}, found {found} B")]
    Length {
        /// URL or path.
        place: String,
        /// The file.
        file: String,
        /// Its length by the recipe.
        expected: u64,
        /// What came, or was announced.
        found: u64,
    },
    /// The file has another content than it should.
    #[error(
        "{place}: {file} is not the file that the recipe means: expected SHA-256 {expected}, found {found}"
    )]
    Checksum {
        /// URL or path.
        place: String,
        /// The file.
        file: String,
        /// Its digest by the recipe.
        expected: String,
        /// Its digest.
        found: String,
    },
    /// Instead of an archive there is something else.
    #[error("{place}: expected the archive {file}, found {found}; the URL may have moved")]
    NotAnArchive {
        /// URL or path.
        place: String,
        /// The file.
        file: String,
        /// What it looks like.
        found: String,
    },
    /// The folder to be replaced has the mirror in it.
    #[error("{}: expected a folder without the mirror, found {} in it", path.display(), mirror.display())]
    ReplacesMirror {
        /// The folder that would be replaced.
        path: PathBuf,
        /// The mirror.
        mirror: PathBuf,
    },
    /// A mirror on disk does not have the file.
    #[error("{file}: expected {} or {}, found neither", first.display(), second.display())]
    NotOnMirror {
        /// The file.
        file: String,
        /// Where it was looked for.
        first: PathBuf,
        /// And then.
        second: PathBuf,
    },
    /// The archive cannot be unpacked.
    #[error(transparent)]
    Archive(#[from] archive::Error),
    /// What was unpacked has no folder to convert.
    #[error("{sequence}: expected the folder {} in what was unpacked, found none", folder.display())]
    NoFolder {
        /// The sequence.
        sequence: String,
        /// The folder.
        folder: PathBuf,
    },
    /// The recipe has no such part.
    #[error("{sequence}: the first text release has nothing of it")]
    NoTextRelease {
        /// The sequence.
        sequence: String,
    },
    /// Something stands where the folder is to appear.
    #[error("{}: exists already; use another name or permit overwriting (--force)", path.display())]
    Exists {
        /// The path.
        path: PathBuf,
    },
    /// Another process is downloading the same file.
    #[error("{}: another process is downloading it", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
}

/// What is said of a download that may go on.
fn what_is_kept(file: &str, bytes: u64) -> String {
    if bytes == 0 { String::new() } else { format!("; {bytes} B of {file} are kept for the next run") }
}

impl Error {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |cause| Self::Io { path, cause }
    }

    /// Whether the file may well be had elsewhere.
    pub(super) const fn is_about_the_place(&self) -> bool {
        matches!(
            self,
            Self::Status { .. }
                | Self::Connection { .. }
                | Self::Length { .. }
                | Self::Checksum { .. }
                | Self::NotAnArchive { .. }
        )
    }
}
