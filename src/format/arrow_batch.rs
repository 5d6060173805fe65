//! Rows to Arrow record batches and back.

use std::sync::Arc;

use arrow::array::{
    Array, ArrayRef, BinaryArray, BooleanArray, Float64Array, Int64Array, ListArray, RecordBatch,
    StringArray, cast::AsArray,
};
use arrow::buffer::{NullBuffer, OffsetBuffer, ScalarBuffer};
use arrow::datatypes::{DataType, Field as ArrowField, Float64Type, Int64Type, SchemaRef};

use super::Error;
use super::arrow_schema::data_type;
use crate::structure::{Bitmap, ColumnSink, ColumnSource, Field, Lists, Nullable, Record, TextLists};

/// One record batch of some rows.
///
/// # Errors
/// [`Error::Container`] when the columns do not fit the schema, which would be a mistake of ours.
pub(super) fn to_batch<R: Record>(
    rows: &[R],
    schema: &SchemaRef,
) -> Result<RecordBatch, arrow::error::ArrowError> {
    let mut sink = Columns { columns: Vec::with_capacity(schema.fields().len()) };
    R::put(rows, &mut sink);
    RecordBatch::try_new(Arc::clone(schema), sink.columns)
}

/// Appends the rows of one record batch; `first_row` is the number of its first row, for messages.
///
/// Columns are found by name; unknown ones are passed over; absent nullable ones are all null.
pub(super) fn from_batch<R: Record>(
    batch: &RecordBatch,
    first_row: u64,
    rows: &mut Vec<R>,
) -> Result<(), Error> {
    let mut columns = Vec::with_capacity(R::TABLE.fields.len());
    for field in R::TABLE.fields {
        columns.push(column(batch, R::TABLE.name, field)?);
    }
    let source =
        Batch { table: R::TABLE.name, fields: R::TABLE.fields, columns, rows: batch.num_rows(), first_row };
    R::take(&source, rows)
}

/// A column by its name, of the type that the specification says; one that may be absent is all null then.
pub(super) fn column(
    batch: &RecordBatch,
    table: &'static str,
    field: &'static Field,
) -> Result<ArrayRef, Error> {
    let Some(array) = batch.column_by_name(field.name) else {
        if field.nullable {
            return Ok(arrow::array::new_null_array(&data_type(field.kind), batch.num_rows()));
        }
        return Err(Error::MissingColumn { table, column: field.name, expected: field.kind.name() });
    };
    if matches_type(array.data_type(), &data_type(field.kind)) {
        Ok(Arc::clone(array))
    } else {
        Err(Error::ColumnType {
            table,
            column: field.name,
            expected: field.kind.name(),
            found: array.data_type().to_string(),
        })
    }
}

/// Whether a stored type serves; names and nullability of list elements are free.
pub(super) fn matches_type(found: &DataType, expected: &DataType) -> bool {
    match (found, expected) {
        (DataType::List(found), DataType::List(expected)) => found.data_type() == expected.data_type(),
        _ => found == expected,
    }
}

struct Columns {
    columns: Vec<ArrayRef>,
}

impl Columns {
    fn list(&mut self, offsets: Vec<i32>, values: ArrayRef, nulls: Option<NullBuffer>) {
        let element = Arc::new(ArrowField::new("element", values.data_type().clone(), false));
        let offsets = OffsetBuffer::new(ScalarBuffer::from(offsets));
        self.columns.push(Arc::new(ListArray::new(element, offsets, values, nulls)));
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "writers keep batches far below 2^31 elements"
)]
fn end<T>(values: &[T]) -> i32 {
    values.len() as i32
}

impl ColumnSink for Columns {
    fn int64(&mut self, values: impl ExactSizeIterator<Item = i64>) {
        self.columns.push(Arc::new(Int64Array::from_iter_values(values)));
    }
    fn optional_int64(&mut self, values: impl ExactSizeIterator<Item = Option<i64>>) {
        self.columns.push(Arc::new(values.collect::<Int64Array>()));
    }
    fn float64(&mut self, values: impl ExactSizeIterator<Item = f64>) {
        self.columns.push(Arc::new(Float64Array::from_iter_values(values)));
    }
    fn optional_float64(&mut self, values: impl ExactSizeIterator<Item = Option<f64>>) {
        self.columns.push(Arc::new(values.collect::<Float64Array>()));
    }
    fn boolean(&mut self, values: impl ExactSizeIterator<Item = bool>) {
        self.columns.push(Arc::new(values.map(Some).collect::<BooleanArray>()));
    }
    fn utf8<'v>(&mut self, values: impl ExactSizeIterator<Item = &'v str>) {
        self.columns.push(Arc::new(StringArray::from_iter_values(values)));
    }
    fn optional_utf8<'v>(&mut self, values: impl ExactSizeIterator<Item = Option<&'v str>>) {
        self.columns.push(Arc::new(values.collect::<StringArray>()));
    }
    fn optional_binary<'v>(&mut self, values: impl ExactSizeIterator<Item = Option<&'v [u8]>>) {
        self.columns.push(Arc::new(values.collect::<BinaryArray>()));
    }
    fn int64_list<I: Iterator<Item = i64>>(&mut self, lists: impl ExactSizeIterator<Item = I>) {
        let (mut offsets, mut values) = (vec![0], Vec::new());
        for list in lists {
            values.extend(list);
            offsets.push(end(&values));
        }
        self.list(offsets, Arc::new(Int64Array::from(values)), None);
    }
    fn utf8_list<'v>(&mut self, lists: impl ExactSizeIterator<Item = &'v [String]>) {
        let (mut offsets, mut values) = (vec![0], Vec::new());
        for list in lists {
            values.extend(list.iter().map(String::as_str));
            offsets.push(end(&values));
        }
        self.list(offsets, Arc::new(StringArray::from(values)), None);
    }
    fn float64_list<'v>(&mut self, lists: impl ExactSizeIterator<Item = &'v [f64]>) {
        let (mut offsets, mut values) = (vec![0], Vec::new());
        for list in lists {
            values.extend_from_slice(list);
            offsets.push(end(&values));
        }
        self.list(offsets, Arc::new(Float64Array::from(values)), None);
    }
    fn optional_float64_list<'v>(&mut self, lists: impl ExactSizeIterator<Item = Option<&'v [f64]>>) {
        let (mut offsets, mut values, mut present) = (vec![0], Vec::new(), Vec::with_capacity(lists.len()));
        for list in lists {
            values.extend_from_slice(list.unwrap_or_default());
            offsets.push(end(&values));
            present.push(list.is_some());
        }
        let nulls = present.contains(&false).then(|| NullBuffer::from(present));
        self.list(offsets, Arc::new(Float64Array::from(values)), nulls);
    }
}

struct Batch {
    table: &'static str,
    fields: &'static [Field],
    columns: Vec<ArrayRef>,
    rows: usize,
    first_row: u64,
}

impl Batch {
    /// Refuses a column in which a value is absent.
    fn whole(&self, field: usize) -> Result<&ArrayRef, Error> {
        let array = &self.columns[field];
        match array.nulls().filter(|nulls| nulls.null_count() > 0) {
            None => Ok(array),
            Some(nulls) => {
                let row = (0..nulls.len()).find(|row| nulls.is_null(*row)).unwrap_or(0);
                Err(self.null(field, row))
            }
        }
    }

    fn null(&self, field: usize, row: usize) -> Error {
        Error::Null { table: self.table, row: self.first_row + row as u64, column: self.fields[field].name }
    }

    /// The other types were refused when the columns were looked up.
    fn list_of<'a, T>(
        &'a self,
        field: usize,
        values: impl Fn(&'a ListArray) -> &'a [T],
    ) -> Result<Lists<'a, T>, Error> {
        let list = self.list(field)?;
        Ok(Lists { offsets: list.offsets(), values: values(list), validity: validity(list) })
    }

    /// A list in which no element is null.
    fn list(&self, field: usize) -> Result<&ListArray, Error> {
        let list = self.columns[field].as_list::<i32>();
        if let Some(nulls) = list.values().nulls().filter(|nulls| nulls.null_count() > 0) {
            let element = (0..nulls.len()).find(|row| nulls.is_null(*row)).unwrap_or(0);
            let row =
                list.offsets().partition_point(|offset| usize::try_from(*offset).unwrap_or(0) <= element);
            return Err(self.null(field, row.saturating_sub(1)));
        }
        Ok(list)
    }
}

fn validity(array: &dyn Array) -> Option<Bitmap<'_>> {
    array.nulls().map(|nulls| Bitmap { bytes: nulls.validity(), offset: nulls.offset() })
}

impl ColumnSource for Batch {
    type Error = Error;

    fn len(&self) -> usize {
        self.rows
    }
    fn int64(&self, field: usize) -> Result<&[i64], Error> {
        Ok(self.whole(field)?.as_primitive::<Int64Type>().values())
    }
    fn optional_int64(&self, field: usize) -> Result<Nullable<'_, i64>, Error> {
        let array = self.columns[field].as_primitive::<Int64Type>();
        Ok(Nullable { values: array.values(), validity: validity(array) })
    }
    fn float64(&self, field: usize) -> Result<&[f64], Error> {
        Ok(self.whole(field)?.as_primitive::<Float64Type>().values())
    }
    fn optional_float64(&self, field: usize) -> Result<Nullable<'_, f64>, Error> {
        let array = self.columns[field].as_primitive::<Float64Type>();
        Ok(Nullable { values: array.values(), validity: validity(array) })
    }
    fn boolean(&self, field: usize) -> Result<Bitmap<'_>, Error> {
        let bits = self.whole(field)?.as_boolean().values();
        Ok(Bitmap { bytes: bits.values(), offset: bits.offset() })
    }
    fn utf8(&self, field: usize) -> Result<Lists<'_, u8>, Error> {
        let array = self.whole(field)?.as_string::<i32>();
        Ok(Lists { offsets: array.offsets(), values: array.value_data(), validity: None })
    }
    fn optional_utf8(&self, field: usize) -> Result<Lists<'_, u8>, Error> {
        let array = self.columns[field].as_string::<i32>();
        Ok(Lists { offsets: array.offsets(), values: array.value_data(), validity: validity(array) })
    }
    fn optional_binary(&self, field: usize) -> Result<Lists<'_, u8>, Error> {
        let array = self.columns[field].as_binary::<i32>();
        Ok(Lists { offsets: array.offsets(), values: array.value_data(), validity: validity(array) })
    }
    fn int64_list(&self, field: usize) -> Result<Lists<'_, i64>, Error> {
        self.whole(field)?;
        self.list_of(field, |list| list.values().as_primitive::<Int64Type>().values())
    }
    fn utf8_list(&self, field: usize) -> Result<TextLists<'_>, Error> {
        self.whole(field)?;
        let list = self.list(field)?;
        let texts = list.values().as_string::<i32>();
        let texts = Lists { offsets: texts.offsets(), values: texts.value_data(), validity: None };
        Ok(TextLists { offsets: list.offsets(), texts })
    }
    fn float64_list(&self, field: usize) -> Result<Lists<'_, f64>, Error> {
        self.whole(field)?;
        self.optional_float64_list(field)
    }
    fn optional_float64_list(&self, field: usize) -> Result<Lists<'_, f64>, Error> {
        self.list_of(field, |list| list.values().as_primitive::<Float64Type>().values())
    }
}
