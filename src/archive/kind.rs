//! Kinds of archives, told by their content.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::Error;

/// How an archive is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A zip archive.
    Zip,
    /// A tar archive.
    Tar,
    /// A tar archive in gzip.
    TarGz,
}

/// Where a tar header has its sum.
const TAR_SUM: std::ops::Range<usize> = 148..156;

impl Kind {
    /// The kind of a file, by its first bytes; what its name ends in does not matter.
    ///
    /// # Errors
    /// [`Error::Kind`] with what the file looks like, [`Error::Io`].
    pub fn of(archive: &Path) -> Result<Self, Error> {
        let mut head = Vec::new();
        let file = File::open(archive).map_err(Error::io(archive))?;
        file.take(512).read_to_end(&mut head).map_err(Error::io(archive))?;
        Self::of_head(&head)
            .ok_or_else(|| Error::Kind { archive: archive.to_owned(), found: looks_like(&head).to_owned() })
    }

    /// The kind of a file that begins with some bytes; 512 are enough.
    #[must_use]
    pub fn of_head(head: &[u8]) -> Option<Self> {
        if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") {
            Some(Self::Zip)
        } else if head.starts_with(&[0x1f, 0x8b, 0x08]) {
            Some(Self::TarGz)
        } else {
            is_tar_header(head).then_some(Self::Tar)
        }
    }

    /// The name that people know it by.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Zip => "zip archive",
            Self::Tar => "tar archive",
            Self::TarGz => "tar.gz archive",
        }
    }
}

/// Old tar archives have no mark, but the sum of the header is always there.
fn is_tar_header(head: &[u8]) -> bool {
    let Some(header) = head.get(..512) else { return false };
    let written = std::str::from_utf8(&header[TAR_SUM]).unwrap_or_default();
    let written = u32::from_str_radix(written.trim_matches([' ', '\0']), 8).ok();
    let byte = |(at, byte): (usize, &u8)| u32::from(if TAR_SUM.contains(&at) { b' ' } else { *byte });
    written == Some(header.iter().enumerate().map(byte).sum())
}

/// What people would say a file is, by its first bytes.
pub(super) fn looks_like(head: &[u8]) -> &'static str {
    let known: [(&[u8], &str); 9] = [
        (b"BZh", "bzip2"),
        (b"\xfd7zXZ\0", "xz"),
        (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
        (b"\x28\xb5\x2f\xfd", "zstd"),
        (b"Rar!", "a rar archive"),
        (b"\x89PNG", "a PNG picture"),
        (b"\x89MCAP", "an MCAP file"),
        (b"version https://git-lfs", "a Git LFS pointer"),
        (b"\x1f\x9d", "compress"),
    ];
    let text = head.trim_ascii_start();
    let begins = |beginning: &str| {
        text.get(..beginning.len()).is_some_and(|found| found.eq_ignore_ascii_case(beginning.as_bytes()))
    };
    if head.is_empty() {
        "an empty file"
    } else if let Some((_, name)) = known.iter().find(|(magic, _)| head.starts_with(magic)) {
        name
    } else if ["<!doctype html", "<html", "<head"].into_iter().any(begins) {
        "an HTML page"
    } else if begins("<?xml") {
        "an XML text"
    } else if !head.contains(&0) && std::str::from_utf8(head).is_ok_or_cut() {
        "a text"
    } else {
        "other bytes"
    }
}

trait CutText {
    fn is_ok_or_cut(&self) -> bool;
}

impl CutText for Result<&str, std::str::Utf8Error> {
    /// Whether the bytes are UTF-8, but for a last letter that is cut.
    fn is_ok_or_cut(&self) -> bool {
        self.as_ref().err().is_none_or(|error| error.error_len().is_none())
    }
}
