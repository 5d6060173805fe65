//! Whole tables as Arrow columns, each one record batch with the schema of the specification.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, ListArray, RecordBatch, cast::AsArray};
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, SchemaRef};

use super::Error;
use super::arrow_batch::{column, to_batch};
use super::arrow_schema::{arrow_schema, data_type};
use super::parquet_reader::check_rows;
use super::reader::{MAX_ROWS_IN_MEMORY, SequenceReader};
use crate::structure::{Field, Record, Sequence, TableInfo, for_each_table};

impl SequenceReader {
    /// All rows of a table as one record batch with the schema of the specification; without rows where the table is not there.
    ///
    /// Optional columns that the file does not have are all null; unknown ones are passed over. Values are not copied one by one, as
    /// [`table`](Self::table) does, but column by column.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn record_batch(&self, table: &'static TableInfo) -> Result<RecordBatch, Error> {
        macro_rules! each {
            ($($name:ident: $row:ident,)+) => {
                $(
                    if table.name == stringify!($name) {
                        return self.record_batch_of::<crate::structure::$row>();
                    }
                )+
            };
        }
        for_each_table!(each);
        Ok(RecordBatch::new_empty(arrow_schema(table)))
    }

    fn record_batch_of<R: Record>(&self) -> Result<RecordBatch, Error> {
        let schema = arrow_schema(R::TABLE);
        let (mut batches, mut rows) = (Vec::new(), 0);
        for batch in self.record_batches::<R>()? {
            let batch = as_specified(self.path(), &batch?, R::TABLE, &schema, rows as u64)?;
            rows += batch.num_rows();
            check_rows(self.path(), R::TABLE, rows, MAX_ROWS_IN_MEMORY)?;
            batches.push(batch);
        }
        concat_batches(&schema, &batches)
            .map_err(|cause| Error::container(self.path(), "Arrow")(cause.into()))
    }
}

/// Rows in memory as one record batch with the schema of the specification.
///
/// # Errors
/// [`Error::Container`] when the columns do not fit the schema, which would be a mistake of ours.
pub fn record_batch<R: Record>(rows: &[R]) -> Result<RecordBatch, Error> {
    to_batch(rows, &arrow_schema(R::TABLE))
        .map_err(|cause| Error::container(Path::new(R::TABLE.name), "Arrow")(cause.into()))
}

/// A table of a sequence in memory, as [`record_batch`].
///
/// # Errors
/// As [`record_batch`].
pub fn record_batch_of(sequence: &Sequence, table: &'static TableInfo) -> Result<RecordBatch, Error> {
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            $(
                if table.name == stringify!($name) {
                    return record_batch(&sequence.$name);
                }
            )+
        };
    }
    for_each_table!(each);
    Ok(RecordBatch::new_empty(arrow_schema(table)))
}

/// A batch of a file with the columns and the schema of the specification.
fn as_specified(
    path: &Path,
    batch: &RecordBatch,
    table: &'static TableInfo,
    schema: &SchemaRef,
    first_row: u64,
) -> Result<RecordBatch, Error> {
    let columns: Result<Vec<ArrayRef>, Error> = table
        .fields
        .iter()
        .map(|field| whole(column(batch, table.name, field)?, table, field, first_row))
        .collect();
    RecordBatch::try_new(Arc::clone(schema), columns?)
        .map_err(|cause| Error::container(path, "Arrow")(cause.into()))
}

/// A column without nulls where there may be none, its lists named as the specification names them.
fn whole(
    array: ArrayRef,
    table: &'static TableInfo,
    field: &'static Field,
    first_row: u64,
) -> Result<ArrayRef, Error> {
    let null =
        |row: usize| Error::Null { table: table.name, row: first_row + row as u64, column: field.name };
    if let Some(row) = (!field.nullable).then(|| first_null(&array)).flatten() {
        return Err(null(row));
    }
    let DataType::List(element) = data_type(field.kind) else { return Ok(array) };
    let list = array.as_list::<i32>();
    if let Some(place) = first_null(list.values()) {
        let row = list.offsets().partition_point(|offset| usize::try_from(*offset).unwrap_or(0) <= place);
        return Err(null(row.saturating_sub(1)));
    }
    let (offsets, values) = (list.offsets().clone(), Arc::clone(list.values()));
    Ok(Arc::new(ListArray::new(element, offsets, values, list.nulls().cloned())))
}

fn first_null(array: &dyn Array) -> Option<usize> {
    let nulls = array.nulls().filter(|nulls| nulls.null_count() > 0)?;
    (0..nulls.len()).find(|row| nulls.is_null(*row))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{self, WriteOptions};
    use crate::structure::{
        CameraId, Frame, FrameId, GroupId, LineId, PointId, PointMeasurement, StructuralGroup, TABLES,
    };

    fn sequence() -> Sequence {
        let mut sequence = Sequence::default();
        for frame_id in (0..3).map(FrameId) {
            sequence.frames.push(Frame::new(frame_id, frame_id.0, CameraId(0), None));
            for place in 0..5 {
                let (u, depth) = (f64::from(place) * 1.1, (place != 2).then_some(2.0));
                let point_id = PointId(i64::from(place));
                sequence.point_measurements.push(PointMeasurement { frame_id, point_id, u, v: 1.5, depth });
            }
        }
        for id in 0..2 {
            sequence.structural_groups.push(StructuralGroup {
                group_id: GroupId(id),
                kind: "parallel".to_owned(),
                line_ids: vec![LineId(id), LineId(id + 7)],
                ..StructuralGroup::default()
            });
        }
        sequence
    }

    #[test]
    fn a_file_gives_the_columns_that_memory_gives() {
        let (sequence, folder) = (sequence(), tempfile::tempdir().unwrap());
        for name in ["sequence", "sequence.mcap"] {
            let path = folder.path().join(name);
            format::write(&path, &sequence, WriteOptions::default()).unwrap();
            let reader = format::open(&path).unwrap();
            for table in TABLES {
                let expected = record_batch_of(&sequence, table).unwrap();
                assert_eq!(reader.record_batch(table).unwrap(), expected, "{name} {}", table.name);
                assert_eq!(expected.schema(), arrow_schema(table), "{name}");
            }
            assert_eq!(reader.record_batch(PointMeasurement::TABLE).unwrap().num_rows(), 15);
        }
    }

    #[test]
    fn a_null_where_none_may_be_is_told_by_its_row() {
        let (schema, field) = (arrow_schema(Frame::TABLE), &Frame::TABLE.fields[0]);
        let array: ArrayRef = Arc::new(arrow::array::Int64Array::from(vec![Some(1), None]));
        let found = whole(array, Frame::TABLE, field, 10).unwrap_err();
        assert_eq!(found.to_string(), "frames row 11: column frame_id is null");
        let empty = RecordBatch::new_empty(Arc::new(arrow::datatypes::Schema::empty()));
        let found = as_specified(Path::new("x"), &empty, Frame::TABLE, &schema, 0).unwrap_err();
        assert!(matches!(found, Error::MissingColumn { column: "frame_id", .. }), "{found}");
    }
}
