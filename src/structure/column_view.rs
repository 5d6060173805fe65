//! Columns as their source lends them: slices, with bits for what is absent.

/// Bits of a column, least significant bit first.
#[derive(Clone, Copy, Debug)]
pub struct Bitmap<'a> {
    /// Bytes that hold the bits.
    pub bytes: &'a [u8],
    /// Bits to pass over at the beginning.
    pub offset: usize,
}

impl Bitmap<'_> {
    /// The bit of a row.
    #[must_use]
    #[inline]
    pub fn get(&self, row: usize) -> bool {
        let bit = self.offset + row;
        self.bytes[bit >> 3] >> (bit & 7) & 1 == 1
    }
}

/// A column of numbers in which some may be absent.
#[derive(Clone, Copy, Debug)]
pub struct Nullable<'a, T> {
    /// Values; those of absent rows are arbitrary.
    pub values: &'a [T],
    /// Which rows are present; `None` when all are.
    pub validity: Option<Bitmap<'a>>,
}

impl<T: Copy> Nullable<'_, T> {
    /// The value of a row.
    #[must_use]
    #[inline]
    pub fn get(&self, row: usize) -> Option<T> {
        match &self.validity {
            Some(bits) if !bits.get(row) => None,
            _ => Some(self.values[row]),
        }
    }
}

/// A column of variable-length values: text, bytes or lists.
#[derive(Clone, Copy, Debug)]
pub struct Lists<'a, T> {
    /// Row `i` is `values[offsets[i]..offsets[i + 1]]`.
    pub offsets: &'a [i32],
    /// Elements of all rows.
    pub values: &'a [T],
    /// Which rows are present; `None` when all are.
    pub validity: Option<Bitmap<'a>>,
}

impl<'a, T> Lists<'a, T> {
    /// The elements of a row; absent rows have none.
    #[must_use]
    pub fn get(&self, row: usize) -> &'a [T] {
        let bound = |index: usize| usize::try_from(self.offsets[index]).unwrap_or(0);
        self.values.get(bound(row)..bound(row + 1)).unwrap_or(&[])
    }

    /// Whether the row is present.
    #[must_use]
    pub fn is_present(&self, row: usize) -> bool {
        self.validity.is_none_or(|bits| bits.get(row))
    }
}

/// A column of lists of text.
#[derive(Clone, Copy, Debug)]
pub struct TextLists<'a> {
    /// Row `i` has the texts from `offsets[i]` up to `offsets[i + 1]`.
    pub offsets: &'a [i32],
    /// Texts of all rows, one after the other; the bytes are valid UTF-8.
    pub texts: Lists<'a, u8>,
}

impl TextLists<'_> {
    /// The texts of a row.
    #[must_use]
    pub fn get(&self, row: usize) -> Vec<String> {
        let bound = |index: usize| usize::try_from(self.offsets[index]).unwrap_or(0);
        (bound(row)..bound(row + 1)).map(|text| text_of(self.texts.get(text))).collect()
    }
}

/// Bytes that are UTF-8 as text.
pub(super) fn text_of(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
