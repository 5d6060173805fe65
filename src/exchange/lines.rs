//! Lines and fields of a text file that may be anything.

use std::io::{BufRead, Read};
use std::str::SplitAsciiWhitespace;

use super::Error;

/// The largest file that is read, bytes.
pub const LARGEST_FILE_BYTES: u64 = 4 << 30;
/// The most elements (vertices, edges, observations) that are read from a file.
pub const MOST_ELEMENTS: usize = 50_000_000;
/// The longest line, bytes: COLMAP writes all points of an image on one.
const LONGEST_LINE_BYTES: u64 = 64 << 20;

/// The lines of a file, one at a time, in one buffer.
pub(super) struct Lines<R> {
    file: &'static str,
    input: R,
    buffer: Vec<u8>,
    number: usize,
    bytes: u64,
}

impl<R: BufRead> Lines<R> {
    /// Lines of an input; `file` is its name for errors, where a format has several.
    pub(super) fn new(file: &'static str, input: R) -> Self {
        Self { file, input, buffer: Vec::new(), number: 0, bytes: 0 }
    }

    /// The number of the last line that was read, counted from 1.
    pub(super) fn number(&self) -> usize {
        self.number
    }

    /// The next line, empty or not; `None` at the end.
    ///
    /// # Errors
    /// A line or a file that is too long, and bytes that are not UTF-8.
    pub(super) fn any(&mut self) -> Result<Option<&str>, Error> {
        self.buffer.clear();
        let length = self.input.by_ref().take(LONGEST_LINE_BYTES).read_until(b'\n', &mut self.buffer)? as u64;
        if length == 0 {
            return Ok(None);
        }
        self.number += 1;
        self.bytes += length;
        if length == LONGEST_LINE_BYTES && self.buffer.last() != Some(&b'\n') {
            let expected = format!("a line of less than {LONGEST_LINE_BYTES} bytes");
            return Err(Error::content(self.file, self.number, expected, "a longer one"));
        }
        if self.bytes > LARGEST_FILE_BYTES {
            let expected = format!("a file of at most {LARGEST_FILE_BYTES} bytes");
            return Err(Error::content(self.file, self.number, expected, "more"));
        }
        if self.number == 1 && self.buffer.starts_with(b"\xef\xbb\xbf") {
            self.buffer.drain(..3);
        }
        match str::from_utf8(&self.buffer) {
            Ok(text) => Ok(Some(text.trim_ascii())),
            Err(_) => Err(Error::content(self.file, self.number, "text", "bytes that are not UTF-8")),
        }
    }

    /// Goes to the next line that is neither empty nor a comment and gives its fields.
    ///
    /// # Errors
    /// Those of [`any`](Self::any).
    pub(super) fn fields(&mut self) -> Result<Option<Fields<'_>>, Error> {
        loop {
            match self.any()? {
                None => return Ok(None),
                Some(text) if text.is_empty() || text.starts_with('#') => {}
                Some(_) => break,
            }
        }
        Ok(Some(self.fields_here()))
    }

    /// The fields of the line that was read last.
    pub(super) fn fields_here(&self) -> Fields<'_> {
        let text = str::from_utf8(&self.buffer).unwrap_or_default();
        Fields { file: self.file, line: self.number, words: text.split_ascii_whitespace() }
    }
}

/// The fields of a line, apart by blanks.
pub(super) struct Fields<'a> {
    file: &'static str,
    line: usize,
    words: SplitAsciiWhitespace<'a>,
}

impl<'a> Fields<'a> {
    /// The next word, if there is one.
    pub(super) fn word_or_end(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    /// The next word.
    ///
    /// # Errors
    /// [`Error::Content`] at the end of the line.
    pub(super) fn word(&mut self, what: &str) -> Result<&'a str, Error> {
        self.words.next().ok_or_else(|| self.wrong(what, "the end of the line"))
    }

    /// The next number, which has to be finite.
    ///
    /// # Errors
    /// [`Error::Content`] for anything else.
    pub(super) fn number(&mut self, what: &str) -> Result<f64, Error> {
        let word = self.word(what)?;
        finite(word).ok_or_else(|| self.wrong(&format!("{what}, a finite number"), word))
    }

    /// The next numbers.
    ///
    /// # Errors
    /// [`Error::Content`] for one that is none, or too few.
    pub(super) fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number(what)?;
        }
        Ok(numbers)
    }

    /// The next id: an integer of at least 0.
    ///
    /// # Errors
    /// [`Error::Content`] for anything else.
    pub(super) fn id(&mut self, what: &str) -> Result<i64, Error> {
        let word = self.word(what)?;
        match word.parse::<i64>() {
            Ok(id) if id >= 0 => Ok(id),
            _ => Err(self.wrong(&format!("{what}, an integer of at least 0"), word)),
        }
    }

    /// Checks that nothing follows.
    ///
    /// # Errors
    /// [`Error::Content`] when something does.
    pub(super) fn end(&mut self) -> Result<(), Error> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(self.wrong("the end of the line", word)),
        }
    }

    /// Content of this line that cannot be used.
    pub(super) fn wrong(&self, expected: &str, found: impl ToString) -> Error {
        Error::content(self.file, self.line, expected, found)
    }
}

/// A finite number; `nan`, `inf` and what overflows are none.
pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse::<f64>().ok().filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_blanks_line_ends_and_a_missing_last_newline_do_not_matter() {
        let text = "\u{feff}# one\r\n\r\n  a 1 2.5  \r\n\t# two\nb 2 -1e-3";
        let mut lines = Lines::new("", text.as_bytes());
        let mut fields = lines.fields().unwrap().unwrap();
        assert_eq!(fields.word("tag").unwrap(), "a");
        assert_eq!(fields.id("id").unwrap(), 1);
        assert_eq!(fields.number("x").unwrap(), 2.5);
        fields.end().unwrap();
        let mut fields = lines.fields().unwrap().unwrap();
        assert_eq!((fields.word("tag").unwrap(), fields.id("id").unwrap()), ("b", 2));
        assert_eq!(fields.numbers::<1>("x").unwrap(), [-1e-3]);
        assert!(lines.fields().unwrap().is_none());
        assert_eq!(lines.number(), 5);
    }

    #[test]
    fn what_is_no_finite_number_is_refused_with_its_line() {
        for word in ["nan", "inf", "-inf", "1e999", "0x10", "1,5", ""] {
            let text = format!("\nx {word}\n");
            let mut lines = Lines::new("points3D.txt", text.as_bytes());
            let mut fields = lines.fields().unwrap().unwrap();
            fields.word("tag").unwrap();
            let message = fields.number("y").unwrap_err().to_string();
            assert!(message.starts_with("points3D.txt line 2: expected y"), "{message}");
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_refused() {
        let mut lines = Lines::new("", b"a\n\xff\xfe\n".as_slice());
        assert!(lines.fields().unwrap().is_some());
        assert_eq!(
            lines.fields().err().unwrap().to_string(),
            "line 2: expected text, found bytes that are not UTF-8"
        );
    }
}
