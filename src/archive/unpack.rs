//! Unpacking, whole or not at all.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use super::metered::Watched;
use super::sink::Sink;
use super::{Error, Kind, Limits, tar_archive, zip_archive};
use crate::unfinished::Unfinished;

/// What came out of an archive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unpacked {
    /// Files.
    pub files: u64,
    /// Bytes of all files.
    pub bytes: u64,
    /// Links and devices, which were left out.
    pub left_out: u64,
}

/// Which files of an archive are wanted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// All.
    #[default]
    Everything,
    /// Those below a folder of the archive, with all their folders.
    Below(PathBuf),
}

impl Selection {
    pub(super) fn wants(&self, place: &Path) -> bool {
        match self {
            Self::Everything => true,
            Self::Below(folder) => place.starts_with(folder),
        }
    }

    pub(super) fn expected(&self) -> String {
        match self {
            Self::Everything => "files".to_owned(),
            Self::Below(folder) => format!("files in {}", folder.display()),
        }
    }
}

/// Unpacks a zip, tar or tar.gz archive into a new folder.
///
/// * `into` — the folder; it appears when all is there, and not at all otherwise.
/// * `limits` — what the archive may hold at most.
/// * `progress` — told bytes of the archive that are read, and all.
///
/// Links and devices are left out and counted. Files get the permissions that new files have, and no time of the
/// archive's.
///
/// # Errors
/// Every one of [`Error`]; [`Error::Exists`] before anything is done.
pub fn unpack(
    archive: &Path,
    into: &Path,
    limits: &Limits,
    progress: &dyn Fn(u64, u64),
) -> Result<Unpacked, Error> {
    if into.symlink_metadata().is_ok() {
        return Err(Error::Exists { path: into.to_owned() });
    }
    let unfinished = Unfinished::beside(into).map_err(Error::io(into))?;
    unfinished.create_folder().map_err(Error::io(unfinished.path()))?;
    let unpacked = extract(archive, unfinished.path(), &Selection::Everything, limits, progress)?;
    if into.symlink_metadata().is_ok() {
        return Err(Error::Exists { path: into.to_owned() });
    }
    unfinished.finish().map_err(Error::io(into))?;
    Ok(unpacked)
}

/// Unpacks an archive, or a part of it, into a folder that is there, beside what is in it.
///
/// As [`unpack`], but what came before an error stays: the folder is the caller's to remove.
///
/// # Errors
/// Every one of [`Error`]; [`Error::Twice`] for a file that stands in the folder already.
pub fn extract(
    archive: &Path,
    folder: &Path,
    selection: &Selection,
    limits: &Limits,
    progress: &dyn Fn(u64, u64),
) -> Result<Unpacked, Error> {
    let kind = Kind::of(archive)?;
    let file = File::open(archive).map_err(Error::io(archive))?;
    let archive_bytes = file.metadata().map_err(Error::io(archive))?.len();
    let mut sink = Sink::new(archive, kind, folder, selection, limits, archive_bytes);
    // The buffer is outermost: the readers of headers ask for a few bytes at a time.
    let buffered = |file| BufReader::with_capacity(1 << 17, Watched::new(file, archive_bytes, progress));
    match kind {
        // Small, for the headers are far apart.
        Kind::Zip => zip_archive::extract(BufReader::new(file), archive_bytes, progress, &mut sink)?,
        Kind::Tar => tar_archive::extract(buffered(file), &mut sink)?,
        Kind::TarGz => {
            tar_archive::extract(flate2::bufread::MultiGzDecoder::new(buffered(file)), &mut sink)?;
        }
    }
    sink.finish()
}
