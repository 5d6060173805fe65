//! Columns as plain slices: the seam between row structs and whatever stores them.

use super::column_view::{Bitmap, Lists, Nullable, TextLists, text_of};
use super::field::ColumnType;
use super::id::{CameraId, FrameId, GroupId, LineId, PointId};
use super::landmark::Descriptor;

/// Takes the columns of a run of rows, in the order of the record's fields.
pub trait ColumnSink {
    /// A column of integers.
    fn int64(&mut self, values: impl ExactSizeIterator<Item = i64>);
    /// A column of integers, some absent.
    fn optional_int64(&mut self, values: impl ExactSizeIterator<Item = Option<i64>>);
    /// A column of floats.
    fn float64(&mut self, values: impl ExactSizeIterator<Item = f64>);
    /// A column of floats, some absent.
    fn optional_float64(&mut self, values: impl ExactSizeIterator<Item = Option<f64>>);
    /// A column of truth values.
    fn boolean(&mut self, values: impl ExactSizeIterator<Item = bool>);
    /// A column of text.
    fn utf8<'v>(&mut self, values: impl ExactSizeIterator<Item = &'v str>);
    /// A column of text, some absent.
    fn optional_utf8<'v>(&mut self, values: impl ExactSizeIterator<Item = Option<&'v str>>);
    /// A column of bytes, some absent.
    fn optional_binary<'v>(&mut self, values: impl ExactSizeIterator<Item = Option<&'v [u8]>>);
    /// A column of lists of integers.
    fn int64_list<I: Iterator<Item = i64>>(&mut self, values: impl ExactSizeIterator<Item = I>);
    /// A column of lists of text.
    fn utf8_list<'v>(&mut self, values: impl ExactSizeIterator<Item = &'v [String]>);
    /// A column of lists of floats.
    fn float64_list<'v>(&mut self, values: impl ExactSizeIterator<Item = &'v [f64]>);
    /// A column of lists of floats, some absent.
    fn optional_float64_list<'v>(&mut self, values: impl ExactSizeIterator<Item = Option<&'v [f64]>>);
}

/// Gives the columns of a run of rows, by the index of the field.
pub trait ColumnSource {
    /// What can go wrong: a missing column, another type, a null where none may be.
    type Error;
    /// Number of rows.
    fn len(&self) -> usize;
    /// Whether there is no row.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// A column of integers.
    fn int64(&self, field: usize) -> Result<&[i64], Self::Error>;
    /// A column of integers, some absent.
    fn optional_int64(&self, field: usize) -> Result<Nullable<'_, i64>, Self::Error>;
    /// A column of floats.
    fn float64(&self, field: usize) -> Result<&[f64], Self::Error>;
    /// A column of floats, some absent.
    fn optional_float64(&self, field: usize) -> Result<Nullable<'_, f64>, Self::Error>;
    /// A column of truth values.
    fn boolean(&self, field: usize) -> Result<Bitmap<'_>, Self::Error>;
    /// A column of text; the bytes are valid UTF-8.
    fn utf8(&self, field: usize) -> Result<Lists<'_, u8>, Self::Error>;
    /// A column of text, some absent; the bytes are valid UTF-8.
    fn optional_utf8(&self, field: usize) -> Result<Lists<'_, u8>, Self::Error>;
    /// A column of bytes, some absent.
    fn optional_binary(&self, field: usize) -> Result<Lists<'_, u8>, Self::Error>;
    /// A column of lists of integers.
    fn int64_list(&self, field: usize) -> Result<Lists<'_, i64>, Self::Error>;
    /// A column of lists of text.
    fn utf8_list(&self, field: usize) -> Result<TextLists<'_>, Self::Error>;
    /// A column of lists of floats, none absent.
    fn float64_list(&self, field: usize) -> Result<Lists<'_, f64>, Self::Error>;
    /// A column of lists of floats, some absent.
    fn optional_float64_list(&self, field: usize) -> Result<Lists<'_, f64>, Self::Error>;
}

/// A Rust type that can stand in a column.
pub trait ColumnValue: Sized {
    /// Logical type of the column.
    const TYPE: ColumnType;
    /// Whether a value may be absent.
    const NULLABLE: bool;
    /// The column as its source gives it.
    type View<'a>: Copy;

    /// Hands the values of a column to a sink.
    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>)
    where
        Self: 'v;
    /// Takes a column from its source.
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error>;
    /// The value of a row.
    fn get(view: Self::View<'_>, row: usize) -> Self;
    /// Appends the canonical bytes of the value, see the specification's section on digests.
    fn digest(&self, bytes: &mut Vec<u8>);
    /// Whether there is no value.
    fn is_absent(&self) -> bool {
        false
    }
}

macro_rules! number {
    ($type:ty, $primitive:ty, $kind:ident, $put:ident, $put_optional:ident, $wrap:expr, $unwrap:expr) => {
        impl ColumnValue for $type {
            const TYPE: ColumnType = ColumnType::$kind;
            const NULLABLE: bool = false;
            type View<'a> = &'a [$primitive];

            fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
                sink.$put(values.map($unwrap));
            }
            fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
                source.$put(field)
            }
            #[inline]
            fn get(view: Self::View<'_>, row: usize) -> Self {
                $wrap(view[row])
            }
            #[inline]
            fn digest(&self, bytes: &mut Vec<u8>) {
                let unwrap: fn(&Self) -> $primitive = $unwrap;
                bytes.extend_from_slice(&unwrap(self).to_le_bytes());
            }
        }

        impl ColumnValue for Option<$type> {
            const TYPE: ColumnType = ColumnType::$kind;
            const NULLABLE: bool = true;
            type View<'a> = Nullable<'a, $primitive>;

            fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
                sink.$put_optional(values.map(|value| value.as_ref().map($unwrap)));
            }
            fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
                source.$put_optional(field)
            }
            #[inline]
            fn get(view: Self::View<'_>, row: usize) -> Self {
                view.get(row).map($wrap)
            }
            #[inline]
            fn digest(&self, bytes: &mut Vec<u8>) {
                match self {
                    Some(value) => {
                        bytes.push(1);
                        value.digest(bytes);
                    }
                    None => bytes.push(0),
                }
            }
            fn is_absent(&self) -> bool {
                self.is_none()
            }
        }
    };
}

number!(i64, i64, Int64, int64, optional_int64, std::convert::identity, |value| *value);
number!(f64, f64, Float64, float64, optional_float64, std::convert::identity, |value| *value);
number!(FrameId, i64, Int64, int64, optional_int64, FrameId, |id| id.0);
number!(PointId, i64, Int64, int64, optional_int64, PointId, |id| id.0);
number!(LineId, i64, Int64, int64, optional_int64, LineId, |id| id.0);
number!(GroupId, i64, Int64, int64, optional_int64, GroupId, |id| id.0);
number!(CameraId, i64, Int64, int64, optional_int64, CameraId, |id| id.0);

impl ColumnValue for bool {
    const TYPE: ColumnType = ColumnType::Boolean;
    const NULLABLE: bool = false;
    type View<'a> = Bitmap<'a>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.boolean(values.copied());
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.boolean(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        view.get(row)
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(*self));
    }
}

fn digest_length(length: usize, bytes: &mut Vec<u8>) {
    bytes.extend_from_slice(&(length as u64).to_le_bytes());
}

impl ColumnValue for String {
    const TYPE: ColumnType = ColumnType::Utf8;
    const NULLABLE: bool = false;
    type View<'a> = Lists<'a, u8>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.utf8(values.map(String::as_str));
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.utf8(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        text_of(view.get(row))
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        digest_length(self.len(), bytes);
        bytes.extend_from_slice(self.as_bytes());
    }
}

impl ColumnValue for Option<String> {
    const TYPE: ColumnType = ColumnType::Utf8;
    const NULLABLE: bool = true;
    type View<'a> = Lists<'a, u8>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.optional_utf8(values.map(Option::as_deref));
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.optional_utf8(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        view.is_present(row).then(|| text_of(view.get(row)))
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(self.is_some()));
        if let Some(text) = self {
            text.digest(bytes);
        }
    }
    fn is_absent(&self) -> bool {
        self.is_none()
    }
}

impl ColumnValue for Vec<String> {
    const TYPE: ColumnType = ColumnType::Utf8List;
    const NULLABLE: bool = false;
    type View<'a> = TextLists<'a>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.utf8_list(values.map(Vec::as_slice));
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.utf8_list(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        view.get(row)
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        digest_length(self.len(), bytes);
        self.iter().for_each(|text| text.digest(bytes));
    }
}

impl ColumnValue for Option<Descriptor> {
    const TYPE: ColumnType = ColumnType::Binary;
    const NULLABLE: bool = true;
    type View<'a> = Lists<'a, u8>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.optional_binary(values.map(|value| value.as_ref().map(|descriptor| descriptor.0.as_slice())));
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.optional_binary(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        view.is_present(row).then(|| Descriptor(view.get(row).to_vec()))
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(self.is_some()));
        if let Some(descriptor) = self {
            digest_length(descriptor.0.len(), bytes);
            bytes.extend_from_slice(&descriptor.0);
        }
    }
    fn is_absent(&self) -> bool {
        self.is_none()
    }
}

macro_rules! integer_list {
    ($type:ty, $wrap:expr, $unwrap:expr) => {
        impl ColumnValue for Vec<$type> {
            const TYPE: ColumnType = ColumnType::Int64List;
            const NULLABLE: bool = false;
            type View<'a> = Lists<'a, i64>;

            fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
                sink.int64_list(values.map(|list| list.iter().map($unwrap)));
            }
            fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
                source.int64_list(field)
            }
            fn get(view: Self::View<'_>, row: usize) -> Self {
                view.get(row).iter().copied().map($wrap).collect()
            }
            fn digest(&self, bytes: &mut Vec<u8>) {
                digest_length(self.len(), bytes);
                self.iter().for_each(|value| value.digest(bytes));
            }
        }
    };
}

integer_list!(i64, std::convert::identity, |value| *value);
integer_list!(FrameId, FrameId, |id| id.0);
integer_list!(LineId, LineId, |id| id.0);

impl ColumnValue for Vec<f64> {
    const TYPE: ColumnType = ColumnType::Float64List;
    const NULLABLE: bool = false;
    type View<'a> = Lists<'a, f64>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.float64_list(values.map(Vec::as_slice));
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.float64_list(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        view.get(row).to_vec()
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        digest_length(self.len(), bytes);
        self.iter().for_each(|value| value.digest(bytes));
    }
}

impl ColumnValue for Option<Vec<f64>> {
    const TYPE: ColumnType = ColumnType::Float64List;
    const NULLABLE: bool = true;
    type View<'a> = Lists<'a, f64>;

    fn put<'v, S: ColumnSink>(sink: &mut S, values: impl ExactSizeIterator<Item = &'v Self>) {
        sink.optional_float64_list(values.map(Option::as_deref));
    }
    fn view<S: ColumnSource>(source: &S, field: usize) -> Result<Self::View<'_>, S::Error> {
        source.optional_float64_list(field)
    }
    fn get(view: Self::View<'_>, row: usize) -> Self {
        view.is_present(row).then(|| view.get(row).to_vec())
    }
    fn digest(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(self.is_some()));
        if let Some(list) = self {
            list.digest(bytes);
        }
    }
    fn is_absent(&self) -> bool {
        self.is_none()
    }
}
