//! Names and cameras that a sequence may be given and must have.

use super::Error;
use crate::evaluate::Reconstruction;
use crate::structure::{Sequence, registry};

/// Longest name of an estimate or a graph, characters.
const LONGEST_NAME: usize = 200;

/// Refuses a name that nothing can have, and one that is taken already unless it is to be replaced.
///
/// * `kind` — what is named, with its article, such as `an estimate`.
///
/// # Errors
/// [`Error::Name`] and [`Error::Taken`].
pub fn check_name(kind: &'static str, name: &str, is_taken: bool, replace: bool) -> Result<(), Error> {
    let refused = |reason| Err(Error::Name { kind, name: name.to_owned(), reason });
    if name.is_empty() {
        return refused("it is empty");
    }
    if name.trim() != name {
        return refused("it begins or ends with a space");
    }
    if name.chars().any(char::is_control) {
        return refused("it has a control character");
    }
    if name.chars().count() > LONGEST_NAME {
        return refused("it is longer than 200 characters");
    }
    if name == Reconstruction::TRUTH {
        return refused("it stands for the true poses");
    }
    if is_taken && !replace {
        return Err(Error::Taken { kind, name: name.to_owned() });
    }
    Ok(())
}

/// Refuses a name that no sequence can have: in collections it is that of a folder.
///
/// # Errors
/// [`Error::Name`].
pub fn check_sequence_name(name: &str) -> Result<(), Error> {
    check_name("a sequence", name, false, false)?;
    if name.contains(['/', '\\']) {
        let reason = "it has a slash";
        return Err(Error::Name { kind: "a sequence", name: name.to_owned(), reason });
    }
    Ok(())
}

/// Refuses cameras that project otherwise than estimators here do.
///
/// # Errors
/// [`Error::CameraModel`].
pub fn check_cameras(sequence: &Sequence) -> Result<(), Error> {
    match sequence.manifest.cameras.iter().find(|camera| camera.model != registry::PINHOLE) {
        None => Ok(()),
        Some(camera) => Err(Error::CameraModel {
            camera: camera.camera_id,
            expected: registry::PINHOLE,
            found: camera.model.clone(),
        }),
    }
}
