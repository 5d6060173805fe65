//! Rows of a table, a batch at a time, from either encoding.

use super::Error;
use super::mcap_reader::{McapReader, Messages};
use super::parquet_reader::ParquetBatches;
use crate::structure::Record;

/// Where a table's rows come from.
pub(super) enum BatchSource<'a> {
    Empty,
    Mcap(&'a McapReader, Box<Messages>),
    Parquet(Box<ParquetBatches>),
}

/// Rows of a table, a batch at a time.
pub struct Batches<'a, R> {
    source: BatchSource<'a>,
    row: u64,
    log_time: Option<u64>,
    row_type: std::marker::PhantomData<fn() -> R>,
}

impl<'a, R> Batches<'a, R> {
    pub(super) const fn new(source: BatchSource<'a>) -> Self {
        Self { source, row: 0, log_time: None, row_type: std::marker::PhantomData }
    }

    /// Stamp of the message that held the last batch, nanoseconds; `None` for a Parquet file.
    pub(crate) const fn log_time(&self) -> Option<u64> {
        self.log_time
    }
}

impl<R: Record> Batches<'_, R> {
    /// Appends the next batch to rows; `None` at the end.
    pub(super) fn next_into(&mut self, rows: &mut Vec<R>) -> Option<Result<(), Error>> {
        let before = rows.len();
        let result = match &mut self.source {
            BatchSource::Empty => None,
            BatchSource::Parquet(batches) => batches.next_into(rows),
            BatchSource::Mcap(reader, messages) => loop {
                let message = match messages.next()? {
                    Ok(message) => message,
                    Err(error) => break Some(Err(error)),
                };
                let log_time = message.log_time;
                match reader.rows_into(message, self.row, rows) {
                    Ok(false) => {}
                    Ok(true) => {
                        self.log_time = Some(log_time);
                        break Some(Ok(()));
                    }
                    Err(error) => break Some(Err(error)),
                }
            },
        };
        match &result {
            Some(Ok(())) => self.row += (rows.len() - before) as u64,
            Some(Err(_)) => self.source = BatchSource::Empty,
            None => {}
        }
        result
    }
}

impl<R: Record> Iterator for Batches<'_, R> {
    type Item = Result<Vec<R>, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut rows = Vec::new();
        Some(self.next_into(&mut rows)?.map(|()| rows))
    }
}
