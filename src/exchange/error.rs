//! What can go wrong on the way to or from a format of another program.

use std::io;

use crate::structure::TrajectoryFileError;

/// Data that cannot be exchanged.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file does not hold what it should.
    #[error("{}expected {expected}, found {found}", place(file, *line))]
    Content {
        /// The file, where a format has several.
        file: &'static str,
        /// The line, counted from 1, where it is the matter of a line.
        line: Option<usize>,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A model or a graph is whole, but the other side has no place for it.
    #[error("{what}: expected {expected}, found {found}")]
    Unfit {
        /// What it is about, such as a graph and its vertex.
        what: String,
        /// What could be exchanged.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A trajectory file cannot be read or written.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryFileError),
    /// The system could not read or write.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn place(file: &str, line: Option<usize>) -> String {
    let line = line.map(|line| format!("line {line}: ")).unwrap_or_default();
    match (file, line.is_empty()) {
        ("", _) => line,
        (file, true) => format!("{file}: "),
        (file, false) => format!("{file} {line}"),
    }
}

impl Error {
    /// Content of a file that cannot be used; long findings are cut.
    pub(super) fn content(
        file: &'static str,
        line: impl Into<Option<usize>>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Content { file, line: line.into(), expected: expected.into(), found: cut(found.to_string()) }
    }

    /// Something for which the other side has no place.
    pub(super) fn unfit(what: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Unfit { what: what.into(), expected: expected.into(), found: cut(found.to_string()) }
    }
}

fn cut(mut text: String) -> String {
    if let Some((at, _)) = text.char_indices().nth(80) {
        text.truncate(at);
        text.push('…');
    }
    text
}
