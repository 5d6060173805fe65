//! One table as one Parquet file, encoded column chunk by column chunk.

use std::fs::File;
use std::io::{BufWriter, Sink, sink};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::RecordBatch;
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, FieldRef, Schema, SchemaRef};
use parquet::arrow::arrow_writer::{
    ArrowColumnChunk, ArrowColumnWriter, ArrowRowGroupWriterFactory, compute_leaves,
};
use parquet::arrow::{ArrowSchemaConverter, add_encoded_arrow_schema_to_metadata};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, SortingColumn};
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;
use rayon::prelude::*;

use super::Error;
use super::arrow_schema::arrow_schema;
use crate::structure::TableInfo;

/// Rows of a row group: enough to compress, few enough to hold several of them.
pub(super) const ROW_GROUP_ROWS: usize = 1 << 18;
/// Bytes in memory of a row group, for rows that hold long lists.
const ROW_GROUP_BYTES: usize = 1 << 26;
/// Rows of a data page: what is read, at least, to see one frame.
///
/// Pages are compressed each by itself. The published columns of office3, at zstd 6, over their zip:
/// 0.82 with 2^12 rows, 0.77 with 2^13, 0.75 with 2^14, 0.73 with 2^15; larger ones make one frame dearer.
const PAGE_ROWS: usize = 1 << 14;
/// Room for a dictionary of a whole row group of floats, so that a chunk is encoded one way throughout.
const DICTIONARY_BYTES: usize = ROW_GROUP_ROWS * 16;

/// The layouts are compared in the first of so many row groups; the others take the winner.
const COMPARE_EVERY: usize = 16;
/// Growth in bytes a row at which a column's layouts are compared sooner.
const TOLERATED_GROWTH: f64 = 1.1;

/// How the values of a column chunk may be laid out; the one that comes out smallest is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    /// Distinct values once, rows as references: best for values that recur.
    Dictionary,
    /// Bytes of all values by significance: best for noisy floats.
    ByteStreamSplit,
    /// Differences between neighbours: best for ascending ids.
    Delta,
    /// Values one after the other: best for floats of few decimals, and for ids that come in runs
    /// which were there a frame before.
    Plain,
}

impl Layout {
    fn encoding(self) -> Encoding {
        match self {
            Self::Dictionary | Self::Plain => Encoding::PLAIN,
            Self::ByteStreamSplit => Encoding::BYTE_STREAM_SPLIT,
            Self::Delta => Encoding::DELTA_BINARY_PACKED,
        }
    }

    /// Level of zstd.
    ///
    /// The published columns of office3 over their zip, pages of 2^13 rows: 0.97 at level 1, 0.81 at 3,
    /// 0.77 at 6, 0.77 at 9 and 12, which take 1.6 and 3.8 times as long as 6; all decompress alike. Split
    /// bytes are either constant or noise: level 9 makes them 0.2 % smaller than level 1.
    fn level(self) -> Result<ZstdLevel, ParquetError> {
        ZstdLevel::try_new(match self {
            Self::ByteStreamSplit => 1,
            Self::Dictionary | Self::Delta | Self::Plain => 6,
        })
    }

    /// Layouts worth trying for a column's leaf type.
    fn candidates(data_type: &DataType) -> &'static [Self] {
        match data_type {
            DataType::Float64 => &[Self::Dictionary, Self::ByteStreamSplit, Self::Plain],
            DataType::Int64 => &[Self::Dictionary, Self::Delta, Self::Plain],
            DataType::List(element) => Self::candidates(element.data_type()),
            DataType::Boolean => &[Self::Plain],
            _ => &[Self::Dictionary],
        }
    }
}

/// What a column chunk of a layout depends on.
fn chunk_properties(schema: &Schema, layout: Layout) -> Result<WriterPropertiesBuilder, ParquetError> {
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(layout.level()?))
        .set_statistics_enabled(EnabledStatistics::Page)
        .set_data_page_row_count_limit(PAGE_ROWS)
        .set_dictionary_page_size_limit(DICTIONARY_BYTES)
        .set_max_row_group_row_count(Some(ROW_GROUP_ROWS));
    let fields =
        schema.fields().iter().filter(|field| Layout::candidates(field.data_type()).contains(&layout));
    for field in fields.filter(|_| layout != Layout::Dictionary) {
        let leaf = match field.data_type() {
            DataType::List(element) => vec![field.name().clone(), "list".to_owned(), element.name().clone()],
            _ => vec![field.name().clone()],
        };
        let leaf = ColumnPath::new(leaf);
        properties = properties
            .set_column_dictionary_enabled(leaf.clone(), false)
            .set_column_encoding(leaf, layout.encoding());
    }
    Ok(properties)
}

/// What the whole file of a table is written with; `pairs` are its key-value metadata.
fn file_properties(
    table: &TableInfo,
    schema: &SchemaRef,
    pairs: &[(String, String)],
) -> Result<WriterProperties, ParquetError> {
    let key_values = pairs.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
    // Key columns are leaves of their own, so the index of a field is the index of its leaf.
    let sorting = table
        .key
        .iter()
        .filter_map(|key| table.fields.iter().position(|field| field.name == *key))
        .filter_map(|index| i32::try_from(index).ok())
        .map(|column_idx| SortingColumn { column_idx, descending: false, nulls_first: false })
        .collect();
    let mut properties = chunk_properties(schema, Layout::Dictionary)?
        .set_created_by(format!("open-structure {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(key_values))
        .set_sorting_columns(Some(sorting))
        .build();
    add_encoded_arrow_schema_to_metadata(schema, &mut properties);
    Ok(properties)
}

/// Makes writers of one column in one layout.
///
/// A schema of that column alone, for a factory makes the writers of all its columns at once, each with
/// the memory of a compressor and a decompressor.
struct LayoutFactory {
    factory: ArrowRowGroupWriterFactory,
    layout: Layout,
}

impl LayoutFactory {
    fn new(field: &FieldRef, layout: Layout) -> Result<Self, ParquetError> {
        let schema = Arc::new(Schema::new(vec![Arc::clone(field)]));
        // A factory takes its properties from a file writer; this one writes nothing.
        let root = ArrowSchemaConverter::new().convert(&schema)?.root_schema_ptr();
        let properties = Arc::new(chunk_properties(&schema, layout)?.build());
        let writer: SerializedFileWriter<Sink> = SerializedFileWriter::new(sink(), root, properties)?;
        Ok(Self { factory: ArrowRowGroupWriterFactory::new(&writer, schema), layout })
    }

    /// The layouts worth trying for a column.
    fn candidates(field: &FieldRef) -> Result<Vec<Self>, ParquetError> {
        Layout::candidates(field.data_type()).iter().map(|layout| Self::new(field, *layout)).collect()
    }

    fn column_writer(&self, row_group: usize) -> Result<ArrowColumnWriter, ParquetError> {
        // Every column of ours has one leaf.
        self.factory
            .create_column_writers(row_group)?
            .pop()
            .ok_or_else(|| ParquetError::General(format!("no writer for {:?}", self.layout)))
    }
}

/// Writes one table, a row group at a time.
pub(super) struct ParquetTableWriter {
    path: PathBuf,
    schema: SchemaRef,
    writer: SerializedFileWriter<BufWriter<File>>,
    /// Of each column.
    factories: Vec<Vec<LayoutFactory>>,
    pending: Vec<RecordBatch>,
    pending_rows: usize,
    pending_bytes: usize,
    row_groups: usize,
    /// The layout of each column, and the bytes a row that it took when it was chosen.
    chosen: Vec<Choice>,
}

/// How a column is laid out until the layouts are compared again.
#[derive(Clone, Copy, Debug)]
struct Choice {
    layout: Layout,
    bytes_per_row: f64,
}

impl ParquetTableWriter {
    /// Begins the file of a table; `pairs` are its key-value metadata.
    pub(super) fn create(path: &Path, table: &TableInfo, pairs: &[(String, String)]) -> Result<Self, Error> {
        let file = File::create(path).map_err(Error::io(path))?;
        let schema = arrow_schema(table);
        let make = || -> Result<_, ParquetError> {
            let root = ArrowSchemaConverter::new().convert(&schema)?.root_schema_ptr();
            let properties = Arc::new(file_properties(table, &schema, pairs)?);
            let writer = SerializedFileWriter::new(BufWriter::new(file), root, properties)?;
            let factories =
                schema.fields().iter().map(LayoutFactory::candidates).collect::<Result<_, _>>()?;
            Ok((writer, factories))
        };
        let (writer, factories) = make().map_err(|error| Error::container(path, "Parquet")(error.into()))?;
        Ok(Self {
            path: path.to_owned(),
            schema,
            writer,
            factories,
            pending: Vec::new(),
            pending_rows: 0,
            pending_bytes: 0,
            row_groups: 0,
            chosen: Vec::new(),
        })
    }

    /// Adds rows; writes whenever a row group is full. A batch has at most [`ROW_GROUP_ROWS`] rows.
    pub(super) fn write(&mut self, batch: RecordBatch) -> Result<(), Error> {
        let room = ROW_GROUP_ROWS - self.pending_rows;
        if batch.num_rows() < room {
            self.pending_rows += batch.num_rows();
            self.pending_bytes += batch.get_array_memory_size();
            self.pending.push(batch);
            return if self.pending_bytes >= ROW_GROUP_BYTES { self.flush() } else { Ok(()) };
        }
        let rest = batch.slice(room, batch.num_rows() - room);
        self.pending.push(batch.slice(0, room));
        self.flush()?;
        if rest.num_rows() > 0 {
            self.pending_rows = rest.num_rows();
            self.pending.push(rest);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        let batches = std::mem::take(&mut self.pending);
        (self.pending_rows, self.pending_bytes) = (0, 0);
        let failed = Error::container(&self.path, "Parquet");
        let write = || -> Result<(), ParquetError> {
            let batch = concat_batches(&self.schema, &batches)?;
            drop(batches);
            // Columns side by side on all cores; which layout wins depends on sizes alone.
            let compare = self.row_groups.is_multiple_of(COMPARE_EVERY);
            let columns: Vec<(ArrowColumnChunk, Choice)> = (0..batch.num_columns())
                .into_par_iter()
                .map(|column| {
                    let before = self.chosen.get(column).filter(|_| !compare).copied();
                    encode(&self.factories[column], self.row_groups, &batch, column, before)
                })
                .collect::<Result<_, _>>()?;
            let (chunks, chosen): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
            self.chosen = chosen;
            let mut row_group = self.writer.next_row_group()?;
            for chunk in chunks {
                chunk.append_to_row_group(&mut row_group)?;
            }
            row_group.close()?;
            Ok(())
        };
        write().map_err(|error| failed(error.into()))?;
        self.row_groups += 1;
        Ok(())
    }

    /// Writes what is left, and the footer.
    pub(super) fn finish(mut self) -> Result<(), Error> {
        if self.pending_rows > 0 {
            self.flush()?;
        }
        let Self { path, writer, .. } = self;
        writer.close().map_err(|error| Error::container(&path, "Parquet")(error.into()))?;
        Ok(())
    }
}

/// The column chunk in the layout chosen before, or, when there is none or it has become much worse, in
/// the one that takes the fewest bytes; the first candidate wins a tie.
fn encode(
    factories: &[LayoutFactory],
    row_group: usize,
    batch: &RecordBatch,
    column: usize,
    before: Option<Choice>,
) -> Result<(ArrowColumnChunk, Choice), ParquetError> {
    let schema = batch.schema();
    let field = schema.field(column);
    let leaves = compute_leaves(field, batch.column(column))?;
    let with = |factory: &LayoutFactory| -> Result<(ArrowColumnChunk, Choice), ParquetError> {
        let mut writer = factory.column_writer(row_group)?;
        for leaf in &leaves {
            writer.write(leaf)?;
        }
        let chunk = writer.close()?;
        let bytes_per_row = chunk.close().bytes_written as f64 / batch.num_rows() as f64;
        Ok((chunk, Choice { layout: factory.layout, bytes_per_row }))
    };
    let mut best: Option<(ArrowColumnChunk, Choice)> = None;
    if let Some(before) = before {
        for factory in factories.iter().filter(|factory| factory.layout == before.layout) {
            let (chunk, found) = with(factory)?;
            if found.bytes_per_row <= before.bytes_per_row * TOLERATED_GROWTH {
                return Ok((chunk, before));
            }
            best = Some((chunk, found));
        }
    }
    for factory in factories {
        if best.as_ref().is_some_and(|(_, best)| best.layout == factory.layout) {
            continue;
        }
        let (chunk, found) = with(factory)?;
        if best.as_ref().is_none_or(|(_, best)| found.bytes_per_row < best.bytes_per_row) {
            best = Some((chunk, found));
        }
    }
    best.ok_or_else(|| ParquetError::General(format!("no layout for column {}", field.name())))
}
