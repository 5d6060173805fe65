//! Output under a temporary name until it is whole.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::Error;

/// Temporary names that are in use, for [`discard_unfinished`].
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Removes every unfinished output of this process: what a program does when it is interrupted.
pub fn discard_unfinished() {
    for path in UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        // Other threads go on writing: a file that appears in a folder while it is emptied keeps it from going.
        // Nothing more can be done about a temporary file that cannot be removed.
        let _ = (0..100).find(|_| remove(path).is_ok());
    }
}

/// A file or folder that gets its final name when it is finished, and vanishes when it is not.
///
/// The temporary name lies beside the final one, so that renaming is atomic: `.NAME.<pid>.partial`.
#[derive(Debug)]
pub(crate) struct Partial {
    target: PathBuf,
    temporary: PathBuf,
    finished: bool,
    force: bool,
}

impl Partial {
    /// Reserves the place; refuses when something stands there and `force` is not given.
    pub(crate) fn new(target: &Path, force: bool) -> Result<Self, Error> {
        if !force && target.symlink_metadata().is_ok() {
            return Err(Error::Exists { path: target.to_owned() });
        }
        let name = target.file_name().ok_or_else(|| Error::Io {
            path: target.to_owned(),
            cause: io::Error::new(io::ErrorKind::InvalidInput, "the output has no file name"),
        })?;
        let parent =
            target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(Error::io(parent))?;
        let temporary = parent.join(format!(".{}.{}.partial", name.to_string_lossy(), std::process::id()));
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).insert(temporary.clone());
        Ok(Self { target: target.to_owned(), temporary, finished: false, force })
    }

    /// The temporary name.
    pub(crate) fn path(&self) -> &Path {
        &self.temporary
    }

    /// Opens the temporary file for writing.
    pub(super) fn create_file(&self) -> Result<File, Error> {
        File::create(&self.temporary).map_err(Error::io(&self.temporary))
    }

    /// Makes the temporary folder, empty.
    pub(crate) fn create_folder(&self) -> Result<(), Error> {
        remove(&self.temporary).map_err(Error::io(&self.temporary))?;
        fs::create_dir(&self.temporary).map_err(Error::io(&self.temporary))
    }

    /// Gives the output its final name; what stood there before goes only now.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        let failed = Error::io(&self.target);
        if self.target.symlink_metadata().is_ok() {
            if !self.force {
                return Err(Error::Exists { path: self.target.clone() });
            }
            if self.target.is_dir() || self.temporary.is_dir() {
                // A folder cannot be renamed over another: the old one steps aside first.
                let aside = self.temporary.with_extension("old");
                let result = fs::rename(&self.target, &aside)
                    .and_then(|()| {
                        fs::rename(&self.temporary, &self.target).inspect_err(|_| {
                            let _ = fs::rename(&aside, &self.target);
                        })
                    })
                    .and_then(|()| remove(&aside));
                result.map_err(failed)?;
                self.finished = true;
                return Ok(());
            }
        }
        fs::rename(&self.temporary, &self.target).map_err(failed)?;
        self.finished = true;
        Ok(())
    }
}

fn remove(path: &Path) -> io::Result<()> {
    match path.symlink_metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if !self.finished {
            // Nothing more can be done about a temporary file that cannot be removed.
            let _ = remove(&self.temporary);
        }
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.temporary);
    }
}
