//! Outputs under temporary names until they are whole, and what removes them when a program is interrupted.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::storage;

/// Temporary names that are in use, for [`discard`].
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Removes every unfinished output of this process: the last thing that a program does when it is interrupted.
///
/// A thread that begins or ends an output afterwards waits for the end of the process: it would fail for want of what
/// was removed here, and report that instead of the interruption.
pub fn discard() {
    let unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    for path in unfinished.iter() {
        // Other threads go on writing: a file that appears in a folder while it is emptied keeps it from going.
        // Nothing more can be done about a temporary file that cannot be removed.
        let _ = (0..100).find(|_| storage::remove(path).is_ok());
    }
    // Never unlocked.
    std::mem::forget(unfinished);
}

/// A file or folder beside its final name; it vanishes when it is not finished.
///
/// The temporary name is `.NAME.<pid>.partial`, in the same folder, so that renaming is atomic.
#[derive(Debug)]
pub(crate) struct Unfinished {
    target: PathBuf,
    temporary: PathBuf,
    finished: bool,
}

impl Unfinished {
    /// Reserves a temporary name; the folder that it lies in is made where it is missing. What a URL is to name lies in
    /// this machine's temporary folder until it is finished.
    pub(crate) fn beside(target: &Path) -> io::Result<Self> {
        let name = target
            .file_name()
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the output has no file name"))?;
        let parent = storage::workshop(target)?;
        let mut own = std::process::id().to_string();
        if storage::is_url(target) {
            // There outputs of other folders meet under one name.
            static NUMBER: AtomicU64 = AtomicU64::new(0);
            own = format!("{own}-{}", NUMBER.fetch_add(1, Ordering::Relaxed));
        }
        let temporary = parent.join(format!(".{}.{own}.partial", name.to_string_lossy()));
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).insert(temporary.clone());
        Ok(Self { target: target.to_owned(), temporary, finished: false })
    }

    /// The final name.
    pub(crate) fn target(&self) -> &Path {
        &self.target
    }

    /// The temporary name.
    pub(crate) fn path(&self) -> &Path {
        &self.temporary
    }

    /// Makes the temporary folder, empty.
    pub(crate) fn create_folder(&self) -> io::Result<()> {
        storage::remove(&self.temporary)?;
        fs::create_dir(&self.temporary)
    }

    /// Gives the output its final name; what stands there goes only now.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        if storage::is_url(&self.target) {
            // What was made here goes when this value does.
            return storage::send(&self.temporary, &self.target);
        }
        let occupied = self.target.symlink_metadata().is_ok();
        if occupied && (self.target.is_dir() || self.temporary.is_dir()) {
            // A folder cannot be renamed over another: the old one steps aside first.
            let aside = self.temporary.with_extension("old");
            fs::rename(&self.target, &aside)?;
            fs::rename(&self.temporary, &self.target).inspect_err(|_| {
                let _ = fs::rename(&aside, &self.target);
            })?;
            storage::remove(&aside)?;
        } else {
            fs::rename(&self.temporary, &self.target)?;
        }
        self.finished = true;
        Ok(())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.finished {
            // Nothing more can be done about a temporary file that cannot be removed.
            let _ = storage::remove(&self.temporary);
        }
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.temporary);
    }
}
