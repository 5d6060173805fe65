//! A file read at any place, by any number of readers, with the bytes counted.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytes::Bytes;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::reader::{ChunkReader, Length};

use super::Error;
use crate::storage::Source;

/// A shared file; clones read independently of each other.
#[derive(Clone, Debug)]
pub(super) struct CountedFile {
    source: Arc<Source>,
    path: Arc<PathBuf>,
    bytes_read: Arc<AtomicU64>,
}

impl CountedFile {
    /// Opens a file; `bytes_read` is added to by every read.
    pub(super) fn open(path: &Path, bytes_read: Arc<AtomicU64>) -> Result<Self, Error> {
        let source = Source::open(path).map_err(Error::io(path))?;
        Ok(Self { source: Arc::new(source), path: Arc::new(path.to_owned()), bytes_read })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn length(&self) -> u64 {
        self.source.length()
    }

    /// Reads some bytes at a place; fewer at the end of the file.
    pub(super) fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read_at(offset, buffer)?;
        self.bytes_read.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }

    /// Reads exactly `length` bytes; refuses before allocating when the file is shorter.
    pub(super) fn read_exact_at(&self, offset: u64, length: usize) -> io::Result<Vec<u8>> {
        if offset.checked_add(length as u64).is_none_or(|end| end > self.length()) {
            return Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                format!("{length} bytes at {offset} reach beyond the file's {} bytes", self.length()),
            ));
        }
        let mut buffer = vec![0; length];
        let mut filled = 0;
        while filled < length {
            match self.read_at(offset + filled as u64, &mut buffer[filled..])? {
                0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                read => filled += read,
            }
        }
        Ok(buffer)
    }
}

impl Length for CountedFile {
    fn len(&self) -> u64 {
        self.length()
    }
}

impl ChunkReader for CountedFile {
    type T = io::BufReader<Cursor>;

    fn get_read(&self, start: u64) -> ParquetResult<Self::T> {
        // Small, because page headers are read through it and the rest of the buffer is thrown away.
        Ok(io::BufReader::with_capacity(512, Cursor { file: self.clone(), position: start }))
    }

    fn get_bytes(&self, start: u64, length: usize) -> ParquetResult<Bytes> {
        Ok(self.read_exact_at(start, length).map_err(|error| ParquetError::External(Box::new(error)))?.into())
    }
}

/// A place in a [`CountedFile`] that moves as it is read.
pub(super) struct Cursor {
    file: CountedFile,
    position: u64,
}

impl Read for Cursor {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read_at(self.position, buffer)?;
        self.position += read as u64;
        Ok(read)
    }
}
