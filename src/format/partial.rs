//! Output under a temporary name until it is whole.

use std::fs::File;
use std::path::Path;

use super::Error;
use crate::storage::{self, Found};
use crate::unfinished::Unfinished;

pub use crate::unfinished::discard as discard_unfinished;

/// A file or folder that gets its final name when it is finished, and vanishes when it is not.
#[derive(Debug)]
pub(crate) struct Partial {
    unfinished: Unfinished,
    force: bool,
}

impl Partial {
    /// Reserves the place; refuses when something stands there and `force` is not given, and always what is neither file nor folder.
    pub(crate) fn new(target: &Path, force: bool) -> Result<Self, Error> {
        if !force && storage::is_taken(target).map_err(Error::io(target))? {
            return Err(Error::Exists { path: target.to_owned() });
        }
        if storage::find(target).is_ok_and(|found| found == Found::Other) {
            return Err(not_replaced(target, "a file or a folder", "a device or the like"));
        }
        Ok(Self { unfinished: Unfinished::beside(target).map_err(Error::io(target))?, force })
    }

    /// As [`Partial::new`], for a file: refuses a folder.
    pub(crate) fn file(target: &Path, force: bool) -> Result<Self, Error> {
        let partial = Self::new(target, force)?;
        if storage::is_folder(target) {
            return Err(not_replaced(target, "a file", "a folder"));
        }
        Ok(partial)
    }

    /// As [`Partial::new`], for a folder: refuses a file, and a folder with anything in it that is not such an output's own.
    pub(crate) fn folder(
        target: &Path,
        force: bool,
        is_member: impl Fn(&str) -> bool,
    ) -> Result<Self, Error> {
        let partial = Self::new(target, force)?;
        let found = storage::find(target);
        if matches!(found, Ok(Found::File(_))) {
            return Err(not_replaced(target, "a folder", "a file"));
        }
        if matches!(found, Ok(Found::Folder)) {
            // Over HTTP nothing can be listed, and nothing but the new files is touched.
            for entry in storage::list(target, &[]).map_err(Error::io(target))? {
                let name = entry.name.to_string_lossy();
                if !is_member(&name) {
                    return Err(not_replaced(
                        target,
                        "a folder with nothing else in it",
                        &format!("`{name}` in it"),
                    ));
                }
            }
        }
        Ok(partial)
    }

    /// The temporary name.
    pub(crate) fn path(&self) -> &Path {
        self.unfinished.path()
    }

    /// Opens the temporary file for writing.
    pub(super) fn create_file(&self) -> Result<File, Error> {
        File::create(self.path()).map_err(Error::io(self.path()))
    }

    /// Makes the temporary folder, empty.
    pub(crate) fn create_folder(&self) -> Result<(), Error> {
        self.unfinished.create_folder().map_err(Error::io(self.path()))
    }

    /// Gives the output its final name; what stood there before goes only now.
    pub(crate) fn finish(self) -> Result<(), Error> {
        let target = self.unfinished.target().to_owned();
        if !self.force && storage::is_taken(&target).map_err(Error::io(&target))? {
            return Err(Error::Exists { path: target });
        }
        self.unfinished.finish().map_err(Error::io(&target))
    }
}

fn not_replaced(path: &Path, expected: &'static str, found: &str) -> Error {
    Error::NotReplaced { path: path.to_owned(), expected, found: found.to_owned() }
}
