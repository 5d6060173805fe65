//! Arrow data as MCAP bytes: a serialised schema, and one encapsulated record batch a message.

use std::collections::HashMap;

use arrow::array::RecordBatch;
use arrow::buffer::Buffer;
use arrow::datatypes::{Schema, SchemaRef};
use arrow::error::ArrowError;
use arrow::ipc::reader::RecordBatchDecoder;
use arrow::ipc::writer::{
    DictionaryTracker, EncodedData, IpcDataGenerator, IpcWriteContext, IpcWriteOptions, write_message,
};
use arrow::ipc::{MetadataVersion, convert, root_as_message};

/// Marks the beginning of an encapsulated message.
const CONTINUATION: [u8; 4] = [0xff; 4];
/// Most rows that one message may claim: the body cannot hold more, except of columns without bytes.
const MAX_ROWS: i64 = 1 << 31;
/// Buffers are padded to this many bytes; a frame's columns are short, so the smallest is best.
const ALIGNMENT: usize = 8;

/// Encodes record batches, with its buffers reused.
pub(super) struct MessageEncoder {
    generator: IpcDataGenerator,
    options: IpcWriteOptions,
    context: IpcWriteContext,
    bytes: Vec<u8>,
}

impl MessageEncoder {
    pub(super) fn new() -> Result<Self, ArrowError> {
        Ok(Self {
            generator: IpcDataGenerator::default(),
            options: IpcWriteOptions::try_new(ALIGNMENT, false, MetadataVersion::V5)?,
            context: IpcWriteContext::default(),
            bytes: Vec::new(),
        })
    }

    /// The serialised IPC Schema message of a schema.
    pub(super) fn schema(&self, schema: &Schema) -> Result<Vec<u8>, ArrowError> {
        let encoded = self.generator.schema_to_bytes_with_dictionary_tracker(
            schema,
            &mut DictionaryTracker::new(true),
            &self.options,
        );
        let mut bytes = Vec::new();
        write_message(&mut bytes, encoded, &self.options)?;
        Ok(bytes)
    }

    /// The encapsulated message of one record batch; valid until the next call.
    pub(super) fn batch(&mut self, batch: &RecordBatch) -> Result<&[u8], ArrowError> {
        let (_, encoded): (_, EncodedData) = self.generator.encode(
            batch,
            &mut DictionaryTracker::new(true),
            &self.options,
            &mut self.context,
        )?;
        self.bytes.clear();
        write_message(&mut self.bytes, encoded, &self.options)?;
        Ok(&self.bytes)
    }
}

/// The schema of serialised IPC bytes.
pub(super) fn decode_schema(bytes: &[u8]) -> Result<Schema, ArrowError> {
    convert::try_schema_from_ipc_buffer(bytes)
}

/// The record batch of an encapsulated message.
pub(super) fn decode_batch(bytes: Vec<u8>, schema: SchemaRef) -> Result<RecordBatch, ArrowError> {
    let corrupt = |what: &str| ArrowError::ParseError(what.to_owned());
    // The columns of the batch are views of this buffer.
    let bytes = Buffer::from_vec(bytes);
    let rest = bytes.strip_prefix(&CONTINUATION).unwrap_or(&bytes);
    let (length, rest) =
        rest.split_first_chunk::<4>().ok_or_else(|| corrupt("message shorter than its length"))?;
    let length =
        usize::try_from(i32::from_le_bytes(*length)).map_err(|_| corrupt("negative message length"))?;
    if length > rest.len() {
        return Err(corrupt("message header longer than the message"));
    }
    let (header, body) = rest.split_at(length);
    let message = root_as_message(header).map_err(|error| corrupt(&format!("message header: {error}")))?;
    let batch = message.header_as_record_batch().ok_or_else(|| corrupt("not a record batch"))?;
    if !(0..MAX_ROWS).contains(&batch.length()) {
        return Err(corrupt(&format!("{} rows claimed", batch.length())));
    }
    if batch.compression().is_some() {
        return Err(corrupt("compressed body; chunks compress, messages must not"));
    }
    let body = bytes.slice(bytes.len() - body.len());
    RecordBatchDecoder::try_new(&body, batch, schema, &HashMap::new(), &message.version())?
        .with_require_alignment(false)
        .read_record_batch()
}
