//! Names of entries: which are followed, and how they are shown.

use std::path::{Component, Path, PathBuf};

/// Where an entry goes, below the folder that is unpacked to.
///
/// `./rgb/1.png` is `rgb/1.png`; a folder's own name may come out empty.
///
/// # Errors
/// What is wrong with the name.
pub(super) fn place_of(name: &[u8], longest: usize) -> Result<PathBuf, &'static str> {
    if name.len() > longest {
        return Err("its name is too long");
    }
    let name = std::str::from_utf8(name).map_err(|_| "its name is not UTF-8")?;
    if name.is_empty() {
        return Err("it has no name");
    }
    if name.chars().any(char::is_control) {
        return Err("its name has a control character");
    }
    // Elsewhere a letter like others; where they lead out of a folder or into a stream, nobody wants to find out.
    if name.contains('\\') || (cfg!(windows) && name.contains(':')) {
        return Err("its name has a backslash or colon");
    }
    let mut place = PathBuf::new();
    for component in Path::new(name).components() {
        match component {
            Component::Normal(part) if part.len() > 255 => return Err("its name is too long"),
            Component::Normal(part) => place.push(part),
            Component::CurDir => {}
            Component::ParentDir => return Err("its name leads out of the folder"),
            Component::RootDir | Component::Prefix(_) => return Err("its name is absolute"),
        }
    }
    Ok(place)
}

/// A name as it is shown: printable, and cut short.
pub(super) fn shown(name: &[u8]) -> String {
    String::from_utf8_lossy(name)
        .chars()
        .take(200)
        .map(|letter| if letter.is_control() { '\u{fffd}' } else { letter })
        .collect()
}
