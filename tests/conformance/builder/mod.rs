//! The conformance corpus: cases kept as text, built into MCAP files and Parquet folders.
//!
//! Nothing here goes through the library's writer, so that every defect can be built: the tables are
//! laid out with Arrow, and stored with the crates `mcap` and `parquet` directly.

mod arrays;
mod bytes;
mod case;
mod collection;
mod derive;
mod document;
mod edit;
mod export;
mod mcap_file;
mod noise;
mod parquet_files;
mod scene;
mod step;
mod view;

use std::fs;
use std::path::{Path, PathBuf};

use case::cases;
pub(crate) use case::{Case, Expected, Stored};
use document::Document;
use edit::Edit;
pub(crate) use export::export;

/// What went wrong while a case was read or built, in words.
pub(crate) type Result<T> = std::result::Result<T, String>;

/// Where the cases lie.
fn corpus_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance")
}

/// Stores a case's document under a path: an MCAP file, a Parquet folder, or a collection of such folders.
fn store(case: &Case, document: &Document, stored: Stored, path: &Path) -> Result<()> {
    match stored {
        Stored::Mcap => {
            let mut bytes = mcap_file::encode(document, &case.edits)?;
            bytes::edit(&mut bytes, None, &case.edits)?;
            fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))
        }
        Stored::Collection => collection::store(document, &case.edits, path),
        Stored::Parquet => {
            let mut files = parquet_files::encode(document, &case.edits)?;
            for (name, bytes) in &mut files {
                bytes::edit(bytes, Some(name), &case.edits)?;
            }
            fs::create_dir_all(path).map_err(|error| format!("{}: {error}", path.display()))?;
            for (name, bytes) in files {
                fs::write(path.join(&name), bytes).map_err(|error| format!("{name}: {error}"))?;
            }
            Ok(())
        }
    }
}

/// The scene's tables with the case's edits; what follows from other tables is computed after those
/// were edited, and counts and digests last of all, so that nothing but the named defect is wrong.
fn document(case: &Case) -> Result<Document> {
    let mut document = scene::expand(&case.scene)?;
    let of_sequence = || case.edits.iter().filter(|edit| !edit.is_of_collection());
    let late = |edit: &Edit| edit.table().is_some_and(|table| derive::DERIVED.contains(&table));
    for edit in of_sequence().filter(|edit| !late(edit)) {
        edit.apply(&mut document)?;
    }
    derive::tables(&mut document);
    for edit in of_sequence().filter(|edit| late(edit)) {
        edit.apply(&mut document)?;
    }
    derive::summaries(&mut document);
    for edit in of_sequence() {
        edit.apply_to_summaries(&mut document)?;
    }
    Ok(document)
}
