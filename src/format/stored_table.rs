//! A table as it stands in a file: what is there of what the specification knows.

use arrow::datatypes::Schema;

use super::arrow_batch::matches_type;
use super::arrow_schema::data_type;
use crate::structure::TableInfo;

/// A known table of a file.
#[derive(Clone, Debug)]
pub struct StoredTable {
    /// The table.
    pub table: &'static TableInfo,
    /// Rows, where the container says so.
    pub rows: Option<u64>,
    /// Columns that this version does not know; they are passed over.
    pub unknown_columns: Vec<String>,
    /// Columns that every row needs and that are missing.
    pub missing_columns: Vec<&'static str>,
    /// Columns of another type: name, found type, expected type.
    pub mistyped_columns: Vec<(&'static str, String, &'static str)>,
}

impl StoredTable {
    pub(super) fn new(table: &'static TableInfo, schema: &Schema, rows: Option<u64>) -> Self {
        let unknown_columns = schema
            .fields()
            .iter()
            .filter(|found| table.fields.iter().all(|field| field.name != found.name()))
            .map(|found| found.name().clone())
            .collect();
        let (mut missing_columns, mut mistyped_columns) = (Vec::new(), Vec::new());
        for field in table.fields {
            match schema.field_with_name(field.name) {
                Err(_) if field.nullable => {}
                Err(_) => missing_columns.push(field.name),
                Ok(found) if matches_type(found.data_type(), &data_type(field.kind)) => {}
                Ok(found) => {
                    mistyped_columns.push((field.name, found.data_type().to_string(), field.kind.name()));
                }
            }
        }
        Self { table, rows, unknown_columns, missing_columns, mistyped_columns }
    }
}
