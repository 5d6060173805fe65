//! Which sequences lie below the given paths, and in which archives and folders their parts are.

use super::error::Error;
use super::kind::FileKind;
use super::parse::parse;
use super::place::{Place, Role};
use super::problem::{FileProblems, ProblemKind, Problems};
use super::source::{Container, Limits, Source, SourceFile, is_archive};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// How far below a given path sequences are looked for.
const DEEPEST: usize = 8;

/// How much of a file with an unknown name is looked at, bytes.
const GLANCE: u64 = 4096;

/// A place that holds files of a sequence: a folder, an archive, or a folder in an archive.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Part {
    /// What the names on the way say that it holds; its files may say otherwise, and they are right.
    pub role: Role,
    /// The archive or the folder.
    pub container: Container,
    /// The folder inside an archive, empty at its root.
    pub folder: String,
    /// The container's place below the folder of the sequence, for problems and provenance.
    pub label: String,
}

/// A sequence, found and not yet read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SequenceSource {
    /// The name, with the variant's suffix: `nostructure_texture_far_v2`.
    pub name: String,
    /// The suffix alone: `v2`.
    pub variant: Option<String>,
    /// Where it stands: its folder, or an archive with what stands inside.
    pub place: String,
    /// Its parts, observations first, archives before folders.
    pub parts: Vec<Part>,
}

impl SequenceSource {
    /// The first part that is named after observations, if there is one.
    #[must_use]
    pub fn observation(&self) -> Option<&Part> {
        self.parts.iter().find(|part| part.role == Role::Observation)
    }

    /// The first part that is named after the baseline, if there is one.
    #[must_use]
    pub fn baseline(&self) -> Option<&Part> {
        self.parts.iter().find(|part| part.role == Role::Baseline)
    }
}

/// What was found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Discovery {
    /// The sequences, sorted by name.
    pub sequences: Vec<SequenceSource>,
    /// Files that belong to no sequence.
    pub passed_over: Problems,
}

/// Finds the sequences below some paths: archives, folders of text files, folders of a sequence with archives or
/// folders in it, or folders of many sequences.
///
/// The folder that holds `observation` and `baseline` (as archives or folders, at any depth) gives the sequence its
/// name; what follows these two words (`observation_v2`) tells variants apart and pairs them. Hidden files and folders
/// are not looked at. An archive found broken here is still listed, so that reading its sequence says so and the
/// others can be read.
///
/// # Errors
/// [`Error::Missing`], [`Error::NotAnArchive`], [`Error::NothingFound`], [`Error::SameName`], [`Error::Io`]; for an
/// archive given itself also those of [`Source::open`].
pub fn discover(paths: &[PathBuf], limits: &Limits) -> Result<Discovery, Error> {
    let mut search =
        Search { limits, found: BTreeMap::new(), visited: BTreeSet::new(), passed: Problems::default() };
    for path in paths {
        let about = fs::metadata(path).map_err(Error::io(path))?;
        let climbs = path.components().any(|part| part == std::path::Component::ParentDir);
        let whole = if climbs { fs::canonicalize(path) } else { std::path::absolute(path) };
        let whole = whole.map_err(Error::io(path))?;
        if about.is_dir() {
            search.folder(&whole, 0)?;
        } else if about.is_file() && is_archive(&whole)? {
            search.archive(&whole, true)?;
        } else {
            return Err(Error::NotAnArchive { path: path.clone() });
        }
    }
    search.finish(paths)
}

#[derive(Default)]
struct Found {
    makes_a_sequence: bool,
    parts: Vec<Part>,
}

struct Search<'l> {
    limits: &'l Limits,
    /// By folder, name and variant.
    found: BTreeMap<(String, String, String), Found>,
    visited: BTreeSet<PathBuf>,
    passed: Problems,
}

/// What a folder full of files is to a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Worth {
    /// Nothing of a sequence.
    Nothing,
    /// Belongs to a sequence, if there is one.
    Companion,
    /// Makes a sequence.
    Sequence,
}

impl Search<'_> {
    fn folder(&mut self, path: &Path, depth: usize) -> Result<(), Error> {
        let told = path.display().to_string();
        // Links may lead in circles.
        if !self.visited.insert(fs::canonicalize(path).map_err(Error::io(path))?) {
            return Ok(());
        }
        let mut entries = Vec::new();
        for entry in fs::read_dir(path).map_err(Error::io(path))? {
            entries.push(entry.map_err(Error::io(path))?.path());
        }
        entries.sort();
        let mut texts = false;
        for entry in entries {
            let name = entry.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with('.') {
                continue;
            }
            let Ok(about) = fs::metadata(&entry) else {
                self.passed.file(&entry.display().to_string(), ProblemKind::UnsafeName, String::new());
                continue;
            };
            if about.is_dir() {
                if depth == DEEPEST {
                    self.passed.file(
                        &entry.display().to_string(),
                        ProblemKind::UnreadFolder,
                        "too deep".to_owned(),
                    );
                } else if let Err(error) = self.folder(&entry, depth + 1) {
                    self.passed.file(
                        &entry.display().to_string(),
                        ProblemKind::UnreadFolder,
                        error.to_string(),
                    );
                }
            } else if about.is_file() && has_ending(&name, ".zip") {
                self.archive(&entry, false)?;
            } else if about.is_file() {
                texts |= has_ending(&name, ".txt");
            }
        }
        if texts {
            let container = Container::Folder(path.to_owned());
            match Source::open(&container, &told, self.limits) {
                Ok(mut source) => {
                    let files = source.files().to_vec();
                    let files: Vec<_> = files.iter().filter(|file| has_ending(&file.name, ".txt")).collect();
                    self.weigh(&mut source, &container, &files);
                }
                Err(error) => self.passed.file(&told, ProblemKind::UnreadFolder, error.to_string()),
            }
        }
        Ok(())
    }

    fn archive(&mut self, path: &Path, strict: bool) -> Result<(), Error> {
        let told = path.display().to_string();
        let container = Container::Archive(path.to_owned());
        let mut source = match Source::open(&container, &told, self.limits) {
            Ok(source) => source,
            Err(error) if strict => return Err(error),
            Err(_) => {
                self.add(&container, "", Worth::Sequence);
                return Ok(());
            }
        };
        let mut folders: BTreeMap<&str, Vec<&SourceFile>> = BTreeMap::new();
        let files = source.files().to_vec();
        for file in &files {
            if has_ending(&file.name, ".zip") {
                self.passed.file(&source.told(file), ProblemKind::NestedArchive, String::new());
            } else {
                folders.entry(&file.folder).or_default().push(file);
            }
        }
        for files in folders.values() {
            self.weigh(&mut source, &container, files);
        }
        Ok(())
    }

    /// Adds the folder of these files if it is one of a sequence, or tells that it was passed over.
    fn weigh(&mut self, source: &mut Source, container: &Container, files: &[&SourceFile]) {
        let mut worth = Worth::Nothing;
        for file in files {
            worth = worth.max(worth_of(source, file));
            if worth == Worth::Sequence {
                break;
            }
        }
        if worth == Worth::Nothing {
            for file in files {
                self.passed.file(&source.told(file), ProblemKind::UnrecognisedFile, String::new());
            }
        } else if let Some(first) = files.first() {
            self.add(container, &first.folder, worth);
        }
    }

    fn add(&mut self, container: &Container, folder: &str, worth: Worth) {
        let place = Place::of(container, folder);
        let part = Part {
            role: place.role,
            container: container.clone(),
            folder: folder.to_owned(),
            label: place.label,
        };
        let found = self.found.entry((place.folder, place.name, place.variant)).or_default();
        found.makes_a_sequence |= worth == Worth::Sequence;
        if !found.parts.contains(&part) {
            found.parts.push(part);
        }
    }

    fn finish(mut self, paths: &[PathBuf]) -> Result<Discovery, Error> {
        let mut sequences: Vec<SequenceSource> = Vec::new();
        for ((folder, name, variant), mut found) in self.found {
            let place = format!("{folder}/{name}");
            if !found.makes_a_sequence {
                for part in found.parts {
                    let told = part.container.path().display().to_string();
                    let detail = "nothing beside a ground truth or parameters".to_owned();
                    self.passed.file(&told, ProblemKind::UnrecognisedFile, detail);
                }
                continue;
            }
            found.parts.sort();
            let name = if variant.is_empty() { name } else { format!("{name}_{variant}") };
            let variant = Some(variant).filter(|variant| !variant.is_empty());
            sequences.push(SequenceSource { name, variant, place, parts: found.parts });
        }
        sequences.sort_by(|a, b| (&a.name, &a.place).cmp(&(&b.name, &b.place)));
        if let Some(two) = sequences.windows(2).find(|two| two[0].name == two[1].name) {
            let [name, first, second] = [&two[0].name, &two[0].place, &two[1].place].map(Clone::clone);
            return Err(Error::SameName { name, first, second });
        }
        if sequences.is_empty() {
            return Err(Error::NothingFound { paths: paths.to_vec() });
        }
        Ok(Discovery { sequences, passed_over: self.passed })
    }
}

fn worth_of(source: &mut Source, file: &SourceFile) -> Worth {
    match FileKind::of_name(&file.name) {
        // Others, too, call a file `association.txt`. One that cannot be opened is kept for reading to say why.
        Some(FileKind::Association | FileKind::Graph) => match begins_with_rows(source, file) {
            Ok(false) => Worth::Companion,
            Ok(true) | Err(_) => Worth::Sequence,
        },
        Some(kind) if kind.makes_a_sequence() => Worth::Sequence,
        Some(_) => Worth::Companion,
        None if has_ending(&file.name, ".txt") && !file.name.starts_with('.') => {
            if begins_with_rows(source, file).unwrap_or(false) { Worth::Sequence } else { Worth::Nothing }
        }
        None => Worth::Nothing,
    }
}

/// Whether a file begins with rows that bear a tag of the release.
fn begins_with_rows(source: &mut Source, file: &SourceFile) -> Result<bool, Error> {
    let mut head = source.read_up_to(file, GLANCE)?;
    if head.len() as u64 == GLANCE {
        head.truncate(head.iter().rposition(|&byte| byte == b'\n').unwrap_or(head.len()));
    }
    Ok(!parse(&head, None, &mut FileProblems::new("")).is_empty())
}

pub(super) fn has_ending(name: &str, ending: &str) -> bool {
    name.len() >= ending.len()
        && name.as_bytes()[name.len() - ending.len()..].eq_ignore_ascii_case(ending.as_bytes())
}

#[cfg(test)]
mod tests;
