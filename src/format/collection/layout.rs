//! What lies in the folder of a collection.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::super::{Error, names};
use super::{catalogue_entry, folder_name, read_catalogue, sequence_name};
use crate::storage::{self, Found};
use crate::structure::CatalogueEntry;

/// One sequence of a collection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Name of the sequence, as its folder says it.
    pub name: String,
    /// Its folder.
    pub path: PathBuf,
}

impl Member {
    /// Whether the folder is called as one of this name has to be.
    #[must_use]
    pub fn is_well_named(&self) -> bool {
        self.path.file_name().is_some_and(|found| *found == *folder_name(&self.name))
    }
}

/// A folder with sequences as `sequence=NAME`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Collection {
    /// The folder.
    pub path: PathBuf,
    /// Its sequences, by name.
    pub members: Vec<Member>,
    /// Whether the catalogue is there.
    pub has_catalogue: bool,
    /// Sequences that are not called `sequence=NAME`: Parquet folders and MCAP files, by name.
    pub outside: Vec<PathBuf>,
    /// Names of what is none of these; what begins with a dot is passed over.
    pub others: Vec<String>,
}

impl Collection {
    /// Looks into a folder; nothing of a sequence is opened. Over HTTP, where nothing is listed, the sequences are those of the
    /// catalogue.
    ///
    /// # Errors
    /// [`Error::Io`]; over HTTP those of [`read_catalogue`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut found = Self {
            path: path.to_owned(),
            members: Vec::new(),
            has_catalogue: false,
            outside: Vec::new(),
            others: Vec::new(),
        };
        for listed in storage::list(path, &[names::CATALOGUE_FILE]).map_err(Error::io(path))? {
            let entry = path.join(&listed.name);
            let name = listed.name.to_string_lossy().into_owned();
            // Outputs that are not whole yet, and what systems leave lying about.
            if name.starts_with('.') {
                continue;
            }
            match sequence_name(&name) {
                Some(name) if listed.found == Found::Folder => {
                    found.members.push(Member { name, path: entry });
                }
                _ if name == names::CATALOGUE_FILE => found.has_catalogue = true,
                _ if is_sequence(&entry, listed.found) => found.outside.push(entry),
                _ => found.others.push(name),
            }
        }
        if found.has_catalogue && !storage::lists(path) {
            let member = |entry: CatalogueEntry| {
                let path = path.join(folder_name(&entry.sequence));
                Member { name: entry.sequence, path }
            };
            found.members = read_catalogue(path)?.into_iter().map(member).collect();
        }
        found.members.sort_by(|left, right| (&left.name, &left.path).cmp(&(&right.name, &right.path)));
        found.outside.sort();
        found.others.sort();
        Ok(found)
    }

    /// The collection at a path; `None` when what is there is none: a file, a sequence, a folder with neither a catalogue
    /// nor a sequence that is called as those of a collection are.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn at(path: &Path) -> Result<Option<Self>, Error> {
        if !storage::is_folder(path) || storage::exists(&path.join(names::MANIFEST_FILE)) {
            return Ok(None);
        }
        let found = Self::open(path)?;
        Ok((found.has_catalogue || !found.members.is_empty()).then_some(found))
    }

    /// The file of the catalogue.
    #[must_use]
    pub fn catalogue(&self) -> PathBuf {
        self.path.join(names::CATALOGUE_FILE)
    }

    /// What the catalogue has to say of each sequence, in their order; one that cannot be read brings its error.
    ///
    /// * `tell` — told how many are done and how many there are, from any thread.
    #[must_use]
    pub fn entries(&self, tell: Option<&(dyn Fn(u64, u64) + Sync)>) -> Vec<Result<CatalogueEntry, Error>> {
        let (done, total) = (AtomicU64::new(0), self.members.len() as u64);
        let entry = |member: &Member| {
            let entry = catalogue_entry(member);
            let done = 1 + done.fetch_add(1, Ordering::Relaxed);
            if let Some(tell) = tell {
                tell(done, total);
            }
            entry
        };
        self.members.par_iter().map(entry).collect()
    }

    /// Gives Parquet folders that are not called `sequence=NAME` the name that their manifest says; gives what they were called
    /// and what they are called now.
    ///
    /// # Errors
    /// Those of opening; [`Error::OutsideCollection`] for an MCAP file, [`Error::Exists`] where the place is taken, [`Error::OneName`]
    /// for two of one name: nothing was renamed then.
    pub fn adopt(&mut self) -> Result<Vec<(PathBuf, PathBuf)>, Error> {
        storage::on_this_machine(&self.path).map_err(Error::io(&self.path))?;
        let mut renamed: Vec<(PathBuf, PathBuf)> = Vec::new();
        for path in &self.outside {
            let reader = super::super::open(path)?;
            let target = self.path.join(folder_name(&reader.manifest().name));
            if path.is_file() {
                return Err(outside(path, &target));
            }
            if let Some((twin, _)) = renamed.iter().find(|(_, other)| *other == target) {
                let name = reader.manifest().name.clone();
                return Err(Error::OneName { name, first: twin.clone(), second: path.clone() });
            }
            if target.symlink_metadata().is_ok() {
                return Err(Error::Exists { path: target });
            }
            renamed.push((path.clone(), target));
        }
        for (path, target) in &renamed {
            fs::rename(path, target).map_err(Error::io(path))?;
        }
        *self = Self::open(&self.path)?;
        Ok(renamed)
    }

    /// Refuses a collection with sequences that are not called as its own are: a catalogue would leave them out.
    ///
    /// # Errors
    /// [`Error::OutsideCollection`], and those of opening.
    pub fn refuse_outside(&self) -> Result<(), Error> {
        let Some(path) = self.outside.first() else { return Ok(()) };
        let reader = super::super::open(path)?;
        Err(outside(path, &self.path.join(folder_name(&reader.manifest().name))))
    }
}

fn outside(path: &Path, target: &Path) -> Error {
    let remedy = if path.is_dir() && !storage::is_url(path) {
        "os index --adopt renames it".to_owned()
    } else {
        format!("os copy {} -o {}", path.display(), target.display())
    };
    Error::OutsideCollection { path: path.to_owned(), expected: target.to_owned(), remedy }
}

fn is_sequence(path: &Path, found: Found) -> bool {
    if found == Found::Folder {
        return storage::is_file(&path.join(names::MANIFEST_FILE));
    }
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
}
