//! The container of `.rrd` files: a header, then messages in protobuf, each with its kind and its length.

use std::io::{self, Write};

/// What a file begins with.
const MAGIC: &[u8; 4] = b"RRF2";
/// The version of the viewer whose files these are like.
const VERSION: [u8; 4] = [0, 41, 0, 0];
/// Messages are not compressed, and are written in protobuf.
const OPTIONS: [u8; 4] = [0, 2, 0, 0];
/// Kinds of messages.
const STORE_INFO: u64 = 1;
const ARROW: u64 = 2;
const END: u64 = 0;

/// A name for something in a recording: sixteen bytes, rising.
///
/// Rerun makes them of the time and of chance; here they are counted, so that the same sequence gives the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tuid(pub(super) u64);

impl Tuid {
    /// The high half; the time of others.
    const HIGH: u64 = 1;

    /// As it stands in a column.
    pub(super) fn bytes(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        bytes[..8].copy_from_slice(&Self::HIGH.to_be_bytes());
        bytes[8..].copy_from_slice(&self.0.to_be_bytes());
        bytes
    }

    /// As a chunk is called in its metadata.
    pub(super) fn chunk_name(self) -> String {
        format!("chunk_{:016X}{:016x}", Self::HIGH, self.0)
    }

    fn message(self) -> Message {
        Message::default().fixed(1, Self::HIGH).fixed(2, self.0)
    }
}

/// A protobuf message that grows.
#[derive(Clone, Debug, Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(mut self, field: u64, number: u64) -> Self {
        self.push(field << 3);
        self.push(number);
        self
    }

    fn fixed(mut self, field: u64, number: u64) -> Self {
        self.push(field << 3 | 1);
        self.0.extend_from_slice(&number.to_le_bytes());
        self
    }

    fn bytes(mut self, field: u64, bytes: &[u8]) -> Self {
        self.push(field << 3 | 2);
        self.push(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
        self
    }

    /// Seven bits at a time, the lowest first.
    #[expect(clippy::cast_possible_truncation, reason = "the low seven bits are wanted")]
    fn push(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.0.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.0.push(number as u8);
    }
}

/// A recording that is written message by message.
pub(super) struct RrdStream<W> {
    output: W,
    store: Vec<u8>,
    next: u64,
}

impl<W: Write> RrdStream<W> {
    /// Begins a recording.
    ///
    /// * `recording` — what tells recordings apart; the viewer lays those of one name upon each other.
    pub(super) fn begin(mut output: W, recording: &str) -> io::Result<Self> {
        output.write_all(MAGIC)?;
        output.write_all(&VERSION)?;
        output.write_all(&OPTIONS)?;
        let application = Message::default().bytes(1, b"open-structure");
        let store = Message::default().varint(1, 1).bytes(2, recording.as_bytes()).bytes(3, &application.0).0;
        let mut stream = Self { output, store, next: 1 };
        // A source of another kind, by name.
        let source = Message::default().varint(1, 6).bytes(2, &Message::default().bytes(1, b"os export").0);
        let info = Message::default().bytes(2, &stream.store).bytes(5, &source.0);
        let message = Message::default().bytes(1, &stream.tuid().message().0).bytes(2, &info.0);
        stream.message(STORE_INFO, &message.0)?;
        Ok(stream)
    }

    /// The next name.
    pub(super) fn tuid(&mut self) -> Tuid {
        self.next += 1;
        Tuid(self.next - 1)
    }

    /// Adds a chunk.
    ///
    /// * `arrow` — an Arrow IPC stream of one record batch.
    /// * `is_static` — whether it holds at all times.
    pub(super) fn chunk(&mut self, id: Tuid, arrow: &[u8], is_static: bool) -> io::Result<()> {
        // Not compressed, Arrow IPC.
        let message = Message::default()
            .bytes(1, &self.store)
            .varint(2, 1)
            .varint(3, arrow.len() as u64)
            .varint(4, 1)
            .bytes(5, arrow)
            .bytes(6, &id.message().0)
            .varint(7, u64::from(is_static));
        self.message(ARROW, &message.0)
    }

    /// Ends the recording.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.message(END, &[])?;
        self.output.flush()
    }

    fn message(&mut self, kind: u64, payload: &[u8]) -> io::Result<()> {
        self.output.write_all(&kind.to_le_bytes())?;
        self.output.write_all(&(payload.len() as u64).to_le_bytes())?;
        self.output.write_all(payload)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_protobuf_has_them() {
        // 300 is the example of the encoding's documentation.
        assert_eq!(Message::default().varint(1, 300).0, [0x08, 0xac, 0x02]);
        assert_eq!(Message::default().bytes(2, b"testing").0, b"\x12\x07testing");
        assert_eq!(Message::default().fixed(1, 1).0, [0x09, 1, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn names_rise_and_are_written_in_that_order() {
        assert!(Tuid(1).bytes() < Tuid(2).bytes() && Tuid(255).bytes() < Tuid(256).bytes());
        assert_eq!(Tuid(255).chunk_name(), "chunk_000000000000000100000000000000ff");
    }
}
