//! Inputs of commands that take several sequences: a collection stands for all of its own.

use std::path::{Path, PathBuf};

use anyhow::bail;

use crate::format::{Collection, sequence_name};

/// The sequences that paths mean, in the order given; those of a collection by name.
pub(super) fn sequences(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in paths {
        let Some(collection) = Collection::at(path)? else {
            found.push(path.clone());
            continue;
        };
        // What a collection does not count as its own would be left out without a word.
        collection.refuse_outside()?;
        if collection.members.is_empty() {
            bail!("{}: a collection without sequences", path.display());
        }
        found.extend(collection.members.into_iter().map(|member| member.path));
    }
    Ok(found)
}

/// As [`sequences`], where an input may also be a name.
pub(super) fn named(names: &[String]) -> anyhow::Result<Vec<String>> {
    let mut found = Vec::new();
    for name in names {
        for path in sequences(&[PathBuf::from(name)])? {
            let path = path.into_os_string().into_string();
            found.push(path.map_err(|path| anyhow::anyhow!("{}: a name that is no text", path.display()))?);
        }
    }
    Ok(found)
}

/// What a file or folder is called, in a collection without `sequence=`.
pub(super) fn called(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    Some(sequence_name(&name).unwrap_or(name))
}
