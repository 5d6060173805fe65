//! Arrow schemas of the tables, with unit, space and description on every field.

use std::collections::HashMap;
use std::sync::Arc;

use arrow::datatypes::{DataType, Field as ArrowField, Schema, SchemaRef};

use crate::structure::registry::SPEC_VERSION;
use crate::structure::{ColumnType, Field, TableInfo};

/// Metadata key of a schema: table name.
pub(super) const TABLE_KEY: &str = "open-structure.table";
/// Metadata key of a schema: specification version.
pub(super) const VERSION_KEY: &str = "open-structure.spec_version";

/// Arrow type of a column.
#[must_use]
pub(super) fn data_type(kind: ColumnType) -> DataType {
    let list = |element| DataType::List(Arc::new(ArrowField::new("element", element, false)));
    match kind {
        ColumnType::Int64 => DataType::Int64,
        ColumnType::Float64 => DataType::Float64,
        ColumnType::Boolean => DataType::Boolean,
        ColumnType::Utf8 => DataType::Utf8,
        ColumnType::Binary => DataType::Binary,
        ColumnType::Int64List => list(DataType::Int64),
        ColumnType::Float64List => list(DataType::Float64),
        ColumnType::Utf8List => list(DataType::Utf8),
    }
}

fn arrow_field(field: &Field) -> ArrowField {
    let metadata = HashMap::from([
        ("description".to_owned(), field.description()),
        ("unit".to_owned(), field.unit.to_owned()),
        ("space".to_owned(), field.space.to_owned()),
    ]);
    ArrowField::new(field.name, data_type(field.kind), field.nullable).with_metadata(metadata)
}

/// Arrow schema of a table.
#[must_use]
pub fn arrow_schema(table: &TableInfo) -> SchemaRef {
    let metadata = HashMap::from([
        (TABLE_KEY.to_owned(), table.name.to_owned()),
        (VERSION_KEY.to_owned(), SPEC_VERSION.to_owned()),
    ]);
    Arc::new(Schema::new_with_metadata(table.fields.iter().map(arrow_field).collect::<Vec<_>>(), metadata))
}
