//! Text files with one thing in each line.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use open_structure::structure::SourceFile;

use super::Error;
use crate::text_release::provenance_of_bytes;

/// Bytes of the largest list that is read: several hundred thousand poses.
const MAX_BYTES: u64 = 1 << 26;
/// Characters of a line that an error shows.
const SHOWN: usize = 60;

/// A text file, read.
#[derive(Debug)]
pub(super) struct List {
    /// Where it is.
    pub(super) path: PathBuf,
    /// Its name in the dataset, size and digest.
    pub(super) source: SourceFile,
    text: String,
}

/// A line that says something.
#[derive(Clone, Debug)]
pub(super) struct Line<'a> {
    /// Counted from 1.
    pub(super) number: u64,
    /// What stands between blanks and commas.
    pub(super) fields: Vec<&'a str>,
    path: &'a Path,
    text: &'a str,
}

impl List {
    /// Reads a list.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Layout`] where it is too large.
    pub(super) fn read(path: PathBuf) -> Result<Self, Error> {
        let bytes = bytes(&path, MAX_BYTES)?.ok_or_else(|| {
            Error::layout(&path, format!("a list of at most {MAX_BYTES} B"), "a larger file")
        })?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let found = provenance_of_bytes(&bytes, &name);
        let source = SourceFile { name: found.name, bytes: found.bytes, sha256: found.sha256 };
        let text = String::from_utf8_lossy(&bytes).into_owned();
        Ok(Self { path, source, text })
    }

    /// Lines that are neither empty nor remarks.
    pub(super) fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        (1..).zip(self.text.trim_start_matches('\u{feff}').lines()).filter_map(|(number, text)| {
            let text = text.trim();
            let fields = text.split([' ', '\t', ',']).filter(|field| !field.is_empty()).collect();
            let says = !text.is_empty() && !text.starts_with('#');
            says.then_some(Line { number, fields, path: &self.path, text })
        })
    }

    /// The error that says what should stand in a line.
    ///
    /// * `number` — the line, counted from 1.
    pub(super) fn wrong(&self, number: u64, expected: impl ToString) -> Error {
        let line = usize::try_from(number.saturating_sub(1)).unwrap_or(usize::MAX);
        wrong(&self.path, number, self.text.lines().nth(line).unwrap_or_default().trim(), expected)
    }

    /// Remarks: lines that begin with `#`.
    pub(super) fn remarks(&self) -> impl Iterator<Item = &str> {
        self.text.lines().filter_map(|text| text.trim().strip_prefix('#'))
    }
}

impl Line<'_> {
    /// The error that says what should stand in this line.
    pub(super) fn wrong(&self, expected: impl ToString) -> Error {
        wrong(self.path, self.number, self.text, expected)
    }

    /// The numbers of fields, all finite.
    ///
    /// * `first` — the field of the first.
    pub(super) fn numbers<const N: usize>(&self, first: usize) -> Option<[f64; N]> {
        let fields = self.fields.get(first..first + N)?;
        let mut numbers = [0.0; N];
        for (number, field) in numbers.iter_mut().zip(fields) {
            *number = field.parse().ok().filter(|number: &f64| number.is_finite())?;
        }
        Some(numbers)
    }

    /// A field that names a file inside the dataset.
    pub(super) fn file(&self, field: usize) -> Option<&str> {
        let name = *self.fields.get(field)?;
        let inside =
            Path::new(name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        inside.then_some(name)
    }
}

fn wrong(path: &Path, number: u64, text: &str, expected: impl ToString) -> Error {
    let mut found: String = text.chars().take(SHOWN).collect();
    if found.len() < text.len() {
        found.push_str(" ...");
    }
    Error::line(path, number, expected, format!("\"{found}\""))
}

/// Bytes of a file; `None` where there are more than expected.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn bytes(path: &Path, most: u64) -> Result<Option<Vec<u8>>, Error> {
    let failed = |source| Error::io(path, source);
    // Before it is opened: a pipe waits for someone to write.
    let found = path.metadata().map_err(failed)?;
    if !found.is_file() {
        let other = std::io::Error::other("expected a file, found a folder, a pipe or a device");
        return Err(failed(other));
    }
    let file = File::open(path).map_err(failed)?;
    let length = found.len();
    if length > most {
        return Ok(None);
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0) + 1);
    // A growing file has no length that could be relied on.
    file.take(most + 1).read_to_end(&mut bytes).map_err(failed)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}
