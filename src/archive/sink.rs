//! The folder that is unpacked to.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::Error;
use super::entry_name::{place_of, shown};
use super::metered::RUN_OUT;
use super::unpack::{Selection, Unpacked};
use super::{Kind, Limits};

/// Bytes that are copied at a time.
const CHUNK: usize = 1 << 18;

/// Where entries go, with what was counted on the way.
pub(super) struct Sink<'a> {
    pub(super) archive: &'a Path,
    pub(super) kind: Kind,
    pub(super) limits: &'a Limits,
    /// Bytes that the archive may become.
    pub(super) permitted: u64,
    folder: &'a Path,
    selection: &'a Selection,
    /// Folders that are there, below [`folder`](Self::folder).
    made: BTreeSet<PathBuf>,
    buffer: Vec<u8>,
    entries: u64,
    done: Unpacked,
}

/// What kind of thing an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EntryKind {
    File,
    Folder,
    /// Links and devices: counted and left out.
    Other,
}

impl<'a> Sink<'a> {
    pub(super) fn new(
        archive: &'a Path,
        kind: Kind,
        folder: &'a Path,
        selection: &'a Selection,
        limits: &'a Limits,
        archive_bytes: u64,
    ) -> Self {
        Self {
            archive,
            kind,
            limits,
            permitted: limits.bytes_of(archive_bytes),
            folder,
            selection,
            made: BTreeSet::new(),
            buffer: vec![0; CHUNK],
            entries: 0,
            done: Unpacked::default(),
        }
    }

    /// Where an entry is to be written; `None` where it is not wanted, or no file.
    pub(super) fn admit(&mut self, name: &[u8], kind: EntryKind) -> Result<Option<PathBuf>, Error> {
        self.entries += 1;
        if self.entries > self.limits.entries {
            return Err(self.too_much("entries", self.limits.entries));
        }
        let wrong = |reason| Error::Name { archive: self.archive.to_owned(), name: shown(name), reason };
        let place = place_of(name, self.limits.name_bytes).map_err(wrong)?;
        if !self.selection.wants(&place) {
            return Ok(None);
        }
        match kind {
            EntryKind::Folder => {
                self.make_folders(&place, name)?;
                Ok(None)
            }
            EntryKind::Other => {
                self.done.left_out += 1;
                Ok(None)
            }
            EntryKind::File if place.as_os_str().is_empty() => Err(wrong("a file has no name")),
            EntryKind::File => {
                self.make_folders(place.parent().unwrap_or(Path::new("")), name)?;
                Ok(Some(place))
            }
        }
    }

    /// Writes an admitted file.
    pub(super) fn write(&mut self, place: &Path, name: &[u8], mut from: impl Read) -> Result<(), Error> {
        let path = self.folder.join(place);
        let mut file = match File::create_new(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Err(self.twice(name)),
            Err(error) => return Err(Error::io(&path)(error)),
        };
        loop {
            let length = match from.read(&mut self.buffer) {
                Ok(0) => break,
                Ok(length) => length,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(self.damaged(Some(name), error)),
            };
            file.write_all(&self.buffer[..length]).map_err(Error::io(&path))?;
            self.done.bytes += length as u64;
        }
        self.done.files += 1;
        Ok(())
    }

    /// What was unpacked.
    pub(super) fn finish(self) -> Result<Unpacked, Error> {
        if self.done.files == 0 {
            return Err(Error::Nothing {
                archive: self.archive.to_owned(),
                expected: self.selection.expected(),
                entries: self.entries,
            });
        }
        Ok(self.done)
    }

    /// Makes folders below the one that is unpacked to, which is there; it is never made again, so that nothing
    /// appears where an interrupted program has removed it.
    fn make_folders(&mut self, place: &Path, name: &[u8]) -> Result<(), Error> {
        let mut path = PathBuf::new();
        for part in place.components() {
            path.push(part);
            if self.made.contains(&path) {
                continue;
            }
            let whole = self.folder.join(&path);
            match fs::create_dir(&whole) {
                Ok(()) => {}
                // One that is there from another archive is as good; but not a link to a folder elsewhere.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    if !whole.symlink_metadata().is_ok_and(|found| found.is_dir()) {
                        return Err(self.twice(name));
                    }
                }
                Err(error) => return Err(Error::io(&whole)(error)),
            }
            self.made.insert(path.clone());
        }
        Ok(())
    }

    fn twice(&self, name: &[u8]) -> Error {
        Error::Twice { archive: self.archive.to_owned(), name: shown(name) }
    }

    pub(super) fn too_much(&self, what: &'static str, limit: u64) -> Error {
        Error::TooMuch { archive: self.archive.to_owned(), what, limit }
    }

    /// What an error while reading means.
    pub(super) fn damaged(&self, name: Option<&[u8]>, error: io::Error) -> Error {
        if error.kind() == RUN_OUT {
            return self.too_much("bytes", self.permitted);
        }
        let detail = match error.kind() {
            io::ErrorKind::UnexpectedEof => "it ends too early".to_owned(),
            _ => error.to_string(),
        };
        let kind = self.kind.name();
        Error::Damaged { archive: self.archive.to_owned(), kind, entry: name.map(shown), detail }
    }
}
