//! Bytes at any place of a file, for any number of readers.

use std::fs;
use std::io;
use std::path::Path;

use super::Object;
#[cfg(feature = "remote")]
use super::object_file::ObjectFile;

/// A file that is open for reading.
#[derive(Debug)]
pub(crate) enum Source {
    /// On this machine, and how long it is.
    Local(fs::File, u64),
    /// In an object store.
    #[cfg(feature = "remote")]
    Remote(ObjectFile),
}

impl Source {
    /// Opens a file.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        match Object::at(path)? {
            #[cfg(feature = "remote")]
            Some(object) => Ok(Self::Remote(ObjectFile::open(object)?)),
            #[cfg(not(feature = "remote"))]
            Some(object) => match object {},
            None => {
                let file = fs::File::open(path)?;
                let length = file.metadata()?.len();
                Ok(Self::Local(file, length))
            }
        }
    }

    /// Its bytes in all.
    pub(crate) const fn length(&self) -> u64 {
        match self {
            Self::Local(_, length) => *length,
            #[cfg(feature = "remote")]
            Self::Remote(file) => file.length(),
        }
    }

    /// Reads some bytes at a place; fewer at the end of the file.
    pub(crate) fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Local(file, _) => read_at(file, offset, buffer),
            #[cfg(feature = "remote")]
            Self::Remote(file) => file.read_at(offset, buffer),
        }
    }
}

/// Reads some bytes at a place of a file, wherever others read: a process that was forked shares the file with its parent.
#[cfg(unix)]
pub(super) fn read_at(file: &fs::File, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, offset)
}

/// Reads some bytes at a place of a file, wherever others read.
#[cfg(windows)]
pub(super) fn read_at(file: &fs::File, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, offset)
}
