//! One Parquet file as a table.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use arrow::array::RecordBatch;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
    RowSelection, RowSelector,
};
use parquet::file::metadata::{PageIndexPolicy, ParquetMetaData};
use parquet::file::page_index::column_index::ColumnIndexMetaData;
use parquet::file::statistics::Statistics;
use rayon::prelude::*;

use super::Error;
use super::arrow_batch::from_batch;
use super::counted_file::CountedFile;
use super::guard::guarded;
use super::stored_table::StoredTable;
use crate::structure::{ColumnType, FrameId, Record, TableInfo};

/// Rows decoded at once: columns of a batch stay in the cache.
const BATCH_ROWS: usize = 1 << 13;
/// The same for tables with texts, bytes or lists, whose length only decoding tells.
const BATCH_ROWS_OF_ANY_LENGTH: usize = 1 << 10;
/// Largest plausible number of rows per byte of file: keys differ from row to row, so even constant
/// columns stay below a hundred.
const MAX_ROWS_PER_BYTE: u64 = 256;
/// Rows that any file may have, however few bytes they take.
const ALWAYS_PERMITTED_ROWS: u64 = 1 << 20;
/// Largest plausible ratio of decoded columns to the file.
const MAX_RATIO: u64 = 512;
/// Size that decoded columns may have, however few bytes they take.
const ALWAYS_PERMITTED_BYTES: u64 = 1 << 28;

/// A table's file, its footer read.
pub(super) struct ParquetTableReader {
    file: CountedFile,
    metadata: ArrowReaderMetadata,
    stored: StoredTable,
}

impl ParquetTableReader {
    pub(super) fn open(
        path: &Path,
        table: &'static TableInfo,
        bytes_read: Arc<AtomicU64>,
    ) -> Result<Self, Error> {
        let file = CountedFile::open(path, bytes_read)?;
        // The embedded Arrow schema only repeats what the Parquet schema says, in the words of its writer.
        let options = ArrowReaderOptions::new()
            .with_skip_arrow_metadata(true)
            .with_page_index_policy(PageIndexPolicy::Skip);
        let metadata = guarded(path, "Parquet", || {
            ArrowReaderMetadata::load(&file, options)
                .map_err(|error| Error::container(path, "Parquet")(error.into()))
        })?;
        let rows = claimed_rows(path, metadata.metadata())?;
        let limit = file.length().saturating_mul(MAX_ROWS_PER_BYTE).saturating_add(ALWAYS_PERMITTED_ROWS);
        if rows > limit {
            return Err(Error::TooLarge {
                path: path.to_owned(),
                what: "row count".to_owned(),
                found: rows,
                limit,
            });
        }
        let stored = StoredTable::new(table, metadata.schema(), Some(rows));
        Ok(Self { file, metadata, stored })
    }

    pub(super) fn stored(&self) -> &StoredTable {
        &self.stored
    }

    /// Rows for which room may be made before they are seen: those that the footer claims, as long as
    /// there is a byte of file for each.
    pub(super) fn plausible_rows(&self) -> usize {
        let claimed = self.stored.rows.unwrap_or(0).min(self.file.length());
        usize::try_from(claimed).unwrap_or(0)
    }

    /// The footer, as the validator wants to see it.
    pub(super) fn footer(&self) -> &ParquetMetaData {
        self.metadata.metadata()
    }

    /// Rows from the beginning, batch by batch.
    pub(super) fn batches<R: Record>(&self) -> Result<ParquetBatches, Error> {
        self.read::<R>(&self.metadata, None, Position::default())
    }

    /// All rows, no more than `most_rows`, the row groups side by side on all cores.
    pub(super) fn rows<R: Record>(&self, most_rows: u64) -> Result<Vec<R>, Error> {
        let groups = self.footer().row_groups();
        let firsts = groups.iter().scan(0, |first, group| {
            let begin = *first;
            *first += u64::try_from(group.num_rows()).unwrap_or(0);
            Some(begin)
        });
        let groups: Vec<(usize, u64)> = firsts.enumerate().collect();
        let decoded = Arc::new(AtomicU64::new(0));
        let read = |(group, row): &(usize, u64), rows: &mut Vec<R>| -> Result<(), Error> {
            let position = Position { row: *row, decoded: Arc::clone(&decoded) };
            let mut batches = self.read::<R>(&self.metadata, Some((vec![*group], None)), position)?;
            while let Some(batch) = batches.next_into(rows) {
                batch?;
                check_rows(self.file.path(), R::TABLE, rows.len(), most_rows)?;
            }
            Ok(())
        };
        // What a footer claims may be false, so room is made for what is plausible.
        let mut rows = Vec::with_capacity(self.plausible_rows());
        let threads = rayon::current_num_threads();
        // The first of those side by side comes where it belongs at once; the others wait, in memory that is used again.
        let mut waiting: Vec<Vec<R>> = (1..threads).map(|_| Vec::new()).collect();
        for side_by_side in groups.chunks(threads) {
            let Some((first, others)) = side_by_side.split_first() else { continue };
            let (direct, beside) = rayon::join(
                || read(first, &mut rows),
                || -> Vec<Result<(), Error>> {
                    let both = others.par_iter().zip(waiting.par_iter_mut());
                    both.map(|(group, rows)| read(group, rows)).collect()
                },
            );
            direct?;
            for (result, waiting) in beside.into_iter().zip(&mut waiting) {
                result?;
                rows.append(waiting);
            }
            check_rows(self.file.path(), R::TABLE, rows.len(), most_rows)?;
        }
        Ok(rows)
    }

    /// Only the pages that may hold rows of a frame.
    pub(super) fn batches_of_frame<R: Record>(&self, frame_id: FrameId) -> Result<ParquetBatches, Error> {
        let path = self.file.path();
        let Some(column) = self.leaf("frame_id") else {
            return self.batches::<R>();
        };
        let groups: Vec<usize> = (0..self.footer().num_row_groups())
            .filter(|group| match self.footer().row_group(*group).column(column).statistics() {
                Some(Statistics::Int64(range)) => {
                    range.min_opt().is_none_or(|min| *min <= frame_id.0)
                        && range.max_opt().is_none_or(|max| *max >= frame_id.0)
                }
                _ => true,
            })
            .collect();
        if groups.is_empty() {
            return Ok(ParquetBatches {
                file: self.file.clone(),
                reader: None,
                position: Position::default(),
            });
        }
        guarded(path, "Parquet", || {
            let options = ArrowReaderOptions::new()
                .with_skip_arrow_metadata(true)
                .with_page_index_policy(PageIndexPolicy::Optional);
            let metadata = ArrowReaderMetadata::load(&self.file, options)
                .map_err(|error| Error::container(path, "Parquet")(error.into()))?;
            let selection = groups
                .iter()
                .flat_map(|group| pages(metadata.metadata(), *group, column, frame_id))
                .collect();
            self.read::<R>(&metadata, Some((groups.clone(), Some(selection))), Position::default())
        })
    }

    fn leaf(&self, name: &str) -> Option<usize> {
        let schema = self.metadata.parquet_schema();
        (0..schema.num_columns()).find(|column| schema.column(*column).path().string() == name)
    }

    fn read<R: Record>(
        &self,
        metadata: &ArrowReaderMetadata,
        part: Option<(Vec<usize>, Option<Vec<RowSelector>>)>,
        position: Position,
    ) -> Result<ParquetBatches, Error> {
        let path = self.file.path();
        guarded(path, "Parquet", || {
            let known = metadata
                .parquet_schema()
                .root_schema()
                .get_fields()
                .iter()
                .enumerate()
                .filter(|(_, found)| R::TABLE.fields.iter().any(|field| field.name == found.name()))
                .map(|(index, _)| index);
            let mask = ProjectionMask::roots(metadata.parquet_schema(), known);
            let mut builder =
                ParquetRecordBatchReaderBuilder::new_with_metadata(self.file.clone(), metadata.clone())
                    .with_batch_size(batch_rows(R::TABLE))
                    .with_projection(mask);
            if let Some((groups, selection)) = part {
                builder = builder.with_row_groups(groups);
                if let Some(selection) = selection {
                    builder = builder.with_row_selection(RowSelection::from(selection));
                }
            }
            let reader = builder.build().map_err(|error| Error::container(path, "Parquet")(error.into()))?;
            Ok(ParquetBatches { file: self.file.clone(), reader: Some(reader), position })
        })
    }
}

fn batch_rows(table: &TableInfo) -> usize {
    let fixed = |kind| matches!(kind, ColumnType::Int64 | ColumnType::Float64 | ColumnType::Boolean);
    if table.fields.iter().all(|field| fixed(field.kind)) { BATCH_ROWS } else { BATCH_ROWS_OF_ANY_LENGTH }
}

/// Rows of the file as its footer and its row groups say, which have to agree.
fn claimed_rows(path: &Path, footer: &ParquetMetaData) -> Result<u64, Error> {
    let whole = footer.file_metadata().num_rows();
    let groups = footer.row_groups().iter().try_fold(0_i64, |sum, group| {
        let rows = group.num_rows();
        if rows < 0 { None } else { sum.checked_add(rows) }
    });
    match u64::try_from(whole) {
        Ok(rows) if groups == Some(whole) => Ok(rows),
        _ => Err(Error::Container {
            path: path.to_owned(),
            container: "Parquet",
            detail: match groups {
                Some(groups) => format!("{whole} rows, but {groups} in its row groups"),
                None => format!("{whole} rows, but a row group of less than none or more than can be"),
            },
        }),
    }
}

/// Which rows of a row group lie in pages that may hold the frame.
fn pages(metadata: &ParquetMetaData, group: usize, column: usize, frame_id: FrameId) -> Vec<RowSelector> {
    let rows = usize::try_from(metadata.row_group(group).num_rows()).unwrap_or(0);
    let index = metadata.page_index_for_row_group(group);
    let (Some(ColumnIndexMetaData::INT64(ranges)), Some(locations)) =
        (index.column_index(column), index.page_locations(column))
    else {
        return vec![RowSelector::select(rows)];
    };
    let starts: Vec<usize> = locations
        .iter()
        .map(|page| usize::try_from(page.first_row_index).unwrap_or(0).min(rows))
        .chain([rows])
        .collect();
    starts
        .windows(2)
        .enumerate()
        .map(|(page, range)| {
            let count = range[1].saturating_sub(range[0]);
            let may_hold = ranges.min_value(page).is_none_or(|min| *min <= frame_id.0)
                && ranges.max_value(page).is_none_or(|max| *max >= frame_id.0);
            if may_hold { RowSelector::select(count) } else { RowSelector::skip(count) }
        })
        .collect()
}

/// Refuses more rows than are held in memory at once.
pub(super) fn check_rows(path: &Path, table: &TableInfo, rows: usize, most_rows: u64) -> Result<(), Error> {
    if rows as u64 <= most_rows {
        return Ok(());
    }
    Err(Error::TooLarge {
        path: path.to_owned(),
        what: format!("row count of {}", table.name),
        found: rows as u64,
        limit: most_rows,
    })
}

/// How far a file is read.
#[derive(Debug, Default)]
struct Position {
    /// Number of the next row, for messages.
    row: u64,
    /// Bytes of the file's columns decoded so far, by all who read it together.
    decoded: Arc<AtomicU64>,
}

/// Rows of a table, batch by batch.
pub(super) struct ParquetBatches {
    file: CountedFile,
    reader: Option<ParquetRecordBatchReader>,
    position: Position,
}

impl ParquetBatches {
    /// The next rows; `None` at the end.
    pub(super) fn next_rows<R: Record>(&mut self) -> Option<Result<Vec<R>, Error>> {
        let mut rows = Vec::new();
        Some(self.next_into(&mut rows)?.map(|()| rows))
    }

    /// Appends the next rows; `None` at the end.
    pub(super) fn next_into<R: Record>(&mut self, rows: &mut Vec<R>) -> Option<Result<(), Error>> {
        self.next_as(|batch, first_row| from_batch(batch, first_row, rows))
    }

    /// The next rows as columns; `None` at the end.
    pub(super) fn next_columns(&mut self) -> Option<Result<RecordBatch, Error>> {
        self.next_as(|batch, _| Ok(batch.clone()))
    }

    /// What is made of the next batch and the number of its first row; `None` at the end.
    fn next_as<T>(
        &mut self,
        make: impl FnOnce(&RecordBatch, u64) -> Result<T, Error>,
    ) -> Option<Result<T, Error>> {
        let Self { file, reader, position: Position { row, decoded } } = self;
        let path = file.path();
        let limit = file.length().saturating_mul(MAX_RATIO).saturating_add(ALWAYS_PERMITTED_BYTES);
        let result = guarded(path, "Parquet", || match reader.as_mut().and_then(Iterator::next) {
            None => Ok(None),
            Some(batch) => {
                let batch = batch.map_err(|error| Error::container(path, "Parquet")(error.into()))?;
                let bytes = batch.get_array_memory_size() as u64;
                let found = decoded.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
                if found > limit {
                    // A few bytes of dictionary and of run lengths can stand for any number of long values.
                    return Err(Error::TooLarge {
                        path: path.to_owned(),
                        what: "decoded size of the columns".to_owned(),
                        found,
                        limit,
                    });
                }
                let made = make(&batch, *row)?;
                *row += batch.num_rows() as u64;
                Ok(Some(made))
            }
        })
        .transpose();
        if matches!(result, Some(Err(_))) {
            // The reader's state is not to be trusted after an error.
            *reader = None;
        }
        result
    }
}
