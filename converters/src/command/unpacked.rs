//! A dataset's folder, or an archive of it.

use open_structure::archive::{Limits, Temporary};
use std::path::{Path, PathBuf};

/// Where a dataset lies; an archive is unpacked for as long as this is held.
pub(super) enum Input {
    Folder(PathBuf),
    Archive(Temporary),
}

impl Input {
    /// A folder as it is, an archive unpacked beside the output.
    pub(super) fn of(
        path: &Path,
        output: &Path,
        progress: &dyn Fn(&'static str, u64, u64),
    ) -> anyhow::Result<Self> {
        if !path.is_file() {
            return Ok(Self::Folder(path.to_owned()));
        }
        let unpacking = |done, total| progress("unpacking", done, total);
        Ok(Self::Archive(Temporary::unpack(path, output, &Limits::default(), &unpacking)?))
    }

    pub(super) fn folder(&self) -> &Path {
        match self {
            Self::Folder(folder) => folder,
            Self::Archive(unpacked) => unpacked.folder(),
        }
    }
}
