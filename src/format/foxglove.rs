//! Channels with Foxglove's schemas, so that viewers show a sequence without a plug-in.

use super::Error;
use super::mcap_writer::McapWriter;
use super::writer::FrameRows;
use crate::structure::{Frame, Manifest, Record};

/// What viewers are shown; filled in as the sequence is written.
pub(super) struct FoxgloveChannels;

impl FoxgloveChannels {
    pub(super) fn create(_writer: &mut McapWriter, _manifest: &Manifest) -> Result<Self, Error> {
        Ok(Self)
    }
    pub(super) fn remember<R: Record>(&mut self, _rows: &[R]) {}
    pub(super) fn write_scene(&self, _writer: &mut McapWriter, _stamp: u64) -> Result<(), Error> {
        Ok(())
    }
    pub(super) fn write_frame(
        &self,
        _writer: &mut McapWriter,
        _frame: &Frame,
        _rows: FrameRows<'_>,
    ) -> Result<(), Error> {
        Ok(())
    }
}
