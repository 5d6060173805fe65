//! Edits: what a case changes of the base sequence.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::Result;
use super::document::{Cell, Column, Document, Kind, Table};
use super::view::line_forms;

type Values = Map<String, Value>;

/// One change. Table edits come first, then manifest and summaries, then the stored files.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Edit {
    /// Sets values of one row, of the rows that match, or of all.
    Set {
        table: String,
        row: Option<usize>,
        #[serde(default)]
        r#where: Values,
        values: Values,
    },
    /// Adds to the floats of one row, of the rows that match, or of all.
    Shift {
        table: String,
        row: Option<usize>,
        #[serde(default)]
        r#where: Values,
        by: BTreeMap<String, f64>,
    },
    /// Copies values of a row from columns to others.
    CopyValues { table: String, row: usize, from: Vec<String>, to: Vec<String> },
    /// Moves the ends of a line landmark, metres; its three forms follow.
    MoveLine { row: usize, start_by: [f64; 3], end_by: [f64; 3] },
    /// Inserts a row, a copy of another one where `like` is given; at the end without `at`.
    InsertRow {
        table: String,
        at: Option<usize>,
        like: Option<usize>,
        #[serde(default)]
        values: Values,
    },
    /// Deletes one row, the rows that match, or all.
    DeleteRows {
        table: String,
        row: Option<usize>,
        #[serde(default)]
        r#where: Values,
    },
    /// Exchanges two rows.
    SwapRows { table: String, rows: [usize; 2] },
    /// Takes a column out.
    DropColumn { table: String, columns: Vec<String> },
    /// Adds a column with one value throughout.
    AddColumn { table: String, column: String, kind: String, value: Value },
    /// Stores a column with another type.
    RetypeColumn { table: String, column: String, kind: String },
    /// Stores columns as nullable (`OPTIONAL` in Parquet) or not.
    MarkColumns { table: String, columns: Vec<String>, nullable: bool },
    /// Stores the columns in the opposite order.
    ReverseColumns { table: String },
    /// Names the elements of the lists of a column.
    NameElements { table: String, columns: Vec<String>, name: String },
    /// Takes tables out.
    DropTables { tables: Vec<String> },
    /// Takes all tables out but these.
    KeepTables { tables: Vec<String> },
    /// Makes a known table without rows.
    EmptyTable { table: String },
    /// Makes a table that the specification does not know; `columns` are `[name, type]`.
    AddTable { table: String, columns: Vec<(String, String)>, rows: Vec<Vec<Value>> },
    /// Sets a value of the manifest, by JSON pointer; `-` at its end appends to an array.
    Manifest { at: String, value: Value },
    /// Takes a value out of the manifest.
    ManifestRemove { at: String },
    /// Replaces the manifest's text.
    ManifestText { text: String },
    /// Sets values of a table's summary.
    Summary { table: String, values: Values },
    /// Takes a value out of a table's summary.
    SummaryRemove { table: String, value: String },
    /// Takes a table's summary out.
    DropSummary { table: String },
    /// Lists a table's summary twice.
    RepeatSummary { table: String },
    /// Adds a summary.
    AddSummary { values: Values },
    /// How the MCAP file is written.
    Mcap(super::mcap_file::Options),
    /// Changes one message of a topic, or all.
    Message(super::mcap_file::MessageEdit),
    /// Changes a channel.
    Channel(super::mcap_file::ChannelEdit),
    /// Adds a channel with JSON messages.
    AddChannel(super::mcap_file::NewChannel),
    /// How the Parquet files are written.
    Parquet(super::parquet_files::Options),
    /// Adds a file to the Parquet folder, or replaces one.
    File { name: String, text: String },
    /// Takes a file out of the Parquet folder.
    DropFile { name: String },
    /// Renames a folder of a collection.
    RenameFolder { from: String, to: String },
    /// Takes a folder out of a collection.
    DropFolder { name: String },
    /// Gives a sequence of a collection another name in its manifest, its folder and its row as they were.
    NameSequence { sequence: String, name: String },
    /// Changes the bytes of the MCAP file, or of one file of the folder.
    Bytes(super::bytes::BytesEdit),
}

/// Numbers of the rows that are meant.
fn chosen(table: &Table, row: Option<usize>, pattern: &Values) -> Result<Vec<usize>> {
    let columns: Vec<(usize, Cell)> = pattern
        .iter()
        .map(|(name, value)| {
            let index = table.column(name)?;
            Ok((index, Cell::parse(table.columns[index].kind, value)?))
        })
        .collect::<Result<_>>()?;
    let matching = |number: &usize| {
        row.is_none_or(|row| row == *number)
            && columns.iter().all(|(index, value)| table.rows[*number][*index] == *value)
    };
    let found: Vec<usize> = (0..table.rows.len()).filter(matching).collect();
    if found.is_empty() {
        Err(format!("{}: no row is meant by {row:?} {pattern:?}", table.name))
    } else {
        Ok(found)
    }
}

impl Edit {
    /// The table that is edited, for edits of rows and columns.
    pub(crate) fn table(&self) -> Option<&str> {
        match self {
            Self::Set { table, .. }
            | Self::Shift { table, .. }
            | Self::CopyValues { table, .. }
            | Self::InsertRow { table, .. }
            | Self::DeleteRows { table, .. }
            | Self::SwapRows { table, .. }
            | Self::DropColumn { table, .. }
            | Self::AddColumn { table, .. }
            | Self::RetypeColumn { table, .. }
            | Self::MarkColumns { table, .. }
            | Self::ReverseColumns { table }
            | Self::NameElements { table, .. } => Some(table),
            _ => None,
        }
    }

    /// Applies an edit of tables or manifest; those of summaries and files have their turn later.
    pub(crate) fn apply(&self, document: &mut Document) -> Result<()> {
        match self {
            Self::Set { table, row, r#where, values } => {
                let table = document.table_mut(table)?;
                for number in chosen(table, *row, r#where)? {
                    for (name, value) in values {
                        let index = table.column(name)?;
                        table.rows[number][index] = Cell::parse(table.columns[index].kind, value)?;
                    }
                }
            }
            Self::Shift { table, row, r#where, by } => {
                let table = document.table_mut(table)?;
                for number in chosen(table, *row, r#where)? {
                    for (name, shift) in by {
                        let index = table.column(name)?;
                        let value = table.rows[number][index].float().ok_or("only floats are shifted")?;
                        table.rows[number][index] = Cell::Float(value + shift);
                    }
                }
            }
            Self::CopyValues { table, row, from, to } => {
                let table = document.table_mut(table)?;
                for (from, to) in from.iter().zip(to) {
                    let (from, to) = (table.column(from)?, table.column(to)?);
                    table.rows[*row][to] = table.rows[*row][from].clone();
                }
            }
            Self::MoveLine { row, start_by, end_by } => {
                let table = document.table_mut("line_landmarks")?;
                let row = table.rows.get_mut(*row).ok_or("no such line")?;
                let end = |at: usize, by: &[f64; 3]| {
                    let numbers: Vec<f64> = row[at..at + 3].iter().filter_map(Cell::float).collect();
                    Vector3::from_column_slice(&numbers) + Vector3::from(*by)
                };
                let (start, end) = (end(1, start_by), end(4, end_by));
                let forms = line_forms(start, end);
                let numbers = start.iter().chain(&end).chain(&forms).copied();
                row.splice(1.., numbers.map(Cell::Float));
            }
            Self::InsertRow { table, at, like, values } => {
                let table = document.made(table)?;
                let mut row = match like {
                    Some(like) => table.rows.get(*like).cloned().ok_or("no row to copy")?,
                    None => table.row(&Map::new())?,
                };
                for (name, value) in values {
                    let index = table.column(name)?;
                    row[index] = Cell::parse(table.columns[index].kind, value)?;
                }
                table.rows.insert(at.unwrap_or(table.rows.len()), row);
            }
            Self::DeleteRows { table, row, r#where } => {
                let table = document.table_mut(table)?;
                let gone = chosen(table, *row, r#where)?;
                let mut number = 0;
                table.rows.retain(|_| {
                    number += 1;
                    !gone.contains(&(number - 1))
                });
            }
            Self::SwapRows { table, rows } => document.table_mut(table)?.rows.swap(rows[0], rows[1]),
            Self::DropTables { tables } => {
                for name in tables {
                    document.table_mut(name)?;
                    document.tables.retain(|table| table.name != *name);
                }
            }
            Self::KeepTables { tables } => document.tables.retain(|table| tables.contains(&table.name)),
            Self::EmptyTable { table } => document.made(table)?.rows.clear(),
            Self::AddTable { table, columns, rows } => {
                let columns = columns
                    .iter()
                    .map(|(name, kind)| Ok(Column::new(name, Kind::parse(kind)?, false)))
                    .collect::<Result<Vec<_>>>()?;
                let rows = rows
                    .iter()
                    .map(|row| {
                        row.iter()
                            .zip(&columns)
                            .map(|(value, column)| Cell::parse(column.kind, value))
                            .collect()
                    })
                    .collect::<Result<_>>()?;
                document.tables.push(Table { name: table.clone(), info: None, columns, rows });
            }
            Self::Manifest { at, value } => set(&mut document.manifest, at, Some(value))?,
            Self::ManifestRemove { at } => set(&mut document.manifest, at, None)?,
            Self::ManifestText { text } => document.manifest_text = Some(text.clone()),
            _ => self.apply_to_columns(document)?,
        }
        Ok(())
    }

    fn apply_to_columns(&self, document: &mut Document) -> Result<()> {
        match self {
            Self::DropColumn { table, columns } => {
                let table = document.table_mut(table)?;
                for name in columns {
                    let index = table.column(name)?;
                    table.columns.remove(index);
                    for row in &mut table.rows {
                        row.remove(index);
                    }
                }
            }
            Self::AddColumn { table, column, kind, value } => {
                let kind = Kind::parse(kind)?;
                let cell = Cell::parse(kind, value)?;
                let table = document.table_mut(table)?;
                table.columns.push(Column::new(column, kind, false));
                table.rows.iter_mut().for_each(|row| row.push(cell.clone()));
            }
            Self::RetypeColumn { table, column, kind } => {
                let kind = Kind::parse(kind)?;
                let table = document.table_mut(table)?;
                let index = table.column(column)?;
                table.columns[index].kind = kind;
                for row in &mut table.rows {
                    row[index] = row[index].clone().retyped(kind);
                }
            }
            Self::MarkColumns { table, columns, nullable } => {
                let table = document.table_mut(table)?;
                for name in columns {
                    let index = table.column(name)?;
                    table.columns[index].nullable = *nullable;
                }
            }
            Self::ReverseColumns { table } => {
                let table = document.table_mut(table)?;
                table.columns.reverse();
                table.rows.iter_mut().for_each(|row| row.reverse());
            }
            Self::NameElements { table, columns, name } => {
                let table = document.table_mut(table)?;
                for column in columns {
                    let index = table.column(column)?;
                    table.columns[index].element.clone_from(name);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Applies an edit of the table summaries.
    pub(crate) fn apply_to_summaries(&self, document: &mut Document) -> Result<()> {
        let place = |table: &str| {
            let found = document.summaries.iter().position(|summary| summary["table"] == table);
            found.ok_or_else(|| format!("no summary of {table}"))
        };
        match self {
            Self::Summary { table, values } => {
                let index = place(table)?;
                for (name, value) in values {
                    document.summaries[index][name] = value.clone();
                }
            }
            Self::SummaryRemove { table, value } => {
                let index = place(table)?;
                set(&mut document.summaries[index], &format!("/{value}"), None)?;
            }
            Self::DropSummary { table } => {
                let index = place(table)?;
                document.summaries.remove(index);
            }
            Self::RepeatSummary { table } => {
                let copy = document.summaries[place(table)?].clone();
                document.summaries.push(copy);
            }
            Self::AddSummary { values } => document.summaries.push(Value::Object(values.clone())),
            _ => {}
        }
        Ok(())
    }
}

/// Sets or removes the value that a JSON pointer names.
pub(crate) fn set(document: &mut Value, pointer: &str, value: Option<&Value>) -> Result<()> {
    let (parent, name) = pointer.rsplit_once('/').ok_or_else(|| format!("{pointer} is no JSON pointer"))?;
    let missing = || format!("{pointer}: nothing is there");
    match (document.pointer_mut(parent).ok_or_else(missing)?, value) {
        (Value::Object(map), Some(value)) => {
            map.insert(name.to_owned(), value.clone());
        }
        (Value::Object(map), None) => {
            map.remove(name).ok_or_else(missing)?;
        }
        (Value::Array(list), Some(value)) if name == "-" => list.push(value.clone()),
        (Value::Array(list), value) => {
            let index: usize = name.parse().map_err(|_| missing())?;
            if index >= list.len() {
                return Err(missing());
            }
            match value {
                Some(value) => list[index] = value.clone(),
                None => drop(list.remove(index)),
            }
        }
        _ => return Err(missing()),
    }
    Ok(())
}
