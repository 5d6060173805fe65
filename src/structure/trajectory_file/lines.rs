//! Lines of a text file that may be anything.

use std::io::{BufRead, Read};

use super::TrajectoryFileError;

/// The largest trajectory file that is read, bytes.
pub const LARGEST_TRAJECTORY_FILE_BYTES: u64 = 512 << 20;

/// The longest line, bytes; EuRoC's longest have about 300.
const LONGEST_LINE_BYTES: u64 = 1 << 16;

/// The lines of a file, one at a time, in one buffer.
pub(super) struct Lines<R> {
    input: R,
    buffer: Vec<u8>,
    number: usize,
    bytes: u64,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(input: R) -> Self {
        Self { input, buffer: Vec::new(), number: 0, bytes: 0 }
    }

    /// The next line that is neither empty nor a comment, without blanks at its ends, and its number.
    ///
    /// # Errors
    /// A line or a file that is too long, and bytes that are not UTF-8.
    pub(super) fn next(&mut self) -> Result<Option<(usize, &str)>, TrajectoryFileError> {
        loop {
            self.buffer.clear();
            let length =
                self.input.by_ref().take(LONGEST_LINE_BYTES).read_until(b'\n', &mut self.buffer)? as u64;
            if length == 0 {
                return Ok(None);
            }
            self.number += 1;
            self.bytes += length;
            let number = self.number;
            if length == LONGEST_LINE_BYTES && self.buffer.last() != Some(&b'\n') {
                let expected = format!("a line of less than {LONGEST_LINE_BYTES} bytes");
                return Err(TrajectoryFileError::content(number, &expected, "a longer one"));
            }
            if self.bytes > LARGEST_TRAJECTORY_FILE_BYTES {
                let expected = format!("a file of at most {LARGEST_TRAJECTORY_FILE_BYTES} bytes");
                return Err(TrajectoryFileError::content(number, &expected, "more"));
            }
            if self.number == 1 && self.buffer.starts_with(b"\xef\xbb\xbf") {
                self.buffer.drain(..3);
            }
            let text = self.buffer.trim_ascii();
            if !text.is_empty() && !text.starts_with(b"#") {
                break;
            }
        }
        let text = str::from_utf8(self.buffer.trim_ascii())
            .map_err(|_| TrajectoryFileError::content(self.number, "text", "bytes that are not UTF-8"))?;
        Ok(Some((self.number, text)))
    }
}
