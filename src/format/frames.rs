//! Frames in order, each with its rows, from either encoding.

use std::collections::{BTreeMap, VecDeque};

use super::Error;
use super::mcap_reader::{McapReader, Message, Messages};
use super::parquet_reader::{ParquetBatches, ParquetTableReader};
use crate::structure::{
    Frame, FrameBundle, FrameId, LineMeasurement, LineObservation, PointMeasurement, PointObservation,
    Record, for_each_frame_table,
};

/// Topics of the per-frame tables that are wanted, by name.
pub(super) fn frame_topics(wanted: &dyn Fn(&str) -> bool) -> Vec<String> {
    let mut topics = Vec::new();
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => { $(if wanted($row::TABLE.name) { topics.push($row::TABLE.topic()); })+ };
    }
    for_each_frame_table!(each);
    topics
}

/// Rows of one table that wait for their frame.
struct TableCursor<R> {
    batches: Option<ParquetBatches>,
    ahead: std::vec::IntoIter<R>,
}

impl<R: Record> TableCursor<R> {
    fn new(tables: &BTreeMap<&'static str, ParquetTableReader>) -> Result<Self, Error> {
        let batches = tables.get(R::TABLE.name).map(ParquetTableReader::batches::<R>).transpose()?;
        Ok(Self { batches, ahead: Vec::new().into_iter() })
    }

    /// Rows of a frame; rows of earlier frames, which are not in the list, are passed over.
    fn take(&mut self, frame_id: FrameId) -> Result<Vec<R>, Error> {
        let mut rows = Vec::new();
        loop {
            // As it should be: what comes first is of this frame, and moves in one piece.
            let here = self.ahead.as_slice().iter().take_while(|row| row.frame() == Some(frame_id)).count();
            rows.extend(self.ahead.by_ref().take(here));
            if let Some(row) = self.ahead.as_slice().first() {
                if row.frame() > Some(frame_id) {
                    return Ok(rows);
                }
                self.ahead.next();
                continue;
            }
            match self.batches.as_mut().and_then(ParquetBatches::next_rows::<R>) {
                Some(batch) => self.ahead = batch?.into_iter(),
                None => return Ok(rows),
            }
        }
    }
}

macro_rules! cursors {
    ($($name:ident: $row:ident,)+) => {
        /// A cursor for every per-frame table.
        pub(super) struct Cursors {
            $($name: TableCursor<$row>,)+
        }

        impl Cursors {
            pub(super) fn new(tables: &BTreeMap<&'static str, ParquetTableReader>) -> Result<Self, Error> {
                Ok(Self { $($name: TableCursor::new(tables)?),+ })
            }

            fn take(&mut self, frame: &Frame) -> Result<FrameBundle, Error> {
                Ok(FrameBundle { frame: frame.clone(), $($name: self.$name.take(frame.frame_id)?),+ })
            }
        }
    };
}
for_each_frame_table!(cursors);

pub(super) enum FrameSource<'a> {
    Mcap {
        reader: &'a McapReader,
        messages: Box<Messages>,
        ahead: Option<Message>,
        ready: BTreeMap<FrameId, FrameBundle>,
    },
    Parquet(Box<Cursors>),
}

/// Frames in order, each with its rows.
pub struct Frames<'a> {
    waiting: VecDeque<&'a Frame>,
    source: FrameSource<'a>,
    failed: bool,
}

impl<'a> Frames<'a> {
    pub(super) const fn new(waiting: VecDeque<&'a Frame>, source: FrameSource<'a>) -> Self {
        Self { waiting, source, failed: false }
    }

    fn bundle(&mut self, frame: &Frame) -> Result<FrameBundle, Error> {
        match &mut self.source {
            FrameSource::Parquet(cursors) => cursors.take(frame),
            FrameSource::Mcap { reader, messages, ahead, ready } => {
                let stamp = u64::try_from(frame.stamp_nanos).unwrap_or(0);
                // Frames of several cameras may share a stamp, so all messages up to it are taken first.
                loop {
                    let message = match ahead.take() {
                        Some(message) => message,
                        None => match messages.next() {
                            Some(message) => message?,
                            None => break,
                        },
                    };
                    if message.log_time > stamp {
                        *ahead = Some(message);
                        break;
                    }
                    take_into(reader, message, ready)?;
                }
                let mut bundle = ready.remove(&frame.frame_id).unwrap_or_default();
                bundle.frame = frame.clone();
                // What is left of earlier frames belongs to none in the list.
                ready.retain(|frame_id, _| *frame_id > frame.frame_id);
                Ok(bundle)
            }
        }
    }
}

/// Puts the rows of a per-frame message among those that wait for their frame.
pub(super) fn take_into(
    reader: &McapReader,
    message: Message,
    ready: &mut BTreeMap<FrameId, FrameBundle>,
) -> Result<(), Error> {
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            match reader.table_of(&message) {
                $(
                    Some(stringify!($name)) => {
                        let mut rows: Vec<$row> = Vec::new();
                        reader.rows_into(message, 0, &mut rows)?;
                        match rows.first().map(|row| row.frame_id) {
                            None => {}
                            // As it should be: the rows of one frame, which has none yet.
                            Some(frame_id) if rows.iter().all(|row| row.frame_id == frame_id) => {
                                let waiting = &mut ready.entry(frame_id).or_default().$name;
                                if waiting.is_empty() {
                                    *waiting = rows;
                                } else {
                                    waiting.append(&mut rows);
                                }
                            }
                            Some(_) => {
                                for row in rows {
                                    ready.entry(row.frame_id).or_default().$name.push(row);
                                }
                            }
                        }
                    }
                )+
                _ => {}
            }
        };
    }
    for_each_frame_table!(each);
    Ok(())
}

impl Iterator for Frames<'_> {
    type Item = Result<FrameBundle, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let frame = self.waiting.pop_front()?;
        let result = self.bundle(frame);
        self.failed = result.is_err();
        Some(result)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.waiting.len(), Some(self.waiting.len()))
    }
}
