//! How much an archive may unpack to.

/// What an archive may hold at most. What it says about itself is not believed: all is counted as it comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of all that is unpacked.
    pub bytes: u64,
    /// Entries, those that are left out counted too.
    pub entries: u64,
    /// Bytes of an entry's name, with its folders.
    pub name_bytes: usize,
    /// Bytes that a byte of the archive may become, beyond the first 16 MiB.
    pub ratio: u64,
}

/// What may be unpacked of however small an archive.
pub(super) const FREE_BYTES: u64 = 16 << 20;

impl Default for Limits {
    /// 512 GiB, four million entries, names of 1024 bytes, 150 bytes out of one.
    ///
    /// Pictures hardly shrink, depth maps of floats by ten to twenty; a text of one letter by a thousand.
    fn default() -> Self {
        Self { bytes: 512 << 30, entries: 4_000_000, name_bytes: 1024, ratio: 150 }
    }
}

impl Limits {
    /// Bytes that an archive of a size may become.
    pub(super) fn bytes_of(&self, archive_bytes: u64) -> u64 {
        self.bytes.min(archive_bytes.saturating_mul(self.ratio).max(FREE_BYTES))
    }
}
