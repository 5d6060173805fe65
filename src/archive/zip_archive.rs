//! The entries of a zip archive, in the order of its directory.

use std::cell::Cell;
use std::io::{self, Read, Seek};

use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use super::Error;
use super::entry_name::shown;
use super::metered::Metered;
use super::sink::{EntryKind, Sink};

/// What a Unix mode says an entry is.
const TYPE_OF_MODE: u32 = 0o170_000;

/// Unpacks a zip archive.
///
/// * `progress` — told bytes of the archive that the entries so far take, and all.
pub(super) fn extract(
    reader: impl Read + Seek,
    archive_bytes: u64,
    progress: &dyn Fn(u64, u64),
    sink: &mut Sink<'_>,
) -> Result<(), Error> {
    let mut archive = ZipArchive::new(reader).map_err(|error| damaged(sink, None, error))?;
    if archive.len() as u64 > sink.limits.entries {
        return Err(sink.too_much("entries", sink.limits.entries));
    }
    if archive.has_duplicate_names() {
        return Err(damaged(sink, None, ZipError::InvalidArchive("two entries have one name".into())));
    }
    // Entries that share bytes make a small archive endless.
    if archive.has_overlapping_entries().map_err(|error| damaged(sink, None, error))? {
        return Err(damaged(sink, None, ZipError::InvalidArchive("entries share bytes".into())));
    }
    let (left, zeros) = (Cell::new(sink.permitted), Cell::new(0));
    let mut done: u64 = 0;
    for index in 0..archive.len() {
        progress(done.min(archive_bytes), archive_bytes);
        let about = archive.by_index_data(index).map_err(|error| damaged(sink, None, error))?;
        let name = about.name_raw().to_owned();
        done = done.saturating_add(about.compressed_size());
        let kind = match about.unix_mode().map_or(0, |mode| mode & TYPE_OF_MODE) {
            _ if name.ends_with(b"/") => EntryKind::Folder,
            0 | 0o100_000 => EntryKind::File,
            _ => EntryKind::Other,
        };
        let method = about.compression();
        let found = if about.encrypted() { "an encrypted one".to_owned() } else { method.to_string() };
        let known = matches!(method, CompressionMethod::Stored | CompressionMethod::Deflated);
        let readable = known && !about.encrypted();
        let Some(place) = sink.admit(&name, kind)? else { continue };
        if !readable {
            return Err(Error::Method { archive: sink.archive.to_owned(), name: shown(&name), found });
        }
        let file = archive.by_index(index).map_err(|error| damaged(sink, Some(&name), error))?;
        sink.write(&place, &name, Metered::new(file, &left, &zeros))?;
    }
    Ok(())
}

fn damaged(sink: &Sink<'_>, name: Option<&[u8]>, error: ZipError) -> Error {
    let error = match error {
        ZipError::Io(error) => error,
        other => io::Error::other(other.to_string()),
    };
    sink.damaged(name, error)
}
