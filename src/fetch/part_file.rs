//! A file that is not whole yet, and what is known of it.

use std::fs::{self, File, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::http::Version;
use super::{Error, checksum};
use crate::structure::hex;

/// What a server said of the file that is being downloaded.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Known {
    url: String,
    #[serde(flatten)]
    version: Version,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
}

impl Known {
    /// What is noted beside a file; nothing where that cannot be read.
    fn of(whole: &Path) -> Self {
        let note = fs::read(with_ending(whole, ".part.json")).ok();
        note.and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default()
    }
}

/// `FILE.part`, open and locked, with `FILE.part.json` beside it.
pub(super) struct PartFile {
    path: PathBuf,
    file: File,
    digest: Sha256,
    length: u64,
    known: Known,
}

impl PartFile {
    /// Opens what is there, or begins.
    pub(super) fn open(whole: &Path) -> Result<Self, Error> {
        let path = with_ending(whole, ".part");
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(Error::io(&path))?;
        // Where files cannot be locked, whoever starts two downloads of one file has to know.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(Error::Busy { path });
        }
        let mut part = Self { path, file, digest: Sha256::new(), length: 0, known: Known::of(whole) };
        part.length = checksum::add(&part.file, &mut part.digest).map_err(Error::io(&part.path))?;
        Ok(part)
    }

    /// Where a download has begun, if there is one.
    pub(super) fn url_of(whole: &Path) -> Option<String> {
        let known = Known::of(whole);
        (!known.url.is_empty()).then_some(known.url)
    }

    /// Whether what is there comes from a URL.
    pub(super) fn is_from(&self, url: &str) -> bool {
        self.known.url == url
    }

    /// Bytes that are there.
    pub(super) const fn length(&self) -> u64 {
        self.length
    }

    /// Length of the whole file, where it is known.
    pub(super) const fn total(&self) -> Option<u64> {
        self.known.bytes
    }

    /// Which version of the file it is, if it comes from a URL and can go on.
    pub(super) fn version_of(&self, url: &str) -> Option<&Version> {
        let same = self.is_from(url) && self.known.version.validator().is_some();
        (same && self.length > 0).then_some(&self.known.version)
    }

    /// Throws away what is there, and notes what comes.
    pub(super) fn start_over(
        &mut self,
        url: &str,
        version: Version,
        bytes: Option<u64>,
    ) -> Result<(), Error> {
        self.known = Known { url: url.to_owned(), version, bytes };
        self.file
            .set_len(0)
            .and_then(|()| self.file.seek(SeekFrom::Start(0)))
            .map_err(Error::io(&self.path))?;
        (self.digest, self.length) = (Sha256::new(), 0);
        let note = with_ending(&self.path, ".json");
        let text = serde_json::to_vec_pretty(&self.known).unwrap_or_default();
        fs::write(&note, text).map_err(Error::io(&note))
    }

    /// Adds bytes.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), Error> {
        // What was written before the disk was full stays, and counts.
        self.file.write_all(bytes).map_err(|cause| {
            let _ = self.file.set_len(self.length);
            let _ = self.file.seek(SeekFrom::Start(self.length));
            Error::io(&self.path)(cause)
        })?;
        self.digest.update(bytes);
        self.length += bytes.len() as u64;
        Ok(())
    }

    /// The digest of what is there.
    pub(super) fn sha256(&self) -> String {
        hex(&self.digest.clone().finalize())
    }

    /// The file that is there so far.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name.
    pub(super) fn finish(self, whole: &Path) -> Result<(), Error> {
        self.file.sync_all().map_err(Error::io(&self.path))?;
        fs::rename(&self.path, whole).map_err(Error::io(whole))?;
        remove(&with_ending(&self.path, ".json"))
    }

    /// Removes what is there.
    pub(super) fn discard(self) -> Result<(), Error> {
        remove(&self.path)?;
        remove(&with_ending(&self.path, ".json"))
    }
}

fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// Removes a file that may not be there.
pub(super) fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path)(error)),
        _ => Ok(()),
    }
}
