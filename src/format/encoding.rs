//! The two ways of storing a sequence.

use std::path::Path;

/// How a sequence is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// One MCAP file.
    Mcap,
    /// A folder with `sequence.json` and one Parquet file per table.
    Parquet,
}

impl Encoding {
    /// The encoding that an output name asks for: `.mcap` is a file, anything else a folder.
    #[must_use]
    pub fn of_output(path: &Path) -> Self {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
            Self::Mcap
        } else {
            Self::Parquet
        }
    }

    /// Name as people read it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mcap => "MCAP file",
            Self::Parquet => "Parquet folder",
        }
    }
}
