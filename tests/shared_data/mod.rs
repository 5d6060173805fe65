//! Files of the shared data, which are not part of the project.

use std::path::{Path, PathBuf};

/// A file of the shared data; tells when it is not there.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = data.join(name);
    if !path.exists() {
        eprintln!("SKIPPED: {} is not here; set OPEN_STRUCTURE_DATA to read it", path.display());
        return None;
    }
    Some(path)
}
