//! Where in a folder a dataset is, and whose it is.

use std::fs;
use std::path::{Path, PathBuf};

use super::Error;

/// Levels of folders with nothing beside them that are gone down.
const DEEPEST: usize = 6;
/// Entries of a folder that an error shows.
const SHOWN: usize = 5;
/// Entries of a folder that are looked at.
const MAX_ENTRIES: usize = 1_000_000;

/// Whose layout a folder has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dataset {
    /// TUM RGB-D.
    Tum,
    /// ICL-NUIM with PNG pictures.
    Icl,
    /// ICL-NUIM as its ray tracer wrote it.
    IclOriginal,
    /// TartanAir, first version.
    TartanAir,
    /// TartanAir, second version.
    TartanAirV2,
}

impl Dataset {
    /// The layout of a folder, by what it holds.
    fn of(folder: &Path) -> Option<Self> {
        let file = |name: &str| folder.join(name).is_file();
        let below = |name: &str| folder.join(name).is_dir();
        if file("pose_lcam_front.txt") || below("image_lcam_front") {
            Some(Self::TartanAirV2)
        } else if file("pose_left.txt") || below("image_left") {
            Some(Self::TartanAir)
        } else if file("rgb.txt") && (file("depth.txt") || file("groundtruth.txt")) {
            Some(Self::Tum)
        } else if below("rgb") && below("depth") {
            Some(Self::Icl)
        } else {
            let cameras = names(folder).ok()?;
            cameras.iter().any(|name| is_ray_tracers(name)).then_some(Self::IclOriginal)
        }
    }

    /// The command that reads it, and what people call it.
    const fn command(self) -> (&'static str, &'static str) {
        match self {
            Self::Tum => ("tum", "TUM RGB-D"),
            Self::Icl | Self::IclOriginal => ("icl", "ICL-NUIM"),
            Self::TartanAir | Self::TartanAirV2 => ("tartanair", "TartanAir"),
        }
    }
}

/// Whether a file is the camera of a frame by ICL-NUIM's ray tracer: `scene_00_0000.txt`, `scene_000.txt`.
fn is_ray_tracers(name: &str) -> bool {
    let number = name.strip_prefix("scene_").and_then(|rest| rest.strip_suffix(".txt"));
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|c| c.is_ascii_digit() || c == b'_'))
}

/// The folder of a dataset: the given one, or the only one below that is.
///
/// Folders are gone down as long as exactly one of those on a level is of the dataset, or there is exactly one.
///
/// * `wanted` — layouts that are looked for; `expected` — what they have, for people.
///
/// # Errors
/// [`Error::Layout`] says what is expected and found, and which command reads what is there; [`Error::Io`].
pub(super) fn find(folder: &Path, wanted: &[Dataset], expected: &str) -> Result<(PathBuf, Dataset), Error> {
    let metadata = fs::metadata(folder).map_err(|source| Error::io(folder, source))?;
    if !metadata.is_dir() {
        return Err(Error::layout(folder, expected, "a file"));
    }
    let mut level = folder.to_owned();
    for _ in 0..DEEPEST {
        match Dataset::of(&level) {
            Some(found) if wanted.contains(&found) => return Ok((level, found)),
            Some(other) => {
                let (command, name) = other.command();
                let found = format!("what {name} has (os-convert {command})");
                return Err(Error::layout(&level, expected, found));
            }
            None => {}
        }
        let below: Vec<PathBuf> =
            names(&level)?.into_iter().map(|name| level.join(name)).filter(|path| path.is_dir()).collect();
        let of_it: Vec<&PathBuf> = below
            .iter()
            .filter(|path| Dataset::of(path).is_some_and(|found| wanted.contains(&found)))
            .collect();
        level = match (of_it.as_slice(), below.as_slice()) {
            ([only], _) => (*only).clone(),
            ([], [only]) => only.clone(),
            ([], _) => break,
            (several, _) => {
                let found =
                    format!("{} sequences below, such as {}; give one", several.len(), several[0].display());
                return Err(Error::layout(folder, expected, found));
            }
        };
    }
    Err(Error::layout(folder, expected, held(folder)))
}

/// What a folder holds, for people.
fn held(folder: &Path) -> String {
    match names(folder).as_deref() {
        Ok([]) | Err(_) => "an empty folder".to_owned(),
        Ok(names) => {
            let more = if names.len() > SHOWN {
                format!(" and {} more", names.len() - SHOWN)
            } else {
                String::new()
            };
            format!("{}{more}", names[..names.len().min(SHOWN)].join(", "))
        }
    }
}

/// Names of what is in a folder, sorted.
pub(super) fn names(folder: &Path) -> Result<Vec<String>, Error> {
    let failed = |source| Error::io(folder, source);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)?.take(MAX_ENTRIES) {
        if let Ok(name) = entry.map_err(failed)?.file_name().into_string() {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}

/// Name of a folder, also where it is given as `.`.
pub(super) fn name(folder: &Path) -> String {
    let full = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    full.file_name().map_or_else(|| "sequence".to_owned(), |name| name.to_string_lossy().into_owned())
}
