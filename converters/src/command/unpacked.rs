//! A dataset's folder, or an archive of it.

use std::path::Path;

use anyhow::Context;
use open_structure::archive::{Limits, Temporary};
use open_structure::storage::Local;

/// Where a dataset lies; an archive is unpacked, and what a URL names is copied, for as long as this is held.
pub(super) enum Input {
    Folder(Local),
    Archive(Temporary),
}

impl Input {
    /// A folder as it is, an archive unpacked beside the output.
    pub(super) fn of(
        path: &Path,
        output: &Path,
        progress: &dyn Fn(&'static str, u64, u64),
    ) -> anyhow::Result<Self> {
        let local = Local::of(path, &[]).with_context(|| path.display().to_string())?;
        if !local.path().is_file() {
            return Ok(Self::Folder(local));
        }
        let unpacking = |done, total| progress("unpacking", done, total);
        Ok(Self::Archive(Temporary::unpack(local.path(), output, &Limits::default(), &unpacking)?))
    }

    pub(super) fn folder(&self) -> &Path {
        match self {
            Self::Folder(folder) => folder.path(),
            Self::Archive(unpacked) => unpacked.folder(),
        }
    }
}
