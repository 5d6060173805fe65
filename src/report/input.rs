//! What an input of a report is: a sequence, or what another command wrote.

use std::io::Read as _;
use std::path::Path;

use super::error::Error;
use super::json_results::Results;
use crate::format;
use crate::storage::{self, File, Found};

/// Largest JSON file that is read.
const MOST_JSON_BYTES: u64 = 1 << 26;
/// Tables of a folder that `os benchmark` wrote.
const SUMMARY: &str = "summary.parquet";
const CURVES: &str = "curves.parquet";
/// What tells a sequence's folder.
const MANIFEST: &str = "sequence.json";

/// An input of a report.
pub(super) enum Input {
    /// An MCAP file or a Parquet folder.
    Sequence,
    /// What other commands found.
    Results(Box<Results>),
}

impl Input {
    /// Looks at a path; reads it if it holds results.
    pub(super) fn of(path: &Path) -> Result<Self, Error> {
        let io = |cause| Error::Io { path: path.to_owned(), cause };
        let found = storage::find(path).map_err(io)?;
        if found == Found::Folder {
            if storage::exists(&path.join(MANIFEST)) || !storage::is_file(&path.join(SUMMARY)) {
                return Ok(Self::Sequence);
            }
            let summary = format::read_results(&path.join(SUMMARY))?;
            let curves = path.join(CURVES);
            let curves = storage::is_file(&curves).then(|| format::read_results(&curves)).transpose()?;
            return Ok(Self::Results(Box::new(Results::of_tables(path, &summary, curves.as_ref())?)));
        }
        if is_stream(path) {
            return Self::of_stream(path);
        }
        let mut file = File::open(path).map_err(io)?;
        let mut begin = Vec::new();
        file.by_ref().take(64).read_to_end(&mut begin).map_err(io)?;
        let is_json = begin
            .iter()
            .find(|byte| !byte.is_ascii_whitespace())
            .is_some_and(|byte| matches!(byte, b'{' | b'['));
        if !is_json || path.file_name().is_some_and(|name| name == MANIFEST) {
            return Ok(Self::Sequence);
        }
        if file.length() > MOST_JSON_BYTES {
            let found = format!("{} bytes of JSON, over {MOST_JSON_BYTES}", file.length());
            return Err(Error::UnknownInput { path: path.to_owned(), found });
        }
        file.take(MOST_JSON_BYTES).read_to_end(&mut begin).map_err(io)?;
        Ok(Self::Results(Box::new(Results::of_json(path, &begin)?)))
    }

    /// Reads what another command prints meanwhile; a sequence cannot be read in one go.
    fn of_stream(path: &Path) -> Result<Self, Error> {
        let io = |cause| Error::Io { path: path.to_owned(), cause };
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(io)?;
        file.take(MOST_JSON_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 > MOST_JSON_BYTES {
            let found = format!("over {MOST_JSON_BYTES} bytes of JSON");
            return Err(Error::UnknownInput { path: path.to_owned(), found });
        }
        Ok(Self::Results(Box::new(Results::of_json(path, &bytes)?)))
    }
}

/// Whether a path is a pipe, which is read once and from its beginning.
fn is_stream(path: &Path) -> bool {
    !storage::is_url(path) && path.metadata().is_ok_and(|about| !about.is_file() && !about.is_dir())
}
