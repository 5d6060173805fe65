//! What happens while a dataset is fetched, for whoever wants to show it.

use std::time::Duration;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A file is asked for.
    Asked {
        /// The file.
        file: &'a str,
        /// Where.
        url: &'a str,
    },
    /// Bytes of a file have come.
    Bytes {
        /// The file.
        file: &'a str,
        /// Bytes that are there, those of earlier runs too.
        done: u64,
        /// Bytes of the file, where the server or the recipe tells.
        total: Option<u64>,
    },
    /// A download goes on where it was cut.
    Resumed {
        /// The file.
        file: &'a str,
        /// Bytes that were there.
        at: u64,
    },
    /// What was there is of no use, and the download starts over.
    StartedOver {
        /// The file.
        file: &'a str,
        /// Why.
        reason: &'a str,
    },
    /// An attempt failed; another follows.
    Failed {
        /// The file.
        file: &'a str,
        /// What went wrong.
        reason: &'a str,
        /// How long is waited.
        wait: Duration,
    },
    /// A place does not have the file; the next is asked.
    GoneElsewhere {
        /// The file.
        file: &'a str,
        /// What went wrong.
        reason: &'a str,
    },
    /// A file is there from an earlier run, or on a mirror's disk, and is whole.
    There {
        /// The file.
        file: &'a str,
        /// Its length, bytes.
        bytes: u64,
    },
    /// An archive is being unpacked.
    Unpacking {
        /// The file.
        file: &'a str,
        /// Bytes of the archive that are read.
        done: u64,
        /// All.
        total: u64,
    },
}
