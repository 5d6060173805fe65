//! Cells on disk: one file each, so that a run that was cut off goes on where it ended.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::content::Content;
use super::{Bound, Cell, CellKey, Error, Plan};
use crate::storage;
use crate::unfinished::Unfinished;

/// The file that says what the folder holds.
const PLAN_FILE: &str = "plan.json";
const CELLS: &str = "cells";
const BOUNDS: &str = "bounds";
const CONTENTS: &str = "contents";

/// What a stored plan was made by.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize)]
struct StoredPlan {
    /// Version of the program.
    version: String,
    /// Names of the sequences of the last run that came to its end, in order.
    #[serde(default)]
    sequences: Vec<String>,
    #[serde(flatten)]
    plan: Plan,
}

/// Bounds of a sequence, by method.
pub(super) type Bounds = BTreeMap<String, Bound>;

/// A folder of results.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// Opens a folder of results, or begins one.
    ///
    /// More methods, estimates or seeds may be asked for than before; noise and the program's version have to be the same.
    ///
    /// * `anew` — whether results that are there are removed first.
    ///
    /// # Errors
    /// [`Error::OtherPlan`] when the folder holds results of another noise or version, [`Error::Stored`] when it holds
    /// something else, [`Error::Io`].
    pub fn open(folder: &Path, plan: &Plan, anew: bool) -> Result<Self, Error> {
        let store = Self { folder: folder.to_owned() };
        let file = folder.join(PLAN_FILE);
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let begun = storage::is_taken(&file).map_err(Error::io(&file))?;
        let is_there = begun || storage::is_taken(folder).map_err(Error::io(folder))?;
        if is_there && !begun && !storage::list(folder, &[]).map_err(Error::io(folder))?.is_empty() {
            // Never taken for ours, whatever is asked for.
            return Err(Error::Stored {
                path: folder.to_owned(),
                detail: format!(
                    "expected a folder of results with {PLAN_FILE}, or none; found something else"
                ),
            });
        }
        if begun && anew {
            for part in [CELLS, BOUNDS, CONTENTS] {
                let path = folder.join(part);
                storage::remove(&path).map_err(Error::io(&path))?;
            }
        } else if begun {
            let difference = match read::<StoredPlan>(&file)? {
                Some(stored) if stored.version != version => {
                    Some(format!("of version {}, this is {version}", stored.version))
                }
                Some(stored)
                    if (&stored.plan.noise, stored.plan.as_measured) != (&plan.noise, plan.as_measured) =>
                {
                    Some("of other noise".to_owned())
                }
                _ => None,
            };
            if let Some(difference) = difference {
                return Err(Error::OtherPlan { path: folder.to_owned(), difference });
            }
        }
        write(&file, &StoredPlan { version, sequences: Vec::new(), plan: plan.clone() })?;
        Ok(store)
    }

    /// Says that a plan was run to its end on some sequences.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn ran(&self, plan: &Plan, sequences: &[String]) -> Result<(), Error> {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let stored = StoredPlan { version, sequences: sequences.to_vec(), plan: plan.clone() };
        write(&self.folder.join(PLAN_FILE), &stored)
    }

    /// Opens the results of a run that came to its end; gives its plan and the names of its sequences.
    ///
    /// # Errors
    /// [`Error::OtherPlan`] when another version of the program made them, [`Error::Stored`] when it did not come to its end,
    /// [`Error::Io`].
    pub(super) fn finished(folder: &Path) -> Result<(Self, Plan, Vec<String>), Error> {
        let file = folder.join(PLAN_FILE);
        let stored: StoredPlan = expected(&file)?;
        let version = env!("CARGO_PKG_VERSION");
        if stored.version != version {
            let difference = format!("of version {}, this is {version}", stored.version);
            return Err(Error::OtherPlan { path: folder.to_owned(), difference });
        }
        if stored.sequences.is_empty() {
            let detail = "expected a run that came to its end, found one without sequences".to_owned();
            return Err(Error::Stored { path: file, detail });
        }
        Ok((Self { folder: folder.to_owned() }, stored.plan, stored.sequences))
    }

    /// Of what the cells of a sequence were made.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Stored`].
    pub(super) fn content(&self, sequence: &str) -> Result<Content, Error> {
        expected(&self.content_file(sequence))
    }

    fn content_file(&self, sequence: &str) -> PathBuf {
        self.folder.join(CONTENTS).join(format!("{}.json", file_name(sequence)))
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn cell_file(&self, key: &CellKey) -> PathBuf {
        let folder = self.folder.join(CELLS).join(file_name(&key.sequence));
        folder.join(format!("{}.{}.json", file_name(&key.method), key.seed))
    }

    fn bound_file(&self, sequence: &str) -> PathBuf {
        self.folder.join(BOUNDS).join(format!("{}.json", file_name(sequence)))
    }

    /// Says what a sequence holds now; removes what was made of another content, and tells whether there was any.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Stored`].
    pub(super) fn expect(&self, sequence: &str, content: &Content) -> Result<bool, Error> {
        let name = file_name(sequence);
        let path = self.content_file(sequence);
        let mut stale = Vec::new();
        let mut content = content.clone();
        if let Some(stored) = read::<Content>(&path)? {
            if stored.measured == content.measured {
                let other = |(estimate, digest): (&String, &String)| {
                    stored.estimates.get(estimate).is_none_or(|stored| stored != digest)
                };
                let others: Vec<&String> =
                    content.estimates.iter().filter(|each| other(*each)).map(|(name, _)| name).collect();
                for method in others {
                    let key = CellKey { sequence: sequence.to_owned(), method: method.clone(), seed: 0 };
                    stale.push(self.cell_file(&key));
                }
                // Estimates that are not asked for today keep what was made of them.
                let mut estimates = stored.estimates;
                estimates.append(&mut content.estimates);
                content.estimates = estimates;
            } else {
                stale.push(self.folder.join(CELLS).join(&name));
                stale.push(self.bound_file(sequence));
            }
        } else {
            // Nobody knows of what these were made.
            stale.push(self.folder.join(CELLS).join(&name));
            stale.push(self.bound_file(sequence));
        }
        let mut removed = false;
        for path in &stale {
            removed |= storage::remove(path).map_err(Error::io(path))?;
        }
        write(&path, &content)?;
        Ok(removed)
    }

    /// The cell of a key, where it is done.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Stored`] for a file that is no cell, or another one.
    pub fn cell(&self, key: &CellKey) -> Result<Option<Cell>, Error> {
        let path = self.cell_file(key);
        let Some(cell) = read::<Cell>(&path)? else { return Ok(None) };
        if cell.key != *key {
            let detail = format!("expected the cell of {key:?}, found that of {:?}", cell.key);
            return Err(Error::Stored { path, detail });
        }
        Ok(Some(cell))
    }

    /// Keeps a cell.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep(&self, cell: &Cell) -> Result<(), Error> {
        write(&self.cell_file(&cell.key), cell)
    }

    /// The bound of a sequence, where it is done.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Stored`].
    pub fn bound(&self, sequence: &str) -> Result<Option<Bounds>, Error> {
        read(&self.bound_file(sequence))
    }

    /// Keeps the bounds of a sequence.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep_bound(&self, sequence: &str, bounds: &Bounds) -> Result<(), Error> {
        write(&self.bound_file(sequence), bounds)
    }
}

/// A name that is safe as a part of a path; what had to be replaced is followed by a digest, so that names stay apart.
fn file_name(name: &str) -> String {
    let is_safe = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    if !name.is_empty() && name.len() <= 100 && name.chars().all(is_safe) {
        return name.to_owned();
    }
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in name.bytes() {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
    let safe: String = name.chars().take(50).map(|c| if is_safe(c) { c } else { '_' }).collect();
    format!("{safe}.{hash:016x}")
}

/// What a file holds that has to be there.
fn expected<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    read(path)?.ok_or_else(|| Error::io(path)(ErrorKind::NotFound.into()))
}

/// What a file holds; `None` where none is.
fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, Error> {
    let text = match storage::read_to_string(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        text => text.map_err(Error::io(path))?,
    };
    let damaged = |cause| format!("{cause}; what it held is made anew once it is removed");
    serde_json::from_str(&text)
        .map(Some)
        .map_err(|cause| Error::Stored { path: path.to_owned(), detail: damaged(cause) })
}

fn write<T: Serialize>(path: &Path, value: &T) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|cause| Error::Stored { path: path.to_owned(), detail: cause.to_string() })?;
    text.push('\n');
    let unfinished = Unfinished::beside(path).map_err(Error::io(path))?;
    fs::write(unfinished.path(), text).map_err(Error::io(unfinished.path()))?;
    unfinished.finish().map_err(Error::io(path))
}
