//! The entries of a tar archive, in the order in which they come.

use std::cell::Cell;
use std::io::{self, Read};

use tar::{Archive, EntryType, PaxExtensions};

use super::Error;
use super::metered::Metered;
use super::sink::{EntryKind, Sink};

/// Largest header that describes the next entry, bytes.
const LARGEST_EXTENSION: u64 = 1 << 16;

/// Bytes of zeros that a tar archive ends with, at least.
const END: u64 = 512;

/// Unpacks a tar archive.
///
/// Entries are taken raw, for the reader would hold a name of any length in memory.
pub(super) fn extract(reader: impl Read, sink: &mut Sink<'_>) -> Result<(), Error> {
    // Headers and what is skipped are decompressed like files, and are counted with them.
    let (left, zeros) = (Cell::new(sink.permitted), Cell::new(0));
    let mut archive = Archive::new(Metered::new(reader, &left, &zeros));
    let entries = archive.entries().map_err(|error| sink.damaged(None, error))?.raw(true);
    let mut long_name: Option<Vec<u8>> = None;
    for entry in entries {
        let mut entry = entry.map_err(|error| sink.damaged(None, error))?;
        let kind = entry.header().entry_type();
        match kind {
            EntryType::GNULongName => {
                let mut name = extension(&mut entry).map_err(|error| sink.damaged(None, error))?;
                while name.last() == Some(&0) {
                    name.pop();
                }
                long_name = Some(name);
                continue;
            }
            EntryType::XHeader => {
                let bytes = extension(&mut entry).map_err(|error| sink.damaged(None, error))?;
                let name = pax_name(&bytes).map_err(|error| sink.damaged(None, error))?;
                long_name = name.or(long_name);
                continue;
            }
            // What holds for all, and where a link leads to.
            EntryType::XGlobalHeader | EntryType::GNULongLink => continue,
            _ => {}
        }
        let name = long_name.take().unwrap_or_else(|| entry.path_bytes().into_owned());
        let kind = match kind {
            // Before there were folders in tar archives, they were files whose names end in a slash.
            EntryType::Regular | EntryType::Continuous if name.ends_with(b"/") => EntryKind::Folder,
            EntryType::Regular | EntryType::Continuous => EntryKind::File,
            EntryType::Directory => EntryKind::Folder,
            _ => EntryKind::Other,
        };
        if let Some(place) = sink.admit(&name, kind)? {
            let length = entry.size();
            let mut read = 0;
            let counted = Counted { inner: &mut entry, read: &mut read };
            sink.write(&place, &name, counted)?;
            if read != length {
                let early = io::Error::from(io::ErrorKind::UnexpectedEof);
                return Err(sink.damaged(Some(&name), early));
            }
        }
    }
    // To the last byte, for the sum of a gzip stands there.
    let mut reader = archive.into_inner();
    io::copy(&mut reader, &mut io::sink()).map_err(|error| sink.damaged(None, error))?;
    if zeros.get() < END {
        return Err(sink.damaged(None, io::Error::from(io::ErrorKind::UnexpectedEof)));
    }
    Ok(())
}

/// The content of an entry that describes the next one.
fn extension(entry: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    entry.take(LARGEST_EXTENSION + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_EXTENSION {
        return Err(io::Error::other("a header of over 64 KiB"));
    }
    Ok(bytes)
}

/// The name that a pax header gives to the next entry.
fn pax_name(bytes: &[u8]) -> io::Result<Option<Vec<u8>>> {
    let mut name = None;
    for record in PaxExtensions::new(bytes) {
        let record = record?;
        match record.key_bytes() {
            b"path" => name = Some(record.value_bytes().to_owned()),
            // The next entry would end elsewhere, or be another than it seems.
            b"size" => return Err(io::Error::other("an entry of over 8 GiB, or one that pretends")),
            key if key.starts_with(b"GNU.sparse") => return Err(io::Error::other("a sparse file")),
            _ => {}
        }
    }
    Ok(name)
}

/// Counts what is read.
struct Counted<'a, R> {
    inner: R,
    read: &'a mut u64,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = self.inner.read(buffer)?;
        *self.read += length as u64;
        Ok(length)
    }
}
