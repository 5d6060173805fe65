//! Files by name from a zip archive or a folder, read with limits and never written anywhere.

use super::error::Error;
use super::model::Provenance;
use super::problem::{ProblemKind, Problems};
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

/// How much may be read. What an archive says about sizes is not believed; bytes are counted as they come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one file, unpacked.
    pub file_bytes: u64,
    /// Bytes of all files of a sequence together, unpacked.
    pub sequence_bytes: u64,
    /// Entries of one archive or folder.
    pub entries: usize,
}

impl Default for Limits {
    /// 1 GiB a file, 4 GiB a sequence, 10 000 entries.
    fn default() -> Self {
        Self { file_bytes: 1 << 30, sequence_bytes: 4 << 30, entries: 10_000 }
    }
}

/// What may still be read of one sequence.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    limits: Limits,
    left: u64,
}

impl Budget {
    /// All that the limits allow.
    #[must_use]
    pub fn new(limits: Limits) -> Self {
        Self { limits, left: limits.sequence_bytes }
    }
}

/// Where files are.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Container {
    /// A zip archive.
    Archive(PathBuf),
    /// A folder; only the files directly in it.
    Folder(PathBuf),
}

impl Container {
    /// The archive or folder itself.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Archive(path) | Self::Folder(path) => path,
        }
    }
}

/// A file to be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFile {
    /// Folder inside the container, `/` between its parts, empty at the root.
    pub folder: String,
    /// Name without folder.
    pub name: String,
    index: usize,
}

trait ReadSeek: Read + Seek + Send {}
impl<T: Read + Seek + Send> ReadSeek for T {}

enum Bytes {
    Archive(ZipArchive<Box<dyn ReadSeek>>),
    Folder(PathBuf),
}

/// An open archive or folder.
pub struct Source {
    label: String,
    files: Vec<SourceFile>,
    skipped: Problems,
    bytes: Bytes,
}

impl std::fmt::Debug for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Source")
            .field("label", &self.label)
            .field("files", &self.files)
            .finish_non_exhaustive()
    }
}

impl Source {
    /// Opens an archive or a folder and lists its files, sorted by folder and name.
    ///
    /// * `label` — how to name it in problems and errors; an archive's files are told as `label/folder/name`.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::Io`], [`Error::Archive`], [`Error::TooManyEntries`].
    pub fn open(container: &Container, label: &str, limits: &Limits) -> Result<Self, Error> {
        match container {
            Container::Archive(path) => {
                let file = File::open(path).map_err(Error::io(path))?;
                Self::archive(Box::new(BufReader::new(file)), label, limits)
            }
            Container::Folder(path) => Self::folder(path, label, limits),
        }
    }

    /// Opens an archive that is in memory.
    ///
    /// # Errors
    /// [`Error::Archive`], [`Error::TooManyEntries`].
    pub fn from_archive_bytes(bytes: Vec<u8>, label: &str, limits: &Limits) -> Result<Self, Error> {
        Self::archive(Box::new(Cursor::new(bytes)), label, limits)
    }

    fn archive(reader: Box<dyn ReadSeek>, label: &str, limits: &Limits) -> Result<Self, Error> {
        let broken =
            |error: ZipError| Error::Archive { archive: label.to_owned(), reason: error.to_string() };
        let archive = ZipArchive::new(reader).map_err(broken)?;
        if archive.len() > limits.entries {
            let (limit, found) = (limits.entries, archive.len());
            return Err(Error::TooManyEntries { container: label.to_owned(), limit, found });
        }
        let mut files = Vec::new();
        let mut skipped = Problems::default();
        for index in 0..archive.len() {
            let entry = archive.by_index_data(index).map_err(broken)?;
            let name = String::from_utf8_lossy(entry.name_raw()).replace('\\', "/");
            if entry.is_dir() || name.ends_with('/') {
                continue;
            }
            let told = format!("{label}/{}", printable(&name));
            if !is_safe(&name) || entry.is_symlink() {
                skipped.file(&told, ProblemKind::UnsafeName, String::new());
                continue;
            }
            let mut parts: Vec<_> = name.split('/').filter(|part| !matches!(*part, "" | ".")).collect();
            let name = parts.pop().unwrap_or_default().to_owned();
            files.push(SourceFile { folder: parts.join("/"), name, index });
        }
        files.sort_by(|a, b| (&a.folder, &a.name, a.index).cmp(&(&b.folder, &b.name, b.index)));
        Ok(Self { label: label.to_owned(), files, skipped, bytes: Bytes::Archive(archive) })
    }

    fn folder(path: &Path, label: &str, limits: &Limits) -> Result<Self, Error> {
        let mut files = Vec::new();
        let mut skipped = Problems::default();
        for entry in fs::read_dir(path).map_err(Error::io(path))? {
            let entry = entry.map_err(Error::io(path))?;
            let name = entry.file_name().to_string_lossy().into_owned();
            match fs::metadata(entry.path()) {
                Ok(about) if about.is_dir() => continue,
                Ok(about) if about.is_file() && entry.file_name().to_str().is_some() => {}
                // A pipe or a device may never end, a link may lead nowhere.
                _ => {
                    let told = below(label, &printable(&name));
                    skipped.file(&told, ProblemKind::UnsafeName, String::new());
                    continue;
                }
            }
            if files.len() == limits.entries {
                let (limit, found) = (limits.entries, limits.entries + 1);
                return Err(Error::TooManyEntries { container: label.to_owned(), limit, found });
            }
            files.push(SourceFile { folder: String::new(), name, index: 0 });
        }
        files.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self { label: label.to_owned(), files, skipped, bytes: Bytes::Folder(path.to_owned()) })
    }

    /// The files, sorted by folder and name.
    #[must_use]
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// What was passed over while listing.
    #[must_use]
    pub fn skipped(&self) -> &Problems {
        &self.skipped
    }

    /// How a file is named in problems: its place below the folder of its sequence.
    #[must_use]
    pub fn told(&self, file: &SourceFile) -> String {
        below(&below(&self.label, &printable(&file.folder)), &printable(&file.name))
    }

    /// Reads a whole file.
    ///
    /// # Errors
    /// [`Error::FileTooLarge`] and [`Error::SequenceTooLarge`] once so many bytes really came;
    /// [`Error::Encrypted`], [`Error::Compression`], [`Error::Damaged`], [`Error::Io`].
    pub fn read(&mut self, file: &SourceFile, budget: &mut Budget) -> Result<Vec<u8>, Error> {
        let file_limit = budget.limits.file_bytes;
        let limit = file_limit.min(budget.left);
        let bytes = self.read_up_to(file, limit.saturating_add(1))?;
        let length = bytes.len() as u64;
        if length > limit {
            let file = self.told(file);
            return Err(if length > file_limit {
                Error::FileTooLarge { file, limit: file_limit }
            } else {
                Error::SequenceTooLarge { file, limit: budget.limits.sequence_bytes }
            });
        }
        budget.left -= length;
        Ok(bytes)
    }

    /// Reads the beginning of a file.
    ///
    /// # Errors
    /// As [`Self::read`], but for the limits.
    pub fn read_up_to(&mut self, file: &SourceFile, most: u64) -> Result<Vec<u8>, Error> {
        let told = self.told(file);
        match &mut self.bytes {
            Bytes::Folder(path) => {
                let path = path.join(&file.name);
                let opened = File::open(&path).map_err(Error::io(&path))?;
                drain(opened, most).map_err(Error::io(&path))
            }
            Bytes::Archive(archive) => {
                let damaged = |error: &dyn std::fmt::Display| Error::Damaged {
                    file: told.clone(),
                    reason: error.to_string(),
                };
                let about = archive.by_index_data(file.index).map_err(|error| damaged(&error))?;
                if about.encrypted() {
                    return Err(Error::Encrypted { file: told });
                }
                let method = about.compression();
                if !matches!(method, CompressionMethod::Stored | CompressionMethod::Deflated) {
                    return Err(Error::Compression { file: told, method: method.to_string() });
                }
                let entry = archive.by_index(file.index).map_err(|error| damaged(&error))?;
                drain(entry, most).map_err(|error| damaged(&error))
            }
        }
    }
}

/// Size and digest of a file.
///
/// # Errors
/// [`Error::Missing`], [`Error::Io`].
pub fn provenance_of_file(path: &Path, name: &str) -> Result<Provenance, Error> {
    let mut file = File::open(path).map_err(Error::io(path))?;
    let mut digest = Sha256::new();
    let mut bytes = 0;
    let mut buffer = vec![0; 1 << 16];
    loop {
        let length = file.read(&mut buffer).map_err(Error::io(path))?;
        if length == 0 {
            return Ok(Provenance { name: name.to_owned(), bytes, sha256: hexadecimal(&digest.finalize()) });
        }
        digest.update(&buffer[..length]);
        bytes += length as u64;
    }
}

/// Size and digest of bytes at hand.
#[must_use]
pub fn provenance_of_bytes(bytes: &[u8], name: &str) -> Provenance {
    Provenance {
        name: name.to_owned(),
        bytes: bytes.len() as u64,
        sha256: hexadecimal(&Sha256::digest(bytes)),
    }
}

/// Whether a file begins as zip archives do.
///
/// # Errors
/// [`Error::Missing`], [`Error::Io`].
pub fn is_archive(path: &Path) -> Result<bool, Error> {
    let head = drain(File::open(path).map_err(Error::io(path))?, 4).map_err(Error::io(path))?;
    Ok(matches!(head.as_slice(), b"PK\x03\x04" | b"PK\x05\x06"))
}

fn drain(reader: impl Read, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Relative, staying inside, and printable.
fn is_safe(name: &str) -> bool {
    let drive = name.as_bytes().get(1) == Some(&b':');
    !name.is_empty()
        && !drive
        && !name.starts_with('/')
        && !name.chars().any(char::is_control)
        && !name.split('/').any(|part| part == "..")
}

fn printable(name: &str) -> String {
    const LONGEST: usize = 200;
    name.chars().take(LONGEST).map(|c| if c.is_control() { '�' } else { c }).collect()
}

fn below(folder: &str, name: &str) -> String {
    match (folder, name) {
        ("", name) => name.to_owned(),
        (folder, "") => folder.to_owned(),
        (folder, name) => format!("{folder}/{name}"),
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests;
