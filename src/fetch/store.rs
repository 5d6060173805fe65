//! Whole files on this disk: those of earlier runs, and those of a mirror.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{Error, checksum};
use crate::archive::{self, Kind};
use crate::datasets::RemoteFile;

/// Holds a file against its recipe.
///
/// * `place` — URL or path, for the error.
pub(super) fn check(
    file: &RemoteFile,
    place: &str,
    path: &Path,
    bytes: u64,
    sha256: &str,
) -> Result<(), Error> {
    let (place, name) = (place.to_owned(), file.file_name().to_owned());
    // First what people understand: a page that asks to sign in has a wrong digest, too.
    if file.unpack {
        match Kind::of(path) {
            Ok(_) => {}
            Err(archive::Error::Kind { found, .. }) => {
                return Err(Error::NotAnArchive { place, file: name, found });
            }
            Err(error) => return Err(error.into()),
        }
    }
    if let Some(expected) = file.bytes.filter(|expected| *expected != bytes) {
        return Err(Error::Length { place, file: name, expected, found: bytes });
    }
    match &file.sha256 {
        Some(expected) if expected != sha256 => {
            let (expected, found) = (expected.clone(), sha256.to_owned());
            Err(Error::Checksum { place, file: name, expected, found })
        }
        _ => Ok(()),
    }
}

/// A whole file, checked: where it is, its length and its digest.
pub(super) struct Stored {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    pub(super) sha256: String,
}

/// Looks at a whole file.
pub(super) fn stored(file: &RemoteFile, path: &Path) -> Result<Stored, Error> {
    // Before all of it is read.
    let mut beginning = [0];
    let _ = File::open(path).and_then(|mut file| file.read(&mut beginning)).map_err(Error::io(path))?;
    let (bytes, sha256) = checksum::of_file(path)?;
    check(file, &path.display().to_string(), path, bytes, &sha256)?;
    Ok(Stored { path: path.to_owned(), bytes, sha256 })
}
