//! What can go wrong when a sequence is read or written.

use std::path::PathBuf;

use crate::structure::FrameId;

/// Errors of this room. Each says where, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{}: {cause}", path.display())]
    Io {
        /// File or folder concerned.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The path is neither an MCAP file nor a Parquet folder of this format.
    #[error("{}: not an Open-Structure sequence: {found}; expected an .mcap file or a folder with sequence.json", path.display())]
    NotASequence {
        /// The path.
        path: PathBuf,
        /// What is there.
        found: String,
    },
    /// Something is already there.
    #[error("{}: exists already; use another name or permit overwriting (--force)", path.display())]
    Exists {
        /// The path.
        path: PathBuf,
    },
    /// Two folders of a collection hold sequences of one name.
    #[error(
        "{} and {}: both hold a sequence called `{name}`; expected a name for each (os measure --name gives one)",
        first.display(),
        second.display()
    )]
    OneName {
        /// The name.
        name: String,
        /// One of them.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// What is there is not of the kind that would take its place, and so may be dear to somebody.
    #[error("{}: expected {expected} to replace, found {found}; use another name", path.display())]
    NotReplaced {
        /// The path.
        path: PathBuf,
        /// What may be replaced.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// The manifest cannot be understood.
    #[error("{}: manifest: {detail}", path.display())]
    Manifest {
        /// File that holds the manifest.
        path: PathBuf,
        /// What is wrong.
        detail: String,
    },
    /// The sequence follows a specification that this version does not know.
    #[error("{}: specification version {found} is not supported; this program reads 1.x", path.display())]
    Version {
        /// File that says so.
        path: PathBuf,
        /// The declared version.
        found: String,
    },
    /// The container is damaged.
    #[error("{}: {container}: {detail}", path.display())]
    Container {
        /// File concerned.
        path: PathBuf,
        /// `MCAP`, `Parquet` or `Arrow`.
        container: &'static str,
        /// What the decoder said.
        detail: String,
    },
    /// Something claims to be larger than is plausible.
    #[error("{}: {what} of {found} exceeds the limit of {limit}", path.display())]
    TooLarge {
        /// File concerned.
        path: PathBuf,
        /// What is too large.
        what: String,
        /// Claimed size.
        found: u64,
        /// Permitted size.
        limit: u64,
    },
    /// A landmark is measured in a frame that does not observe it.
    #[error("{frame_id}: {landmark} is measured without being observed")]
    Unobserved {
        /// The frame.
        frame_id: FrameId,
        /// The landmark.
        landmark: String,
    },
    /// A column that every row needs is missing.
    #[error("{table}: column {column} is missing; expected {expected}")]
    MissingColumn {
        /// Table name.
        table: &'static str,
        /// Column name.
        column: &'static str,
        /// Expected type.
        expected: &'static str,
    },
    /// A column has another type.
    #[error("{table}: column {column} is {found}; expected {expected}")]
    ColumnType {
        /// Table name.
        table: &'static str,
        /// Column name.
        column: &'static str,
        /// Expected type.
        expected: &'static str,
        /// Found type.
        found: String,
    },
    /// A value is absent where none may be.
    #[error("{table} row {row}: column {column} is null")]
    Null {
        /// Table name.
        table: &'static str,
        /// Row number within the file, counted from 0.
        row: u64,
        /// Column name.
        column: &'static str,
    },
    /// Rows come in the wrong order, or a key comes twice.
    #[error("{table} row {row}: {key} does not come after {previous}")]
    Order {
        /// Table name.
        table: &'static str,
        /// Row number, counted from 0.
        row: u64,
        /// Key of the row.
        key: String,
        /// Key of the row before.
        previous: String,
    },
    /// A row names a frame that is not in `frames`.
    #[error("{table} row {row}: frame {frame} is not in frames")]
    UnknownFrame {
        /// Table name.
        table: &'static str,
        /// Row number, counted from 0.
        row: u64,
        /// The frame's id.
        frame: i64,
    },
    /// A time stamp lies before zero, which an MCAP file cannot hold.
    #[error("frames row {row}: stamp {stamp} ns is negative")]
    NegativeStamp {
        /// Row number, counted from 0.
        row: u64,
        /// The stamp.
        stamp: i64,
    },
    /// The writer was called in an order that cannot be stored.
    #[error("{table}: {detail}")]
    Sequence {
        /// Table name.
        table: &'static str,
        /// What was called too early, too late or not at all.
        detail: &'static str,
    },
    /// A sequence of a collection lies in a folder of another name.
    #[error("{}: holds the sequence `{name}`; expected a folder called {expected}", path.display())]
    Misnamed {
        /// The folder.
        path: PathBuf,
        /// Name that the manifest says.
        name: String,
        /// What the folder of that name is called.
        expected: String,
    },
    /// A sequence lies in a collection under a name that makes it no part of it.
    #[error("{}: a sequence that is no part of the collection; expected {} ({remedy})", path.display(), expected.display())]
    OutsideCollection {
        /// The sequence.
        path: PathBuf,
        /// Where the collection would have it.
        expected: PathBuf,
        /// What brings it there.
        remedy: String,
    },
    /// A third-party decoder failed in a way that its authors did not foresee.
    #[error("{}: the {container} decoder gave up: {detail}", path.display())]
    Decoder {
        /// File concerned.
        path: PathBuf,
        /// `MCAP`, `Parquet` or `Arrow`.
        container: &'static str,
        /// Message of the decoder.
        detail: String,
    },
}

impl Error {
    pub(super) fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        |cause| Self::Io { path, cause }
    }

    pub(super) fn container(
        path: &std::path::Path,
        container: &'static str,
    ) -> impl FnOnce(Box<dyn std::error::Error + Send + Sync>) -> Self {
        let path = path.to_owned();
        move |source| {
            let mut detail = source.to_string();
            let mut cause = source.source();
            while let Some(error) = cause {
                let text = error.to_string();
                // Some say what their causes say, such as a full disk; others leave it to whoever asks.
                if !detail.contains(&text) {
                    detail = format!("{detail}: {text}");
                }
                cause = error.source();
            }
            Self::Container { path, container, detail }
        }
    }
}
