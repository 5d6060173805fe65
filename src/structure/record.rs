//! A row of a table, and the macro that makes one struct the source of everything said about it.

use std::cmp::Ordering;

use schemars::JsonSchema;
use serde::{Serialize, de::DeserializeOwned};

use super::column::{ColumnSink, ColumnSource, ColumnValue};
use super::field::TableInfo;
use super::sequence::Sequence;

/// A row of one table of the format: of a sequence, or of a collection of them.
///
/// Implemented by the macro `record!` alone.
pub trait Record:
    Clone + PartialEq + Send + Sync + Serialize + DeserializeOwned + JsonSchema + 'static
{
    /// What the specification says about the table.
    const TABLE: &'static TableInfo;

    /// Hands the columns of some rows to a sink, in field order.
    fn put<S: ColumnSink>(rows: &[Self], sink: &mut S);

    /// Makes rows from columns and appends them to others.
    ///
    /// # Errors
    /// Those of the source; nothing is appended then.
    fn take<S: ColumnSource>(source: &S, rows: &mut Vec<Self>) -> Result<(), S::Error>;

    /// Compares the keys of two rows: the order in which a table is stored.
    fn compare_key(&self, other: &Self) -> Ordering;

    /// The key in words, such as `frame_id 3, point_id 7`.
    fn key_text(&self) -> String;

    /// Appends the canonical bytes of the row, see the specification's section on digests.
    fn digest(&self, bytes: &mut Vec<u8>);

    /// The frame of a row of a per-frame table.
    fn frame(&self) -> Option<super::FrameId>;

    /// The rows of this table in a sequence; none where it is not a table of sequences.
    #[must_use]
    fn rows(sequence: &Sequence) -> &[Self] {
        let _ = sequence;
        &[]
    }
}

/// Whether a value is left out of a JSON row.
pub(crate) fn is_absent<T: ColumnValue>(value: &T) -> bool {
    value.is_absent()
}

/// First version of the specification with a column.
pub(crate) const fn since(added: &[&'static str]) -> &'static str {
    match added {
        [] => "1.0.0",
        [version, ..] => version,
    }
}

/// Appends the canonical bytes of a value.
///
/// A column that a minor version added leaves no trace where it is absent, so that the digest of a file from
/// before stays what it was; where it is present its name comes first.
#[inline]
pub(crate) fn digest<T: ColumnValue>(value: &T, name: &str, added: &[&str], bytes: &mut Vec<u8>) {
    if !added.is_empty() {
        if value.is_absent() {
            return;
        }
        bytes.extend_from_slice(&(name.len() as u64).to_le_bytes());
        bytes.extend_from_slice(name.as_bytes());
    }
    value.digest(bytes);
}

/// Defines a row struct together with its [`TableInfo`] and its [`Record`] implementation.
///
/// `[unit, space]` stands before each column, `[unit, space, since]` before one that a minor version added; `frame:` names the column that says the frame of a
/// per-frame row; `of: collection` says that the table belongs to a collection, not to a sequence.
macro_rules! record {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident in $table:ident ($storage:ident, $need:ident, key: [$($key:ident),+] $(, frame: $frame:ident)? $(, of: $owner:ident)?) {
            $(
                $(#[doc = $field_doc:literal])*
                [$unit:literal, $space:literal $(, $since:literal)?]
                $field:ident: $type:ty,
            )+
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[schemars(extend("x-table" = stringify!($table)))]
        pub struct $name {
            $(
                $(#[doc = $field_doc])*
                #[schemars(extend("x-unit" = $unit, "x-space" = $space $(, "x-since" = $since)?))]
                #[serde(skip_serializing_if = "crate::structure::record::is_absent")]
                pub $field: $type,
            )+
        }

        impl crate::structure::Record for $name {
            const TABLE: &'static crate::structure::TableInfo = &crate::structure::TableInfo {
                name: stringify!($table),
                record: stringify!($name),
                storage: crate::structure::Storage::$storage,
                need: crate::structure::Need::$need,
                key: &[$(stringify!($key)),+],
                fields: &[$(crate::structure::Field {
                    name: stringify!($field),
                    kind: <$type as crate::structure::ColumnValue>::TYPE,
                    nullable: <$type as crate::structure::ColumnValue>::NULLABLE,
                    unit: $unit,
                    space: $space,
                    since: crate::structure::record::since(&[$($since)?]),
                    doc: &[$($field_doc),*],
                }),+],
                doc: &[$($doc),*],
            };

            fn put<S: crate::structure::ColumnSink>(rows: &[Self], sink: &mut S) {
                $(<$type as crate::structure::ColumnValue>::put(sink, rows.iter().map(|row| &row.$field));)+
            }

            fn take<S: crate::structure::ColumnSource>(source: &S, rows: &mut Vec<Self>) -> Result<(), S::Error> {
                let mut field = 0;
                $(
                    let $field = <$type as crate::structure::ColumnValue>::view(source, field)?;
                    field += 1;
                )+
                let _ = field;
                rows.extend((0..source.len())
                    .map(|row| Self { $($field: <$type as crate::structure::ColumnValue>::get($field, row)),+ }));
                Ok(())
            }

            fn compare_key(&self, other: &Self) -> std::cmp::Ordering {
                std::cmp::Ordering::Equal$(.then_with(|| self.$key.cmp(&other.$key)))+
            }

            fn key_text(&self) -> String {
                let parts = [$(format!(
                    concat!(stringify!($key), " {}"),
                    crate::structure::record::KeyPart::text(&self.$key)
                )),+];
                parts.join(", ")
            }

            fn digest(&self, bytes: &mut Vec<u8>) {
                $(crate::structure::record::digest(&self.$field, stringify!($field), &[$($since)?], bytes);)+
            }

            fn frame(&self) -> Option<crate::structure::FrameId> {
                #[allow(unused_mut, unused_assignments, reason = "only per-frame rows name a frame")]
                let mut frame = None;
                $(frame = Some(self.$frame);)?
                frame
            }

            crate::structure::record::rows_of!($table $($owner)?);
        }
    };
}
pub(crate) use record;

/// Where the rows of a table are in a sequence, if it is a table of sequences.
macro_rules! rows_of {
    ($table:ident) => {
        fn rows(sequence: &crate::structure::Sequence) -> &[Self] {
            &sequence.$table
        }
    };
    ($table:ident collection) => {};
}
pub(crate) use rows_of;

/// A key column's value as it is written in messages.
pub(crate) trait KeyPart {
    /// The value alone, without the word of its kind.
    fn text(&self) -> String;
}

macro_rules! key_part {
    ($($type:ty),+) => { $(impl KeyPart for $type { fn text(&self) -> String { self.0.to_string() } })+ };
}
key_part!(super::FrameId, super::PointId, super::LineId, super::GroupId, super::CameraId);

impl KeyPart for i64 {
    fn text(&self) -> String {
        self.to_string()
    }
}

impl KeyPart for String {
    fn text(&self) -> String {
        format!("`{self}`")
    }
}
