//! Tables of results as Parquet files, for pandas, polars and duckdb.

use std::collections::HashMap;
use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::WriterProperties;

use super::Error;
use super::partial::Partial;
use crate::structure::{ResultTable, ResultValues};

/// Writes a table of results as one Parquet file; units and meanings are metadata of its columns.
///
/// * `force` — whether a file that is there is replaced.
///
/// # Errors
/// [`Error::Exists`] when something is there, [`Error::Io`], and [`Error::Container`] when the columns differ in length.
pub fn write_results(path: &Path, table: &ResultTable, force: bool) -> Result<(), Error> {
    let container = |detail: String| Error::Container { path: path.to_owned(), container: "Parquet", detail };
    let batch = as_batch(table).map_err(|cause| container(cause.to_string()))?;
    let partial = Partial::file(path, force)?;
    let mut bytes = Vec::new();
    let properties = WriterProperties::builder()
        .set_created_by(format!("open-structure {}", env!("CARGO_PKG_VERSION")))
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .build();
    let written =
        ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties)).and_then(|mut writer| {
            writer.write(&batch)?;
            writer.close()
        });
    written.map_err(|cause| container(cause.to_string()))?;
    partial.create_file()?.write_all(&bytes).map_err(Error::io(partial.path()))?;
    partial.finish()
}

/// A table of results as one record batch; units and meanings are metadata of its columns.
///
/// # Errors
/// [`Error::Container`] when the columns differ in length.
pub fn results_batch(table: &ResultTable) -> Result<RecordBatch, Error> {
    as_batch(table).map_err(|cause| Error::container(Path::new(&table.name), "Arrow")(cause.into()))
}

fn as_batch(table: &ResultTable) -> Result<RecordBatch, arrow::error::ArrowError> {
    let fields: Vec<Field> = table
        .columns
        .iter()
        .map(|column| {
            let metadata = [("unit", &column.unit), ("description", &column.meaning)];
            let metadata: HashMap<_, _> = metadata.map(|(key, value)| (key.to_owned(), value.clone())).into();
            let array = array(&column.values);
            Field::new(&column.name, array.data_type().clone(), true).with_metadata(metadata)
        })
        .collect();
    let name: HashMap<_, _> = [("name".to_owned(), table.name.clone())].into();
    let schema = Arc::new(Schema::new_with_metadata(fields, name));
    let arrays = table.columns.iter().map(|column| array(&column.values)).collect();
    RecordBatch::try_new(schema, arrays)
}

/// Writes a text file as outputs are written: under a temporary name first.
///
/// # Errors
/// [`Error::Exists`] when something is there and `force` is not given, and [`Error::Io`].
pub fn write_text(path: &Path, text: &str, force: bool) -> Result<(), Error> {
    let partial = Partial::file(path, force)?;
    partial.create_file()?.write_all(text.as_bytes()).map_err(Error::io(partial.path()))?;
    partial.finish()
}

fn array(values: &ResultValues) -> ArrayRef {
    match values {
        ResultValues::Text(values) => Arc::new(StringArray::from(values.clone())),
        ResultValues::Integer(values) => Arc::new(Int64Array::from(values.clone())),
        ResultValues::Number(values) => Arc::new(Float64Array::from(values.clone())),
    }
}

/// Reads a table of results that [`write_results`] wrote.
///
/// # Errors
/// [`Error::Io`], and [`Error::Container`] when it is no Parquet file or has columns of another type than words, whole
/// numbers and numbers.
pub fn read_results(path: &Path) -> Result<ResultTable, Error> {
    use arrow::array::{Array as _, AsArray as _};
    use arrow::datatypes::{DataType, Float64Type, Int64Type};
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    use crate::structure::ResultColumn;

    let container = |detail: String| Error::Container { path: path.to_owned(), container: "Parquet", detail };
    let file = std::fs::File::open(path).map_err(Error::io(path))?;
    let builder =
        ParquetRecordBatchReaderBuilder::try_new(file).map_err(|cause| container(cause.to_string()))?;
    let schema = Arc::clone(builder.schema());
    let mut columns = Vec::new();
    for field in schema.fields() {
        let values = match field.data_type() {
            DataType::Utf8 => ResultValues::Text(Vec::new()),
            DataType::Int64 => ResultValues::Integer(Vec::new()),
            DataType::Float64 => ResultValues::Number(Vec::new()),
            other => return Err(container(format!("column {}: unexpected type {other}", field.name()))),
        };
        let metadata = |key: &str| field.metadata().get(key).cloned().unwrap_or_default();
        columns.push(ResultColumn {
            name: field.name().clone(),
            unit: metadata("unit"),
            meaning: metadata("description"),
            values,
        });
    }
    for batch in builder.build().map_err(|cause| container(cause.to_string()))? {
        let batch = batch.map_err(|cause| container(cause.to_string()))?;
        for (column, array) in columns.iter_mut().zip(batch.columns()) {
            match &mut column.values {
                ResultValues::Text(values) => {
                    values.extend(array.as_string::<i32>().iter().map(|value| value.map(str::to_owned)));
                }
                ResultValues::Integer(values) => values.extend(array.as_primitive::<Int64Type>().iter()),
                ResultValues::Number(values) => values.extend(array.as_primitive::<Float64Type>().iter()),
            }
            debug_assert_eq!(array.len(), batch.num_rows());
        }
    }
    let name = schema.metadata().get("name").cloned().unwrap_or_default();
    Ok(ResultTable { name, columns })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_results_is_read_as_it_was_written() {
        let table = ResultTable::new("errors")
            .text("estimate", "which estimate", [Some("point-ba"), None])
            .integer("frames", "1", "how many", [Some(-3), None])
            .number("rmse_m", "m", "how far", [Some(0.1), None]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("errors.parquet");
        write_results(&path, &table, false).unwrap();
        assert_eq!(read_results(&path).unwrap(), table);
        assert!(matches!(write_results(&path, &table, false), Err(Error::Exists { .. })));
        write_results(&path, &table, true).unwrap();
        std::fs::write(&path, b"PAR1 and no more").unwrap();
        assert!(matches!(read_results(&path), Err(Error::Container { .. })));
    }
}
