//! An archive unpacked for as long as it is read.

use std::path::Path;

use super::{Error, Limits, Selection, extract};
use crate::unfinished::Unfinished;

/// What an archive holds, in a folder that goes with this value, or when the program is interrupted.
#[derive(Debug)]
pub struct Temporary {
    folder: Unfinished,
}

impl Temporary {
    /// Unpacks an archive into a folder beside an output that is to be made of it.
    ///
    /// * `progress` — told how many bytes of the archive are done, and of how many.
    ///
    /// # Errors
    /// Those of [`unpack`](super::unpack); nothing is left then.
    pub fn unpack(
        archive: &Path,
        output: &Path,
        limits: &Limits,
        progress: &dyn Fn(u64, u64),
    ) -> Result<Self, Error> {
        let mut name = output.file_name().unwrap_or_default().to_owned();
        name.push(".unpacked");
        let folder = Unfinished::beside(&output.with_file_name(name)).map_err(Error::io(output))?;
        folder.create_folder().map_err(Error::io(folder.path()))?;
        extract(archive, folder.path(), &Selection::Everything, limits, progress)?;
        Ok(Self { folder })
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }
}
