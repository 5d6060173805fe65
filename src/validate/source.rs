//! Where the rows come from: a file or memory.

use crate::format::{Error, SequenceReader};
use crate::structure::{Frame, Record, Sequence};

/// Rows handed on at once from memory; about what a file gives.
const BATCH_ROWS: usize = 1 << 13;

/// A sequence to be checked.
#[derive(Clone, Copy)]
pub(crate) enum Source<'a> {
    /// In a file or folder.
    Stored(&'a SequenceReader),
    /// In memory.
    Memory(&'a Sequence),
}

impl Source<'_> {
    /// Whether a table is there.
    pub(crate) fn has<R: Record>(&self) -> bool {
        match self {
            Self::Stored(reader) => reader.has::<R>(),
            Self::Memory(sequence) => !R::rows(sequence).is_empty() || R::TABLE.name == Frame::TABLE.name,
        }
    }

    /// Hands on the rows of a table in stored order, with the stamp of their MCAP message.
    ///
    /// # Errors
    /// Those of reading; the rows before the damage have been handed on.
    pub(crate) fn each_batch<R: Record>(
        &self,
        mut visit: impl FnMut(&[R], Option<u64>),
    ) -> Result<(), Error> {
        match self {
            Self::Memory(sequence) => {
                R::rows(sequence).chunks(BATCH_ROWS).for_each(|rows| visit(rows, None));
                Ok(())
            }
            Self::Stored(reader) => {
                let mut batches = reader.batches::<R>()?;
                while let Some(rows) = batches.next() {
                    visit(&rows?, batches.log_time());
                }
                Ok(())
            }
        }
    }
}
