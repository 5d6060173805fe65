//! What is said about a column and about a table: the texts of schemas and specification.

/// Logical type of a column; the encodings map it to Arrow and Parquet types.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColumnType {
    /// Signed 64-bit integer.
    Int64,
    /// IEEE 754 binary64.
    Float64,
    /// `true` or `false`.
    Boolean,
    /// UTF-8 text.
    Utf8,
    /// Bytes.
    Binary,
    /// List of signed 64-bit integers, never null inside.
    Int64List,
    /// List of IEEE 754 binary64, never null inside.
    Float64List,
    /// List of UTF-8 text, never null inside.
    Utf8List,
}

impl ColumnType {
    /// Name as the specification writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Int64 => "int64",
            Self::Float64 => "float64",
            Self::Boolean => "boolean",
            Self::Utf8 => "utf8",
            Self::Binary => "binary",
            Self::Int64List => "list<int64>",
            Self::Float64List => "list<float64>",
            Self::Utf8List => "list<utf8>",
        }
    }
}

/// One column of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Column name.
    pub name: &'static str,
    /// Logical type.
    pub kind: ColumnType,
    /// Whether a value may be absent.
    pub nullable: bool,
    /// Unit: `m`, `px`, `rad`, `ns`, or `1` for a number without one.
    pub unit: &'static str,
    /// Space in which the value is expressed: `world`, `camera`, `image`, a transform
    /// such as `world_from_camera`, or `-` where none applies.
    pub space: &'static str,
    /// First version of the specification with the column; only nullable ones come after 1.0.0.
    pub since: &'static str,
    /// Lines of the doc comment.
    pub doc: &'static [&'static str],
}

impl Field {
    /// Meaning of the column, as one paragraph.
    #[must_use]
    pub fn description(&self) -> String {
        paragraph(self.doc)
    }
}

/// How a table is laid out in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// Rows belong to one frame each; an MCAP file has one message per frame, at its stamp.
    PerFrame,
    /// Rows belong to the sequence; an MCAP file has them at the first stamp.
    Whole,
}

/// Whether a sequence has to have the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Every sequence has it, if only with zero rows.
    Required,
    /// It may be missing.
    Optional,
}

/// One table of the format.
#[derive(Clone, Copy, Debug)]
pub struct TableInfo {
    /// Table name: file name in a Parquet folder, topic in an MCAP file.
    pub name: &'static str,
    /// Name of the row, as Rust and the JSON Schema call it.
    pub record: &'static str,
    /// Layout in time.
    pub storage: Storage,
    /// Whether it may be missing.
    pub need: Need,
    /// Columns that name a row; rows are sorted by them, strictly ascending.
    pub key: &'static [&'static str],
    /// Columns, in order.
    pub fields: &'static [Field],
    /// Lines of the doc comment of the row.
    pub doc: &'static [&'static str],
}

impl TableInfo {
    /// Meaning of a row, as one paragraph.
    #[must_use]
    pub fn description(&self) -> String {
        paragraph(self.doc)
    }

    /// MCAP topic of the table.
    #[must_use]
    pub fn topic(&self) -> String {
        format!("/{}", self.name)
    }
}

fn paragraph(lines: &[&str]) -> String {
    lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ").trim().to_owned()
}
