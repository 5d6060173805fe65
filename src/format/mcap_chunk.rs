//! Chunks of an MCAP file, held against their checksums while they are decompressed.
//!
//! The indexed reader of the crate `mcap` never sees the header of a chunk, where the checksum stands; so it is read along with the
//! chunk, and compared by the decompressors that are registered here.

use std::io::{self, Read as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crc32fast::Hasher;
use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::sans_io::indexed_reader::IndexedReader;
use mcap::{McapError, McapResult};
use zstd::zstd_safe::{DCtx, InBuffer, OutBuffer, ResetDirective, get_error_name};

/// Bytes of a chunk's header from its checksum to its contents, without the name of its compression.
pub(super) const AFTER_CHECKSUM: u64 = 4 + 4 + 8;

/// The checksum of the chunk that is decompressed next; 0 where its writer computed none.
#[derive(Clone, Debug, Default)]
pub(super) struct Checksum(Arc<AtomicU32>);

impl Checksum {
    /// Says what the next chunk's checksum is.
    pub(super) fn expect(&self, checksum: u32) {
        self.0.store(checksum, Ordering::Relaxed);
    }

    /// Compares a chunk that is not compressed, which no decompressor sees.
    pub(super) fn check(&self, bytes: &[u8]) -> McapResult<()> {
        self.compare(crc32fast::hash(bytes))
    }

    /// Has a reader check what it decompresses.
    pub(super) fn checked_by(&self, reader: &mut IndexedReader) -> McapResult<()> {
        reader.add_decompressor(Checked::new(self, Zstd(DCtx::create())))?;
        reader.add_decompressor(Checked::new(self, Lz4))
    }

    fn compare(&self, calculated: u32) -> McapResult<()> {
        match self.0.load(Ordering::Relaxed) {
            saved if saved == 0 || saved == calculated => Ok(()),
            saved => Err(McapError::BadChunkCrc { saved, calculated }),
        }
    }
}

/// A way of compressing.
trait Codec: Send {
    const NAME: &'static str;

    fn decompress(&mut self, from: &[u8], into: &mut [u8]) -> McapResult<DecompressResult>;

    fn reset(&mut self) -> McapResult<()>;
}

/// Decompresses, and compares checksums.
struct Checked<C> {
    codec: C,
    expected: Checksum,
    hasher: Hasher,
}

impl<C> Checked<C> {
    fn new(expected: &Checksum, codec: C) -> Self {
        Self { codec, expected: expected.clone(), hasher: Hasher::new() }
    }
}

impl<C: Codec> Decompressor for Checked<C> {
    fn next_read_size(&self) -> usize {
        0
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        let done = self.codec.decompress(src, dst)?;
        self.hasher.update(&dst[..done.wrote]);
        Ok(done)
    }

    fn reset(&mut self) -> McapResult<()> {
        self.codec.reset()?;
        self.expected.compare(std::mem::take(&mut self.hasher).finalize())
    }

    fn name(&self) -> &'static str {
        C::NAME
    }
}

struct Zstd(DCtx<'static>);

impl Codec for Zstd {
    const NAME: &'static str = "zstd";

    fn decompress(&mut self, from: &[u8], into: &mut [u8]) -> McapResult<DecompressResult> {
        let (mut from, mut into) = (InBuffer::around(from), OutBuffer::around(into));
        self.0.decompress_stream(&mut into, &mut from).map_err(named)?;
        Ok(DecompressResult { consumed: from.pos, wrote: into.pos() })
    }

    fn reset(&mut self) -> McapResult<()> {
        self.0.reset(ResetDirective::SessionOnly).map(drop).map_err(named)
    }
}

fn named(code: usize) -> McapError {
    McapError::DecompressionError(get_error_name(code).to_owned())
}

/// Chunks are in memory as a whole, so that each call gets all that is left of one.
struct Lz4;

impl Codec for Lz4 {
    const NAME: &'static str = "lz4";

    fn decompress(&mut self, from: &[u8], into: &mut [u8]) -> McapResult<DecompressResult> {
        let mut decoder = lz4::Decoder::new(from)?;
        let mut wrote = 0;
        while wrote < into.len() {
            match decoder.read(&mut into[wrote..]) {
                Ok(0) => break,
                Ok(read) => wrote += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(McapError::DecompressionError(error.to_string())),
            }
        }
        Ok(DecompressResult { consumed: from.len(), wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        Ok(())
    }
}
