//! Output under a temporary name until it is whole.

use std::fs::File;
use std::path::Path;

use super::Error;
use crate::unfinished::Unfinished;

pub use crate::unfinished::discard as discard_unfinished;

/// A file or folder that gets its final name when it is finished, and vanishes when it is not.
#[derive(Debug)]
pub(crate) struct Partial {
    unfinished: Unfinished,
    force: bool,
}

impl Partial {
    /// Reserves the place; refuses when something stands there and `force` is not given.
    pub(crate) fn new(target: &Path, force: bool) -> Result<Self, Error> {
        if !force && target.symlink_metadata().is_ok() {
            return Err(Error::Exists { path: target.to_owned() });
        }
        Ok(Self { unfinished: Unfinished::beside(target).map_err(Error::io(target))?, force })
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
        if !self.force && target.symlink_metadata().is_ok() {
            return Err(Error::Exists { path: target });
        }
        self.unfinished.finish().map_err(Error::io(&target))
    }
}
