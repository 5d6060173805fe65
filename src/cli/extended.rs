//! A sequence with something added: read whole, changed, written under another name.

use std::path::Path;

use anyhow::Context;

use super::{Outcome, left_behind, text};
use crate::format::{self, WriteOptions};
use crate::storage;
use crate::structure::{Sequence, registry};

/// A whole sequence that is to be extended, and whether something of it will be left behind.
///
/// Refuses an output that could not be written in the end, before any work.
pub(super) fn read(input: &Path, output: &Path, force: bool) -> anyhow::Result<(Sequence, Outcome)> {
    if storage::is_folder(input) && storage::holds(input, output) && !storage::same(input, output) {
        anyhow::bail!("{}: lies in the input", output.display());
    }
    if storage::is_taken(output).with_context(|| output.display().to_string())? {
        if storage::holds(output, input) {
            anyhow::bail!("{}: is the input itself, or holds it", output.display());
        }
        if !force {
            return Err(format::Error::Exists { path: output.to_owned() }.into());
        }
    }
    let reader = format::open(input)?;
    let outcome = left_behind::warn(&reader)?;
    let sequence = reader.read_all().with_context(|| format!("{}: cannot be read", input.display()))?;
    Ok((sequence, outcome))
}

/// Writes the extended sequence; gives how large it is, in words.
pub(super) fn write(output: &Path, mut sequence: Sequence, force: bool) -> anyhow::Result<String> {
    registry::SPEC_VERSION.clone_into(&mut sequence.manifest.spec_version);
    sequence.manifest.tables.clear();
    format::write(output, &sequence, WriteOptions { force, ..WriteOptions::default() })?;
    Ok(text::bytes(format::stored_bytes(output)))
}
