//! What can go wrong with a trajectory file.

use std::io;

/// A trajectory file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryFileError {
    /// The file does not hold what it should.
    #[error("{}expected {expected}, found {found}", line.map(|line| format!("line {line}: ")).unwrap_or_default())]
    Content {
        /// The line, counted from 1, where it is the matter of a line.
        line: Option<usize>,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// The system could not read or write.
    #[error(transparent)]
    Io(#[from] io::Error),
}

impl TrajectoryFileError {
    /// Content of a line that cannot be used; long findings are cut.
    pub(super) fn content(
        line: impl Into<Option<usize>>,
        expected: &str,
        found: impl std::fmt::Display,
    ) -> Self {
        let mut found = found.to_string();
        if let Some((cut, _)) = found.char_indices().nth(60) {
            found.truncate(cut);
            found.push('…');
        }
        Self::Content { line: line.into(), expected: expected.to_owned(), found }
    }
}
