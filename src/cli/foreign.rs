//! Graphs and problems of other programs, told from sequences by their name and their first words.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::storage::{self, File};
use anyhow::{Context, bail};

/// Bytes of a file that are looked at.
const GLANCE_BYTES: u64 = 4096;
/// What compressed files begin with, and what unpacks them.
const COMPRESSED: [(&[u8], &str); 3] =
    [(b"BZh", "bunzip2"), (&[0x1f, 0x8b], "gunzip"), (&[0x28, 0xb5, 0x2f, 0xfd], "unzstd")];

/// What a file of another program is.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Foreign {
    /// A graph of g2o.
    G2o,
    /// A problem of Bundle Adjustment in the Large.
    Bal,
}

impl Foreign {
    /// What it is, in words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::G2o => "a graph of g2o",
            Self::Bal => "a problem of BAL",
        }
    }

    /// What the name of such a file ends with.
    pub(super) fn extension(self) -> &'static str {
        match self {
            Self::G2o => "g2o",
            Self::Bal => "txt",
        }
    }
}

/// What a file is, or `None` where it is a folder or neither.
///
/// Fails for one that is compressed, saying what unpacks it.
pub(super) fn of(input: &Path) -> anyhow::Result<Option<Foreign>> {
    if !storage::is_file(input) {
        return Ok(None);
    }
    let file = File::open(input).with_context(|| input.display().to_string())?;
    let mut reader = BufReader::new(file).take(GLANCE_BYTES);
    let mut bytes = Vec::new();
    let mut is_first = true;
    let is_named_g2o = has_extension(input, Foreign::G2o);
    loop {
        bytes.clear();
        if reader.read_until(b'\n', &mut bytes)? == 0 {
            break;
        }
        if is_first && let Some((_, tool)) = COMPRESSED.iter().find(|(magic, _)| bytes.starts_with(magic)) {
            bail!("{}: is compressed; unpack it first: {tool} {0}", input.display());
        }
        is_first = false;
        if is_named_g2o {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let is_count = |word: &&str| word.bytes().all(|byte| byte.is_ascii_digit());
        if words.len() == 3 && words.iter().all(is_count) {
            return Ok(Some(Foreign::Bal));
        }
        if ["VERTEX_", "EDGE_", "PARAMS_", "FIX"].iter().any(|tag| line.starts_with(tag)) {
            return Ok(Some(Foreign::G2o));
        }
        break;
    }
    Ok(is_named_g2o.then_some(Foreign::G2o))
}

/// Whether a name ends as those of such files do.
pub(super) fn has_extension(path: &Path, kind: Foreign) -> bool {
    let path = storage::without_query(path);
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(kind.extension()))
}
