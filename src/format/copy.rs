//! A sequence from one encoding into another, streaming.

use std::path::Path;

use super::Error;
use super::reader::SequenceReader;
use super::writer::{FrameRows, SequenceWriter, WriteOptions, Written};
use crate::structure::{Frame, Record, Storage, for_each_table};

/// Copies a sequence, table by table and frame by frame; `progress` is told frames done and frames in all.
///
/// Content that this version does not know is left behind, see [`SequenceReader::passed_over`]
/// and [`StoredTable::unknown_columns`](super::StoredTable::unknown_columns).
///
/// # Errors
/// Those of reading and of writing; nothing is left under the output's name.
pub fn copy(
    reader: &SequenceReader,
    output: &Path,
    options: WriteOptions,
    progress: &dyn Fn(u64, u64),
) -> Result<Written, Error> {
    let frames = reader.frame_list()?;
    let mut writer = SequenceWriter::create(output, reader.manifest(), frames, options)?;
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            $(
                if reader.has::<crate::structure::$row>() && stringify!($name) != Frame::TABLE.name {
                    writer.declare::<crate::structure::$row>()?;
                    if crate::structure::$row::TABLE.storage == Storage::Whole {
                        for batch in reader.batches::<crate::structure::$row>()? {
                            writer.append(&batch?)?;
                        }
                    }
                }
            )+
        };
    }
    for_each_table!(each);
    for (done, bundle) in reader.frames()?.enumerate() {
        let bundle = bundle?;
        writer.append_frame(bundle.frame.frame_id, FrameRows::from(&bundle))?;
        progress(done as u64 + 1, frames.len() as u64);
    }
    writer.finish()
}
