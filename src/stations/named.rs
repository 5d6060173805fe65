//! Names and cameras that a sequence may be given and must have.

use super::Error;
use crate::evaluate::Reconstruction;
use crate::structure::{Sequence, registry};

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
    if name == Reconstruction::TRUTH {
        return refused("it stands for the true poses");
    }
    if is_taken && !replace {
        return Err(Error::Taken { kind, name: name.to_owned() });
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
