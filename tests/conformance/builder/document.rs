//! A sequence as loose tables of cells: whatever can be stored can be said, right or wrong.

use open_structure::structure::{ColumnType, TABLES, TableInfo, any_table_info};
use serde_json::{Map, Value};

use super::Result;

/// Stored type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Int64,
    Int32,
    Float64,
    Float32,
    Boolean,
    Utf8,
    LargeUtf8,
    Binary,
    Int64List,
    Int32List,
    Float64List,
    Float32List,
    Utf8List,
}

const KINDS: [(&str, Kind); 13] = [
    ("int64", Kind::Int64),
    ("int32", Kind::Int32),
    ("float64", Kind::Float64),
    ("float32", Kind::Float32),
    ("boolean", Kind::Boolean),
    ("utf8", Kind::Utf8),
    ("large_utf8", Kind::LargeUtf8),
    ("binary", Kind::Binary),
    ("list<int64>", Kind::Int64List),
    ("list<int32>", Kind::Int32List),
    ("list<float64>", Kind::Float64List),
    ("list<float32>", Kind::Float32List),
    ("list<utf8>", Kind::Utf8List),
];

impl Kind {
    pub(crate) fn parse(name: &str) -> Result<Self> {
        let found = KINDS.iter().find(|(known, _)| *known == name);
        found.map(|(_, kind)| *kind).ok_or_else(|| format!("no column type is called {name}"))
    }

    fn of(column: ColumnType) -> Self {
        match column {
            ColumnType::Int64 => Self::Int64,
            ColumnType::Float64 => Self::Float64,
            ColumnType::Boolean => Self::Boolean,
            ColumnType::Utf8 => Self::Utf8,
            ColumnType::Binary => Self::Binary,
            ColumnType::Int64List => Self::Int64List,
            ColumnType::Float64List => Self::Float64List,
            ColumnType::Utf8List => Self::Utf8List,
        }
    }
}

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cell {
    Null,
    Int(i64),
    Float(f64),
    Bool(bool),
    Text(String),
    Bytes(Vec<u8>),
    Ints(Vec<Option<i64>>),
    Floats(Vec<Option<f64>>),
    Texts(Vec<Option<String>>),
}

impl From<i64> for Cell {
    fn from(value: i64) -> Self {
        Self::Int(value)
    }
}
impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Float(value)
    }
}
impl From<bool> for Cell {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}
impl From<&str> for Cell {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}
impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Self::Null, Self::Float)
    }
}
impl From<Vec<i64>> for Cell {
    fn from(values: Vec<i64>) -> Self {
        Self::Ints(values.into_iter().map(Some).collect())
    }
}
impl From<Vec<f64>> for Cell {
    fn from(values: Vec<f64>) -> Self {
        Self::Floats(values.into_iter().map(Some).collect())
    }
}

impl Cell {
    /// A value from its text; floats that JSON lacks are written `"NaN"`, `"inf"` and `"-inf"`.
    pub(crate) fn parse(kind: Kind, value: &Value) -> Result<Self> {
        let wrong = || format!("{value} does not fit {kind:?}");
        let float = |value: &Value| match value {
            Value::String(text) => text.parse().map_err(|_| wrong()),
            other => other.as_f64().ok_or_else(wrong),
        };
        let list = || value.as_array().ok_or_else(wrong);
        Ok(match kind {
            _ if value.is_null() => Self::Null,
            Kind::Int64 | Kind::Int32 => Self::Int(value.as_i64().ok_or_else(wrong)?),
            Kind::Float64 | Kind::Float32 => Self::Float(float(value)?),
            Kind::Boolean => Self::Bool(value.as_bool().ok_or_else(wrong)?),
            Kind::Utf8 | Kind::LargeUtf8 => Self::Text(value.as_str().ok_or_else(wrong)?.to_owned()),
            Kind::Binary => Self::Bytes(hexadecimal(value.as_str().ok_or_else(wrong)?)?),
            Kind::Int64List | Kind::Int32List => {
                Self::Ints(
                    list()?
                        .iter()
                        .map(|entry| {
                            if entry.is_null() {
                                Ok(None)
                            } else {
                                entry.as_i64().map(Some).ok_or_else(wrong)
                            }
                        })
                        .collect::<Result<_>>()?,
                )
            }
            Kind::Utf8List => Self::Texts(
                list()?
                    .iter()
                    .map(|entry| match entry {
                        Value::Null => Ok(None),
                        Value::String(text) => Ok(Some(text.clone())),
                        _ => Err(wrong()),
                    })
                    .collect::<Result<_>>()?,
            ),
            Kind::Float64List | Kind::Float32List => Self::Floats(
                list()?
                    .iter()
                    .map(|entry| if entry.is_null() { Ok(None) } else { float(entry).map(Some) })
                    .collect::<Result<_>>()?,
            ),
        })
    }

    /// The same value for a column of another type.
    pub(crate) fn retyped(self, kind: Kind) -> Self {
        match (self, kind) {
            (Self::Int(value), Kind::Float64 | Kind::Float32) => Self::Float(value as f64),
            (Self::Int(value), Kind::Utf8 | Kind::LargeUtf8) => Self::Text(value.to_string()),
            (Self::Int(value), Kind::Boolean) => Self::Bool(value != 0),
            (Self::Bool(value), Kind::Int64 | Kind::Int32) => Self::Int(i64::from(value)),
            (Self::Float(value), Kind::Utf8 | Kind::LargeUtf8) => Self::Text(value.to_string()),
            #[expect(clippy::cast_possible_truncation, reason = "a defect on purpose")]
            (Self::Float(value), Kind::Int64 | Kind::Int32) => Self::Int(value as i64),
            (Self::Text(text), Kind::Binary) => Self::Bytes(text.into_bytes()),
            (Self::Text(_), Kind::Int64 | Kind::Int32) => Self::Int(0),
            (Self::Ints(values), Kind::Float64List | Kind::Float32List) => {
                Self::Floats(values.into_iter().map(|value| value.map(|value| value as f64)).collect())
            }
            (Self::Ints(values), Kind::Utf8) => Self::Text(format!("{values:?}")),
            (Self::Texts(values), Kind::Utf8) => Self::Text(format!("{values:?}")),
            (Self::Floats(values), Kind::Float64) => Self::Float(values.into_iter().flatten().sum()),
            (same, _) => same,
        }
    }

    pub(crate) fn int(&self) -> Option<i64> {
        if let Self::Int(value) = self { Some(*value) } else { None }
    }

    pub(crate) fn float(&self) -> Option<f64> {
        if let Self::Float(value) = self { Some(*value) } else { None }
    }

    pub(crate) fn text(&self) -> Option<&str> {
        if let Self::Text(value) = self { Some(value) } else { None }
    }

    pub(crate) fn is_null(&self) -> bool {
        matches!(self, Self::Null)
    }

    pub(crate) fn has_null_element(&self) -> bool {
        match self {
            Self::Ints(values) => values.contains(&None),
            Self::Floats(values) => values.contains(&None),
            Self::Texts(values) => values.contains(&None),
            _ => false,
        }
    }
}

/// Bytes of hexadecimal digits.
pub(crate) fn hexadecimal(text: &str) -> Result<Vec<u8>> {
    (0..text.len())
        .step_by(2)
        .map(|at| text.get(at..at + 2).and_then(|pair| u8::from_str_radix(pair, 16).ok()))
        .collect::<Option<_>>()
        .ok_or_else(|| format!("{text} is not hexadecimal"))
}

/// One column as it is stored.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) nullable: bool,
    /// Name of the elements of a list.
    pub(crate) element: String,
    /// Unit, space and description.
    pub(crate) notes: Vec<(&'static str, String)>,
}

impl Column {
    pub(crate) fn new(name: &str, kind: Kind, nullable: bool) -> Self {
        Self { name: name.to_owned(), kind, nullable, element: "element".to_owned(), notes: Vec::new() }
    }
}

/// One table: columns, and rows of cells.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) name: String,
    /// What the specification says about it; `None` for a table that it does not know.
    pub(crate) info: Option<&'static TableInfo>,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table of the specification, without rows.
    pub(crate) fn known(name: &str) -> Result<Self> {
        let info = any_table_info(name).ok_or_else(|| format!("no table is called {name}"))?;
        let columns = info.fields.iter().map(|field| Column {
            notes: vec![
                ("description", field.description()),
                ("unit", field.unit.to_owned()),
                ("space", field.space.to_owned()),
            ],
            ..Column::new(field.name, Kind::of(field.kind), field.nullable)
        });
        Ok(Self { name: name.to_owned(), info: Some(info), columns: columns.collect(), rows: Vec::new() })
    }

    pub(crate) fn column(&self, name: &str) -> Result<usize> {
        let found = self.columns.iter().position(|column| column.name == name);
        found.ok_or_else(|| format!("{} has no column {name}", self.name))
    }

    /// A cell, for computing what follows from it; `None` where the column is not there.
    pub(crate) fn cell(&self, row: usize, name: &str) -> Option<&Cell> {
        self.rows[row].get(self.column(name).ok()?)
    }

    /// An integer, 0 where none can be had.
    pub(crate) fn int(&self, row: usize, name: &str) -> i64 {
        self.cell(row, name).and_then(Cell::int).unwrap_or(0)
    }

    /// A float, 0 where none can be had.
    pub(crate) fn float(&self, row: usize, name: &str) -> f64 {
        self.cell(row, name).and_then(Cell::float).unwrap_or(0.0)
    }

    /// A row with the named values; the others are null.
    pub(crate) fn row(&self, values: &Map<String, Value>) -> Result<Vec<Cell>> {
        let mut row = vec![Cell::Null; self.columns.len()];
        for (name, value) in values {
            let index = self.column(name)?;
            row[index] = Cell::parse(self.columns[index].kind, value)
                .map_err(|error| format!("{}.{name}: {error}", self.name))?;
        }
        Ok(row)
    }
}

/// A whole sequence, right or wrong.
#[derive(Clone, Debug)]
pub(crate) struct Document {
    pub(crate) manifest: Value,
    /// Replaces the manifest's text.
    pub(crate) manifest_text: Option<String>,
    pub(crate) tables: Vec<Table>,
    /// Row counts and digests, as JSON.
    pub(crate) summaries: Vec<Value>,
}

impl Document {
    pub(crate) fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.name == name)
    }

    pub(crate) fn table_mut(&mut self, name: &str) -> Result<&mut Table> {
        let found = self.tables.iter_mut().find(|table| table.name == name);
        found.ok_or_else(|| format!("the document has no table {name}"))
    }

    /// The table of a name, made where it is not there yet.
    pub(crate) fn made(&mut self, name: &str) -> Result<&mut Table> {
        if self.table(name).is_none() {
            self.tables.push(Table::known(name)?);
            self.sort();
        }
        self.table_mut(name)
    }

    /// Tables in the order of the specification, unknown ones last.
    pub(crate) fn sort(&mut self) {
        let place = |name: &str| TABLES.iter().position(|table| table.name == name).unwrap_or(usize::MAX);
        self.tables.sort_by_key(|table| place(&table.name));
    }

    /// Stamps of the frames, by row.
    pub(crate) fn stamps(&self) -> Vec<(i64, u64)> {
        let Some(frames) = self.table("frames") else { return Vec::new() };
        (0..frames.rows.len())
            .map(|row| {
                let stamp = u64::try_from(frames.int(row, "stamp_nanos")).unwrap_or(0);
                (frames.int(row, "frame_id"), stamp)
            })
            .collect()
    }
}
