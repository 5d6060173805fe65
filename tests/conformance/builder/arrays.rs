//! Cells as Arrow arrays.

use std::collections::HashMap;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, BinaryArray, BooleanArray, Float32Array, Float64Array, Int32Array, Int64Array,
    LargeStringArray, ListArray, RecordBatch, StringArray,
};
use arrow::buffer::{NullBuffer, OffsetBuffer};
use arrow::datatypes::{DataType, Field, Schema, SchemaRef};

use super::Result;
use super::document::{Cell, Column, Kind, Table};

fn data_type(table: &Table, index: usize) -> DataType {
    let column = &table.columns[index];
    let list = |element| {
        let nullable = table.rows.iter().any(|row| row[index].has_null_element());
        DataType::List(Arc::new(Field::new(&column.element, element, nullable)))
    };
    match column.kind {
        Kind::Int64 => DataType::Int64,
        Kind::Int32 => DataType::Int32,
        Kind::Float64 => DataType::Float64,
        Kind::Float32 => DataType::Float32,
        Kind::Boolean => DataType::Boolean,
        Kind::Utf8 => DataType::Utf8,
        Kind::LargeUtf8 => DataType::LargeUtf8,
        Kind::Binary => DataType::Binary,
        Kind::Int64List => list(DataType::Int64),
        Kind::Int32List => list(DataType::Int32),
        Kind::Float64List => list(DataType::Float64),
        Kind::Float32List => list(DataType::Float32),
        Kind::Utf8List => list(DataType::Utf8),
    }
}

/// Schema of a table as it is stored; a column that holds a null says that it may.
pub(crate) fn schema(table: &Table, version: &str) -> SchemaRef {
    let fields = table.columns.iter().enumerate().map(|(index, column)| {
        let nullable = column.nullable || table.rows.iter().any(|row| row[index].is_null());
        let notes: HashMap<_, _> =
            column.notes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        Field::new(&column.name, data_type(table, index), nullable).with_metadata(notes)
    });
    let metadata = HashMap::from([
        ("open-structure.table".to_owned(), table.name.clone()),
        ("open-structure.spec_version".to_owned(), version.to_owned()),
    ]);
    Arc::new(Schema::new_with_metadata(fields.collect::<Vec<_>>(), metadata))
}

/// Some rows of a table as one record batch.
pub(crate) fn batch(table: &Table, schema: &SchemaRef, rows: &[Vec<Cell>]) -> Result<RecordBatch> {
    let columns = table
        .columns
        .iter()
        .enumerate()
        .map(|(index, column)| {
            let cells: Vec<&Cell> = rows.iter().map(|row| &row[index]).collect();
            array(column, schema.field(index).data_type(), &cells)
        })
        .collect();
    RecordBatch::try_new(Arc::clone(schema), columns).map_err(|error| format!("{}: {error}", table.name))
}

fn array(column: &Column, stored: &DataType, cells: &[&Cell]) -> ArrayRef {
    let text = |cell: &Cell| if let Cell::Text(text) = cell { Some(text.clone()) } else { None };
    match column.kind {
        Kind::Int64 => Arc::new(cells.iter().map(|cell| cell.int()).collect::<Int64Array>()),
        Kind::Int32 => Arc::new(cells.iter().map(|cell| cell.int().map(narrow)).collect::<Int32Array>()),
        Kind::Float64 => Arc::new(cells.iter().map(|cell| cell.float()).collect::<Float64Array>()),
        Kind::Float32 => {
            #[expect(clippy::cast_possible_truncation, reason = "a defect on purpose")]
            let values = cells.iter().map(|cell| cell.float().map(|value| value as f32));
            Arc::new(values.collect::<Float32Array>())
        }
        Kind::Boolean => {
            let values =
                cells.iter().map(|cell| if let Cell::Bool(value) = cell { Some(*value) } else { None });
            Arc::new(values.collect::<BooleanArray>())
        }
        Kind::Utf8 => Arc::new(cells.iter().map(|cell| text(cell)).collect::<StringArray>()),
        Kind::LargeUtf8 => Arc::new(cells.iter().map(|cell| text(cell)).collect::<LargeStringArray>()),
        Kind::Binary => {
            let values =
                cells.iter().map(|cell| if let Cell::Bytes(bytes) = cell { Some(bytes) } else { None });
            Arc::new(values.collect::<BinaryArray>())
        }
        Kind::Int64List | Kind::Int32List | Kind::Float64List | Kind::Float32List | Kind::Utf8List => {
            list(stored, cells)
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a defect on purpose")]
fn narrow(value: i64) -> i32 {
    value as i32
}

fn list(stored: &DataType, cells: &[&Cell]) -> ArrayRef {
    let DataType::List(element) = stored else {
        return Arc::new(BooleanArray::from(vec![false; cells.len()]));
    };
    let (mut ints, mut floats, mut texts) = (Vec::new(), Vec::new(), Vec::new());
    let mut lengths = Vec::with_capacity(cells.len());
    for cell in cells {
        lengths.push(match cell {
            Cell::Ints(values) => {
                ints.extend_from_slice(values);
                values.len()
            }
            Cell::Floats(values) => {
                floats.extend_from_slice(values);
                values.len()
            }
            Cell::Texts(values) => {
                texts.extend_from_slice(values);
                values.len()
            }
            _ => 0,
        });
    }
    #[expect(clippy::cast_possible_truncation, reason = "a defect on purpose")]
    let values: ArrayRef = match element.data_type() {
        DataType::Int32 => Arc::new(ints.into_iter().map(|value| value.map(narrow)).collect::<Int32Array>()),
        DataType::Float64 => Arc::new(Float64Array::from(floats)),
        DataType::Utf8 => Arc::new(StringArray::from(texts)),
        DataType::Float32 => Arc::new(
            floats.into_iter().map(|value| value.map(|value| value as f32)).collect::<Float32Array>(),
        ),
        _ => Arc::new(Int64Array::from(ints)),
    };
    let present: Vec<bool> = cells.iter().map(|cell| !cell.is_null()).collect();
    let nulls = present.contains(&false).then(|| NullBuffer::from(present));
    Arc::new(ListArray::new(Arc::clone(element), OffsetBuffer::from_lengths(lengths), values, nulls))
}
