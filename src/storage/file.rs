//! A file that is read from its beginning, or from any other place.

use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use super::Source;

/// A file on this machine or in an object store, open for reading; of an object only what is read is fetched.
#[derive(Clone, Debug)]
pub struct File {
    source: Arc<Source>,
    position: u64,
}

impl File {
    /// Opens a file.
    ///
    /// # Errors
    /// Those of the file system or the network.
    pub fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { source: Arc::new(Source::open(path)?), position: 0 })
    }

    /// Its bytes in all.
    #[must_use]
    pub fn length(&self) -> u64 {
        self.source.length()
    }
}

impl Read for File {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read_at(self.position, buffer)?;
        self.position += read as u64;
        Ok(read)
    }
}

impl Seek for File {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::End(offset) => self.length().checked_add_signed(offset),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
        };
        self.position =
            position.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "before the beginning"))?;
        Ok(self.position)
    }
}
