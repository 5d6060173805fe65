//! Edits of single bytes: damage that no writer would make.

use serde::Deserialize;

use super::Result;
use super::document::hexadecimal;
use super::edit::Edit;

/// A place in a file and what becomes of it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BytesEdit {
    /// File of the Parquet folder; without it, the MCAP file is meant.
    pub(crate) file: Option<String>,
    /// MCAP record, by its opcode, whose body `at` is counted in.
    record: Option<u8>,
    /// Which record of the opcode.
    #[serde(default)]
    nth: usize,
    /// Position, counted from the end where negative.
    at: i64,
    /// Bytes to put there, hexadecimal.
    put: Option<String>,
    /// Bits to turn over in the byte there.
    flip: Option<u8>,
    /// Cuts the file off there.
    #[serde(default)]
    cut: bool,
}

/// Applies the edits that are meant for a file.
pub(crate) fn edit(bytes: &mut Vec<u8>, file: Option<&str>, edits: &[Edit]) -> Result<()> {
    for edit in edits {
        if let Edit::Bytes(edit) = edit
            && edit.file.as_deref() == file
        {
            edit.apply(bytes)?;
        }
    }
    Ok(())
}

impl BytesEdit {
    fn apply(&self, bytes: &mut Vec<u8>) -> Result<()> {
        let (start, end) = match self.record {
            Some(opcode) => record(bytes, opcode, self.nth)?,
            None => (0, bytes.len()),
        };
        let base = if self.at < 0 { end } else { start };
        let offset = isize::try_from(self.at).map_err(|error| error.to_string())?;
        let at =
            base.checked_add_signed(offset).filter(|at| *at <= bytes.len()).ok_or("outside of the file")?;
        if let Some(digits) = &self.put {
            let put = hexadecimal(digits)?;
            bytes.get_mut(at..at + put.len()).ok_or("outside of the file")?.copy_from_slice(&put);
        }
        if let Some(mask) = self.flip {
            *bytes.get_mut(at).ok_or("outside of the file")? ^= mask;
        }
        if self.cut {
            bytes.truncate(at);
        }
        Ok(())
    }
}

/// Where the body of an MCAP record begins and ends; records within chunks are not looked at.
fn record(bytes: &[u8], opcode: u8, nth: usize) -> Result<(usize, usize)> {
    let mut at = 8;
    let mut seen = 0;
    while let Some(length) = bytes.get(at + 1..at + 9).and_then(|length| length.try_into().ok()) {
        let length = usize::try_from(u64::from_le_bytes(length)).map_err(|error| error.to_string())?;
        if bytes[at] == opcode {
            if seen == nth {
                return Ok((at + 9, at + 9 + length));
            }
            seen += 1;
        }
        at += 9 + length;
    }
    Err(format!("no record {nth} of opcode {opcode}"))
}
