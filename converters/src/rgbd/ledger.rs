//! What could not be used, counted.

use std::path::Path;

use open_structure::structure::Exclusion;

use super::Error;

/// What could not be used, counted; or an error, where nothing may be left out.
#[derive(Debug)]
pub(super) struct Ledger {
    keep_going: bool,
    excluded: Vec<Exclusion>,
}

impl Ledger {
    /// An empty one; `keep_going` says whether bad lines may be left out.
    pub(super) const fn new(keep_going: bool) -> Self {
        Self { keep_going, excluded: Vec::new() }
    }

    /// Whether bad lines may be left out.
    pub(super) const fn keeps_going(&self) -> bool {
        self.keep_going
    }

    /// Counts a line that cannot be used.
    ///
    /// # Errors
    /// The error itself, unless lines may be left out.
    pub(super) fn refuse(&mut self, error: Error) -> Result<(), Error> {
        match error {
            Error::Line { path, line, expected, .. } if self.keep_going => {
                self.count(&path, &format!("expected {expected}"), 1, Some(line));
                Ok(())
            }
            other => Err(other),
        }
    }

    /// Counts what is left out in any case.
    pub(super) fn count(&mut self, path: &Path, reason: &str, count: u64, first_line: Option<u64>) {
        if count == 0 {
            return;
        }
        let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        match self.excluded.iter_mut().find(|known| known.file == file && known.reason == reason) {
            Some(known) => {
                known.count += count;
                known.first_line = known.first_line.into_iter().chain(first_line).min();
            }
            None => self.excluded.push(Exclusion { file, reason: reason.to_owned(), count, first_line }),
        }
    }

    /// What was counted, by file and reason.
    pub(super) fn finish(mut self) -> Vec<Exclusion> {
        self.excluded.sort_by(|a, b| (&a.file, &a.reason).cmp(&(&b.file, &b.reason)));
        self.excluded
    }
}
