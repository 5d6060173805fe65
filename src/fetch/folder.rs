//! A folder with the files of a recipe, whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::download::Download;
use super::http::Client;
use super::mirror::Places;
use super::store::{Stored, stored};
use super::{Error, Event, Mirror, Patience, part_file};
use crate::archive::{self, Limits, Selection};
use crate::datasets::{Part, Recipe, RemoteFile};
use crate::storage;
use crate::unfinished::Unfinished;

/// Which files of a recipe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum What {
    /// The images.
    #[default]
    Raw,
    /// What the first text release has of the sequence.
    TextRelease,
}

/// How to fetch.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Which files.
    pub what: What,
    /// From where, instead of the recipe's URLs.
    pub mirror: Option<Mirror>,
    /// Leave downloaded archives where they were downloaded to.
    pub keep_archives: bool,
    /// Replace what stands where the folder is to appear.
    pub force: bool,
    /// Time-outs and retries.
    pub patience: Patience,
    /// What an archive may hold at most.
    pub limits: Limits,
}

/// What was fetched.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fetched {
    /// The sequence.
    pub sequence: String,
    /// The folder that was made.
    pub into: PathBuf,
    /// The folder to convert, in it.
    pub folder: PathBuf,
    /// The files, in the order of the recipe.
    pub files: Vec<FetchedFile>,
}

/// A file that was fetched.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FetchedFile {
    /// Its name.
    pub name: String,
    /// URL or path that had it.
    pub place: String,
    /// Its length.
    pub bytes: u64,
    /// Its SHA-256.
    pub sha256: String,
    /// Whether the recipe knew the digest, so that it was held against it.
    pub pinned: bool,
    /// Files that were unpacked of it; none where it stayed as it is.
    pub unpacked: u64,
    /// Links and devices of it that were left out.
    pub left_out: u64,
}

/// Where files of a folder are downloaded to: `NAME.download`, beside it; for a URL in the current folder.
#[must_use]
pub fn download_folder(into: &Path) -> PathBuf {
    let mut name = into.file_name().unwrap_or_default().to_owned();
    name.push(".download");
    if storage::is_url(into) { PathBuf::from(name) } else { into.with_file_name(name) }
}

/// Fetches the files of a recipe into a new folder.
///
/// Files are downloaded one after another, go on where an earlier run was cut, are held against the lengths and
/// digests of the recipe, and unpacked. The folder appears by a rename when all is there; what was downloaded stays
/// beside it after an error, for the next run.
///
/// * `into` — the folder.
/// * `events` — told what happens.
///
/// # Errors
/// Every one of [`Error`].
pub fn fetch(
    recipe: &Recipe,
    into: &Path,
    options: &Options,
    events: &dyn Fn(Event<'_>),
) -> Result<Fetched, Error> {
    let sequence = recipe.name.clone();
    let part = match options.what {
        What::Raw => &recipe.raw,
        What::TextRelease => {
            recipe.text_release.as_ref().ok_or_else(|| Error::NoTextRelease { sequence: sequence.clone() })?
        }
    };
    // `a/..` and `..` have no name of their own.
    let into = if storage::is_url(into) {
        into.to_owned()
    } else if into.file_name().is_some() {
        into.components().collect::<PathBuf>()
    } else {
        into.canonicalize().map_err(Error::io(into))?
    };
    if !options.force && storage::is_taken(&into).map_err(Error::io(&into))? {
        return Err(Error::Exists { path: into });
    }
    if let Some(Mirror::Folder(mirror)) = &options.mirror
        && let (Ok(mirror), Ok(target)) = (mirror.canonicalize(), into.canonicalize())
        && mirror.starts_with(&target)
    {
        return Err(Error::ReplacesMirror { path: into, mirror });
    }
    let downloads =
        Downloads { folder: download_folder(&into), client: Client::new(&options.patience), options };
    let mut files = Vec::new();
    for file in &part.files {
        files.push(downloads.get(file, &sequence, events)?);
    }

    let unfinished = Unfinished::beside(&into).map_err(Error::io(&into))?;
    let temporary = unfinished.path().to_owned();
    unfinished.create_folder().map_err(Error::io(&temporary))?;
    let mut fetched = Vec::new();
    for (file, (place, stored)) in part.files.iter().zip(&files) {
        let put = put(file, stored, &temporary, options, events);
        let (unpacked, left_out) = put.inspect_err(|error| {
            // Where no digest tells a whole download from a broken one, the next run has to fetch it again.
            let damaged = matches!(error, Error::Archive(archive::Error::Damaged { .. }));
            if damaged && file.sha256.is_none() && stored.path.starts_with(&downloads.folder) {
                let _ = fs::remove_file(&stored.path);
            }
        })?;
        fetched.push(FetchedFile {
            name: file.file_name().to_owned(),
            place: place.clone(),
            bytes: stored.bytes,
            sha256: stored.sha256.clone(),
            pinned: file.sha256.is_some(),
            unpacked,
            left_out,
        });
    }
    let folder = inside(part);
    if !temporary.join(&folder).is_dir() {
        return Err(Error::NoFolder { sequence, folder });
    }
    if !options.force && storage::is_taken(&into).map_err(Error::io(&into))? {
        return Err(Error::Exists { path: into });
    }
    unfinished.finish().map_err(Error::io(&into))?;
    if !options.keep_archives {
        downloads.remove(part)?;
    }
    let folder = if folder.as_os_str().is_empty() { into.clone() } else { into.join(folder) };
    Ok(Fetched { sequence, folder, into, files: fetched })
}

/// The folder to convert, below the one that is made; empty for that itself.
fn inside(part: &Part) -> PathBuf {
    if part.folder == Path::new(".") { PathBuf::new() } else { part.folder.clone() }
}

/// Unpacks a file into the new folder, or copies it there.
fn put(
    file: &RemoteFile,
    stored: &Stored,
    temporary: &Path,
    options: &Options,
    events: &dyn Fn(Event<'_>),
) -> Result<(u64, u64), Error> {
    let below = file.into.as_deref().filter(|below| *below != Path::new(".")).unwrap_or(Path::new(""));
    let target = temporary.join(below);
    if !target.is_dir() {
        fs::create_dir_all(&target).map_err(Error::io(&target))?;
    }
    let name = file.file_name();
    if !file.unpack {
        let target = target.join(name);
        fs::copy(&stored.path, &target).map_err(Error::io(&target))?;
        return Ok((0, 0));
    }
    let selection = file.only.clone().map_or(Selection::Everything, Selection::Below);
    let told = |done, total| events(Event::Unpacking { file: name, done, total });
    let unpacked = archive::extract(&stored.path, &target, &selection, &options.limits, &told)?;
    Ok((unpacked.files, unpacked.left_out))
}

/// Where files are downloaded to.
struct Downloads<'a> {
    folder: PathBuf,
    client: Client,
    options: &'a Options,
}

impl Downloads<'_> {
    /// A file, from an earlier run, from a mirror's disk, or over the network; and the place that had it.
    fn get(
        &self,
        file: &RemoteFile,
        sequence: &str,
        events: &dyn Fn(Event<'_>),
    ) -> Result<(String, Stored), Error> {
        let name = file.file_name();
        let urls = match Places::of(self.options.mirror.as_ref(), sequence, file) {
            Places::Paths([first, second]) => {
                let Some(path) = [&first, &second].into_iter().find(|path| path.is_file()) else {
                    return Err(Error::NotOnMirror { file: name.to_owned(), first, second });
                };
                let stored = stored(file, path)?;
                events(Event::There { file: name, bytes: stored.bytes });
                return Ok((path.display().to_string(), stored));
            }
            Places::Urls(urls) => urls,
        };
        fs::create_dir_all(&self.folder).map_err(Error::io(&self.folder))?;
        let whole = self.folder.join(name);
        if whole.is_file() {
            // A file that somebody has put there is as good, if it is the right one.
            if let Ok(stored) = stored(file, &whole) {
                events(Event::There { file: name, bytes: stored.bytes });
                return Ok((whole.display().to_string(), stored));
            }
            part_file::remove(&whole)?;
        }
        let download =
            Download { client: &self.client, patience: &self.options.patience, file, whole: &whole, events };
        let (url, sha256) = download.run(&urls).inspect_err(|_| {
            // It goes where nothing is left in it.
            let _ = fs::remove_dir(&self.folder);
        })?;
        let bytes = fs::metadata(&whole).map_err(Error::io(&whole))?.len();
        Ok((url, Stored { path: whole, bytes, sha256 }))
    }

    /// Removes what was downloaded, and the folder if nothing else is in it.
    fn remove(&self, part: &Part) -> Result<(), Error> {
        for file in &part.files {
            part_file::remove(&self.folder.join(file.file_name()))?;
        }
        // Somebody else's files stay.
        let _ = fs::remove_dir(&self.folder);
        Ok(())
    }
}
