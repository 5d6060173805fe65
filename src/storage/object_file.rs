//! An object that is read in blocks, the last ones kept.

use std::fs;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

use bytes::Bytes;

use super::object::Object;
use super::source;

/// Bytes of a block: about what a network delivers in the time that a request takes.
const BLOCK: usize = 1 << 18;
/// Blocks that are fetched at once by who reads on from block to block.
const AHEAD: u64 = 8;
/// Blocks that are kept: each column of a table is read at a place of its own.
const KEPT: usize = 128;

/// An object that is open for reading.
#[derive(Debug)]
pub(crate) struct ObjectFile {
    object: Object,
    length: u64,
    /// Tells this state of the object from another.
    tag: Option<String>,
    /// Blocks by number, the one used last at the end.
    blocks: Mutex<Vec<(u64, Bytes)>>,
    /// The whole object, where the server gives no parts.
    whole: Mutex<Option<fs::File>>,
}

impl ObjectFile {
    pub(super) fn open(object: Object) -> io::Result<Self> {
        let (length, tag) = object.state()?;
        Ok(Self { object, length, tag, blocks: Mutex::default(), whole: Mutex::default() })
    }

    pub(super) const fn length(&self) -> u64 {
        self.length
    }

    /// Reads some bytes at a place; fewer at the end of a block or of the object.
    pub(super) fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        if offset >= self.length || buffer.is_empty() {
            return Ok(0);
        }
        if let Some(whole) = self.whole.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
            return source::read_at(whole, offset, buffer);
        }
        let number = offset / BLOCK as u64;
        let block = match self.kept(number).map_or_else(|| self.fetch(number), Ok) {
            Err(error) if error.kind() == io::ErrorKind::Unsupported => {
                self.fetch_whole()?;
                return self.read_at(offset, buffer);
            }
            block => block?,
        };
        let start = usize::try_from(offset % BLOCK as u64).unwrap_or(BLOCK);
        let rest = block.get(start..).unwrap_or_default();
        if rest.is_empty() {
            return Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                "the store gave fewer bytes than were asked for",
            ));
        }
        let read = rest.len().min(buffer.len());
        buffer[..read].copy_from_slice(&rest[..read]);
        Ok(read)
    }

    fn kept(&self, number: u64) -> Option<Bytes> {
        let mut blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
        let place = blocks.iter().position(|(kept, _)| *kept == number)?;
        let block = blocks.remove(place);
        let bytes = block.1.clone();
        blocks.push(block);
        Some(bytes)
    }

    /// Fetches a block, and some behind it where the one before was read.
    fn fetch(&self, number: u64) -> io::Result<Bytes> {
        let reads_on = number > 0 && self.kept(number - 1).is_some();
        let count = if reads_on { AHEAD } else { 1 };
        let end = (number + count).saturating_mul(BLOCK as u64).min(self.length);
        let fetched = self.object.range(number * BLOCK as u64..end, self.tag.as_deref())?;
        let mut blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
        for (place, start) in (0..fetched.len()).step_by(BLOCK).enumerate() {
            let block = fetched.slice(start..fetched.len().min(start + BLOCK));
            if blocks.len() == KEPT {
                blocks.remove(0);
            }
            blocks.push((number + place as u64, block));
        }
        drop(blocks);
        Ok(fetched.slice(..fetched.len().min(BLOCK)))
    }

    /// Copies the object to this machine; the copy goes with its last reader.
    fn fetch_whole(&self) -> io::Result<()> {
        let mut whole = self.whole.lock().unwrap_or_else(PoisonError::into_inner);
        if whole.is_none() {
            let mut file = tempfile::tempfile()?;
            self.object.fetch(&mut |part| file.write_all(part))?;
            if file.metadata()?.len() != self.length {
                return Err(io::Error::new(
                    io::ErrorKind::UnexpectedEof,
                    "the object changed while it was read",
                ));
            }
            *whole = Some(file);
        }
        Ok(())
    }
}
