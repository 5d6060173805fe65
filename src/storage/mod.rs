//! Where files lie: on this machine, or in an object store under `s3://`, `gs://`, `http://` or `https://`.
//!
//! Every place is a [`Path`]; one that begins with such a scheme is a URL, and what is asked of it goes over the network.
//! Credentials and endpoints come from the environment, by the names that the stores' own programs use (`AWS_…`, `GOOGLE_…`).
//! Without the feature `remote` a URL is an error.

#![cfg_attr(
    not(feature = "remote"),
    expect(unreachable_code, reason = "without the feature there is no object")
)]

mod file;
#[cfg(feature = "remote")]
mod object;
#[cfg(feature = "remote")]
mod object_file;
mod source;

use std::ffi::OsString;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::{env, fs};

pub use file::File;
#[cfg(feature = "remote")]
use object::Object;
pub(crate) use source::Source;
#[cfg(not(feature = "remote"))]
use without::Object;

/// Schemes of object stores.
const SCHEMES: [&str; 4] = ["s3", "gs", "http", "https"];
/// What makes a folder a sequence.
const MARK: &str = "sequence.json";
/// Bytes that are copied at once.
const COPIED_AT_ONCE: usize = 1 << 20;

/// What stands somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// A file of so many bytes.
    File(u64),
    /// A folder; in an object store, what objects have as the beginning of their names.
    Folder,
    /// A device or the like.
    Other,
}

/// What stands in a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name in the folder.
    pub name: OsString,
    /// What it is.
    pub found: Found,
}

/// Whether a path is the URL of an object store.
#[must_use]
pub fn is_url(path: &Path) -> bool {
    scheme(path).is_some()
}

/// A path of this machine; refuses a URL, where there is no way to write one.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] for a URL.
pub fn on_this_machine(path: &Path) -> io::Result<&Path> {
    if is_url(path) {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "expected a folder on this machine, found a URL",
        ));
    }
    Ok(path)
}

/// The scheme of a URL and what follows it.
fn scheme(path: &Path) -> Option<(&'static str, &str)> {
    let (before, rest) = path.to_str()?.split_once(":/")?;
    let scheme = SCHEMES.into_iter().find(|scheme| *scheme == before)?;
    // Paths put together may have lost a slash.
    Some((scheme, rest.strip_prefix('/').unwrap_or(rest)))
}

/// A place by its name alone: of a URL over HTTP what stands behind `?`, as in signed ones, is left out.
#[must_use]
pub fn without_query(path: &Path) -> &Path {
    let end = match scheme(path) {
        Some(("http" | "https", _)) => path.to_str().and_then(|text| text.find('?')),
        _ => None,
    };
    end.and_then(|end| path.to_str()?.get(..end)).map_or(path, Path::new)
}

/// What stands at a place, links followed.
///
/// Of a URL over HTTP, where nothing can be listed, a folder is what has one of `sequence.json`, `catalogue.parquet` and
/// `summary.parquet` in it.
///
/// # Errors
/// [`io::ErrorKind::NotFound`] where nothing stands, and whatever keeps one from knowing.
pub fn find(path: &Path) -> io::Result<Found> {
    match Object::at(path)? {
        Some(object) => object.find(),
        None => Ok(found(&fs::metadata(path)?)),
    }
}

fn found(metadata: &fs::Metadata) -> Found {
    if metadata.is_dir() {
        Found::Folder
    } else if metadata.is_file() {
        Found::File(metadata.len())
    } else {
        Found::Other
    }
}

/// Whether anything stands at a place, a link that leads nowhere too.
///
/// # Errors
/// Whatever keeps one from knowing.
pub fn is_taken(path: &Path) -> io::Result<bool> {
    let found = match Object::at(path)? {
        Some(object) => object.find().map(drop),
        None => path.symlink_metadata().map(drop),
    };
    match found {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether something stands at a place that can be looked at.
#[must_use]
pub fn exists(path: &Path) -> bool {
    find(path).is_ok()
}

/// Whether a file stands at a place that can be looked at.
#[must_use]
pub fn is_file(path: &Path) -> bool {
    matches!(find(path), Ok(Found::File(_)))
}

/// Whether a folder stands at a place that can be looked at.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    matches!(find(path), Ok(Found::Folder))
}

/// Whether what stands in a folder can be listed there; over HTTP it cannot.
#[must_use]
pub fn lists(path: &Path) -> bool {
    !matches!(scheme(path), Some(("http" | "https", _)))
}

/// What stands in a folder, by name.
///
/// * `known` — names that may be there, for HTTP, which lists nothing: they are asked for one by one.
///
/// # Errors
/// Those of the file system or the network.
pub fn list(folder: &Path, known: &[&str]) -> io::Result<Vec<Entry>> {
    let mut entries = if let Some(object) = Object::at(folder)? {
        object.list(known)?
    } else {
        let entries = fs::read_dir(folder)?.map(|entry| {
            let entry = entry?;
            // A link that leads nowhere is there all the same.
            let metadata = fs::metadata(entry.path()).or_else(|_| entry.metadata())?;
            Ok(Entry { name: entry.file_name(), found: found(&metadata) })
        });
        entries.collect::<io::Result<Vec<_>>>()?
    };
    entries.sort_by(|left, right| left.name.cmp(&right.name));
    Ok(entries)
}

/// Bytes of a file, or of all that stands in a folder; 0 where nothing can be looked at. Links to folders are not followed.
///
/// * `known` — names that may be in a folder, as for [`list`].
#[must_use]
pub fn size(path: &Path, known: &[&str]) -> u64 {
    match find(path) {
        Ok(Found::File(bytes)) => bytes,
        Ok(Found::Folder) if is_url(path) => {
            let of = |entry: Entry| if let Found::File(bytes) = entry.found { bytes } else { 0 };
            list(path, known).map_or(0, |entries| entries.into_iter().map(of).sum())
        }
        Ok(Found::Folder) => {
            let of = |entry: fs::DirEntry| {
                let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
                if is_folder {
                    size(&entry.path(), known)
                } else {
                    fs::metadata(entry.path()).map_or(0, |found| found.len())
                }
            };
            fs::read_dir(path).map_or(0, |entries| entries.flatten().map(of).sum())
        }
        _ => 0,
    }
}

/// A whole file.
///
/// # Errors
/// Those of the file system or the network.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    match Object::at(path)? {
        Some(object) => object.read(),
        None => fs::read(path),
    }
}

/// A whole file of text.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] for what is not UTF-8, and those of the file system or the network.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

/// Whether two places are the same one, or the second lies in the first; the second need not be there.
#[must_use]
pub fn holds(outer: &Path, inner: &Path) -> bool {
    match (scheme(outer), scheme(inner)) {
        (None, None) => {
            outer.canonicalize().ok().zip(whole(inner)).is_some_and(|(outer, inner)| inner.starts_with(outer))
        }
        (Some(outer), Some(inner)) => outer.0 == inner.0 && Path::new(inner.1).starts_with(outer.1),
        _ => false,
    }
}

/// A path from the root, links followed as far as there is something.
fn whole(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
}

/// Whether two places are one.
#[must_use]
pub fn same(left: &Path, right: &Path) -> bool {
    holds(left, right) && holds(right, left)
}

/// What stands at a place, on this machine.
#[derive(Debug)]
pub struct Local {
    path: PathBuf,
    /// Where a copy lies; it goes with this value.
    _copy: Option<tempfile::TempDir>,
}

impl Local {
    /// A place on this machine as it is; what a URL names is copied, under its own name, into a temporary folder.
    ///
    /// * `known` — names that may be in it if it is a folder, as for [`list`].
    ///
    /// # Errors
    /// Those of the file system or the network.
    pub fn of(path: &Path, known: &[&str]) -> io::Result<Self> {
        if !is_url(path) {
            return Ok(Self { path: path.to_owned(), _copy: None });
        }
        let folder = tempfile::tempdir()?;
        let copy = folder.path().join(without_query(path).file_name().unwrap_or("root".as_ref()));
        copy_into(path, &copy, known)?;
        Ok(Self { path: copy, _copy: Some(folder) })
    }

    /// Where it lies on this machine.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A folder that files are written into: itself, or for a URL one of this machine, of which the files are sent.
#[derive(Debug)]
pub struct Outgoing {
    target: PathBuf,
    /// Where files of a URL wait; it goes with this value.
    waiting: Option<tempfile::TempDir>,
}

impl Outgoing {
    /// A folder, made where it is missing.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn folder(target: &Path) -> io::Result<Self> {
        let waiting = if Object::at(target)?.is_some() {
            Some(tempfile::tempdir()?)
        } else {
            fs::create_dir_all(target)?;
            None
        };
        Ok(Self { target: target.to_owned(), waiting })
    }

    /// Where files are to be written, on this machine.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.waiting.as_ref().map_or(&self.target, |waiting| waiting.path())
    }

    /// Sends what was written, if it has to be sent; what else stands there stays.
    ///
    /// # Errors
    /// Those of the file system or the network.
    pub fn finish(self) -> io::Result<()> {
        self.waiting.as_ref().map_or(Ok(()), |waiting| send_files(waiting.path(), &self.target))
    }
}

/// Sends the files of a folder, and those of the folders in it.
fn send_files(from: &Path, url: &Path) -> io::Result<()> {
    for entry in list(from, &[])? {
        let (from, url) = (from.join(&entry.name), url.join(&entry.name));
        if entry.found == Found::Folder {
            send_files(&from, &url)?;
        } else if let Some(object) = Object::at(&url)? {
            object.put(&from)?;
        }
    }
    Ok(())
}

/// Copies what a URL names, folders with all that is in them.
fn copy_into(from: &Path, to: &Path, known: &[&str]) -> io::Result<()> {
    if find(from)? == Found::Folder {
        fs::create_dir(to)?;
        for entry in list(from, known)? {
            copy_into(&from.join(&entry.name), &to.join(&entry.name), known)?;
        }
        return Ok(());
    }
    let (mut from, mut to) = (File::open(from)?, fs::File::create(to)?);
    let mut bytes = vec![0; COPIED_AT_ONCE];
    loop {
        match from.read(&mut bytes)? {
            0 => return to.flush(),
            read => to.write_all(&bytes[..read])?,
        }
    }
}

/// A name that stands in a file of a folder: it begins in that folder, unless it is a whole path or a URL itself.
#[must_use]
pub fn named(folder: &Path, name: &Path) -> PathBuf {
    if is_url(name) { name.to_owned() } else { folder.join(name) }
}

/// Removes what stands at a place, folders with all that is in them; tells whether anything stood there.
pub(crate) fn remove(path: &Path) -> io::Result<bool> {
    if let Some(object) = Object::at(path)? {
        let is_there = is_taken(path)?;
        object.remove_all()?;
        return Ok(is_there);
    }
    let found = match path.symlink_metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        found => found?,
    };
    if found.is_dir() {
        fs::remove_dir_all(path)?;
    } else {
        fs::remove_file(path)?;
    }
    Ok(true)
}

/// Where something that is to stand at a place is made before: beside it, or for a URL in this machine's temporary folder.
pub(crate) fn workshop(target: &Path) -> io::Result<PathBuf> {
    if Object::at(target)?.is_some() {
        return Ok(env::temp_dir());
    }
    let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(parent)?;
    Ok(parent.to_owned())
}

/// Sends a file or folder of this machine to where a URL says; what stands there goes.
///
/// An object is there whole or not at all. Of a folder what makes it a sequence comes last and goes first, so that nobody
/// takes half of it for the whole.
pub(crate) fn send(from: &Path, url: &Path) -> io::Result<()> {
    let object = Object::at(url)?.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a URL"))?;
    if !from.is_dir() {
        return object.put(from);
    }
    object.child(MARK).remove()?;
    let mut names: Vec<OsString> = Vec::new();
    for entry in list(from, &[])? {
        if entry.found == Found::Folder {
            send(&from.join(&entry.name), &url.join(&entry.name))?;
        } else {
            names.push(entry.name);
        }
    }
    names.sort_by_key(|name| (name == MARK, name.clone()));
    // What an earlier output had and this one has not.
    for entry in object.list(&[]).unwrap_or_default() {
        if matches!(entry.found, Found::File(_)) && !names.contains(&entry.name) {
            object.child(&entry.name.to_string_lossy()).remove()?;
        }
    }
    for name in names {
        object.child(&name.to_string_lossy()).put(&from.join(&name))?;
    }
    Ok(())
}

/// What a build without object stores says of URLs.
#[cfg(not(feature = "remote"))]
mod without {
    use std::io;
    use std::path::Path;

    use super::{Entry, Found, is_url};

    /// Nothing: there are no objects.
    #[derive(Debug)]
    pub(super) enum Object {}

    impl Object {
        pub(super) fn at(path: &Path) -> io::Result<Option<Self>> {
            if !is_url(path) {
                return Ok(None);
            }
            let what = "expected a path on this machine, found a URL; this build lacks the feature `remote`";
            Err(io::Error::new(io::ErrorKind::Unsupported, what))
        }

        pub(super) fn find(&self) -> io::Result<Found> {
            match *self {}
        }

        pub(super) fn list(&self, _: &[&str]) -> io::Result<Vec<Entry>> {
            match *self {}
        }

        pub(super) fn read(&self) -> io::Result<Vec<u8>> {
            match *self {}
        }

        pub(super) fn child(&self, _: &str) -> Self {
            match *self {}
        }

        pub(super) fn put(&self, _: &Path) -> io::Result<()> {
            match *self {}
        }

        pub(super) fn remove(&self) -> io::Result<()> {
            match *self {}
        }

        pub(super) fn remove_all(&self) -> io::Result<()> {
            match *self {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_are_those_with_a_known_scheme() {
        for url in [
            "s3://bucket/box1",
            "gs://bucket",
            "http://host:80/a.mcap",
            "https://host/a",
            "s3:/bucket/joined",
        ] {
            assert!(is_url(Path::new(url)), "{url}");
        }
        for path in ["box1", "/s3/a", "s3", "s3:", "ftp://host/a", "C:/a", "./s3://a", ""] {
            assert!(!is_url(Path::new(path)), "{path}");
        }
    }

    #[test]
    fn names_end_before_a_query() {
        for (url, expected) in [
            ("https://host/a.mcap?download=1", "https://host/a.mcap"),
            ("http://host/a.mcap?by=a/b?c", "http://host/a.mcap"),
            ("https://host/a.mcap", "https://host/a.mcap"),
            ("s3://bucket/what?", "s3://bucket/what?"),
            ("here/what?.mcap", "here/what?.mcap"),
        ] {
            assert_eq!(without_query(Path::new(url)), Path::new(expected));
        }
    }

    #[test]
    fn a_place_holds_itself_and_what_lies_in_it() {
        let holds = |outer: &str, inner: &str| holds(Path::new(outer), Path::new(inner));
        assert!(
            holds("s3://a/b", "s3://a/b") && holds("s3://a/b", "s3://a/b/c") && holds("s3://a", "s3://a/b")
        );
        assert!(
            !holds("s3://a/b", "s3://a/bc") && !holds("s3://a/b", "gs://a/b") && !holds("s3://a/b", "s3://a")
        );
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path().to_str().unwrap();
        let inner = format!("{here}/not/../yet");
        assert!(!holds(&inner, here) && holds(here, &format!("{here}/yet")));
        assert!(holds(here, here) && !holds(here, "s3://a") && !holds("s3://a", here));
    }
}
