//! A sequence as one MCAP file.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use arrow::array::RecordBatch;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions as McapOptions, Writer};
use serde::Serialize;

use super::Error;
use super::arrow_message::MessageEncoder;
use super::arrow_schema::arrow_schema;
use super::json_schema::json_schema;
use super::names;
use super::partial::Partial;
use crate::structure::{Manifest, TableInfo, TableSummary};

/// Uncompressed size at which a chunk is closed: small enough to seek, large enough to compress.
const CHUNK_BYTES: u64 = 1 << 20;

/// A channel and the number of its next message.
#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    sequence: u32,
}

/// Writes messages in time order, chunked, compressed and indexed.
pub(super) struct McapWriter {
    path: PathBuf,
    partial: Partial,
    writer: Writer<BufWriter<File>>,
    encoder: MessageEncoder,
    channels: HashMap<String, Channel>,
}

impl McapWriter {
    /// Begins the file with its identity and the manifest, which is stamped with the first frame's time.
    pub(super) fn create(
        path: &Path,
        manifest: &Manifest,
        first_stamp: u64,
        force: bool,
    ) -> Result<Self, Error> {
        let partial = Partial::file(path, force)?;
        let file = BufWriter::new(partial.create_file()?);
        // One compressing thread, so that the bytes do not depend on the machine.
        let options = McapOptions::new()
            .profile("")
            .library(format!("open-structure {}", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES));
        let failed = |error: mcap::McapError| Error::container(path, "MCAP")(error.into());
        let mut writer = options.create(file).map_err(failed)?;
        let identity = BTreeMap::from([
            ("spec_version".to_owned(), manifest.spec_version.clone()),
            ("name".to_owned(), manifest.name.clone()),
        ]);
        writer
            .write_metadata(&Metadata { name: names::IDENTITY.to_owned(), metadata: identity })
            .map_err(failed)?;
        let encoder = MessageEncoder::new().map_err(|error| Error::container(path, "Arrow")(error.into()))?;
        let mut this = Self { path: path.to_owned(), partial, writer, encoder, channels: HashMap::new() };
        let bare = Manifest { tables: Vec::new(), ..manifest.clone() };
        this.write_json(names::MANIFEST_TOPIC, "manifest", first_stamp, &bare)?;
        Ok(this)
    }

    pub(super) fn failed(&self, error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
        Error::container(&self.path, "MCAP")(error.into())
    }

    /// The channel of a topic, made on first use.
    pub(super) fn channel(
        &mut self,
        topic: &str,
        message_encoding: &str,
        schema: impl FnOnce(&Self) -> Result<(String, String, Vec<u8>), Error>,
    ) -> Result<(), Error> {
        if self.channels.contains_key(topic) {
            return Ok(());
        }
        let (name, encoding, data) = schema(self)?;
        let schema_id =
            self.writer.add_schema(&name, &encoding, &data).map_err(|error| self.failed(error))?;
        let id = self
            .writer
            .add_channel(schema_id, topic, message_encoding, &BTreeMap::new())
            .map_err(|error| self.failed(error))?;
        self.channels.insert(topic.to_owned(), Channel { id, sequence: 0 });
        Ok(())
    }

    /// Makes the channel of a table, so that the table is there even without rows.
    pub(super) fn declare(&mut self, table: &'static TableInfo) -> Result<(), Error> {
        self.channel(&table.topic(), names::ARROW_ENCODING, |this| {
            let data = this.encoder.schema(&arrow_schema(table)).map_err(|error| this.failed(error))?;
            Ok((format!("{}{}", names::SCHEMA_PREFIX, table.record), names::ARROW_ENCODING.to_owned(), data))
        })
    }

    /// Writes one record batch of a declared table.
    pub(super) fn write_batch(
        &mut self,
        table: &'static TableInfo,
        stamp: u64,
        batch: &RecordBatch,
    ) -> Result<(), Error> {
        let Self { path, writer, encoder, channels, .. } = self;
        let bytes = encoder.batch(batch).map_err(|error| Error::container(path, "Arrow")(error.into()))?;
        send(path, writer, channels, &table.topic(), stamp, bytes)
    }

    fn write_json<T: Serialize>(
        &mut self,
        topic: &str,
        name: &str,
        stamp: u64,
        record: &T,
    ) -> Result<(), Error> {
        self.channel(topic, names::JSON_ENCODING, |_| {
            let schema = json_schema(name).unwrap_or_default();
            let name = format!("{}{name}", names::SCHEMA_PREFIX);
            Ok((name, names::JSON_SCHEMA_ENCODING.to_owned(), schema.into_bytes()))
        })?;
        let bytes = serde_json::to_vec(record).map_err(|error| self.failed(error))?;
        self.write_message(topic, stamp, &bytes)
    }

    /// Writes the bytes of a message on a channel that was made before.
    pub(super) fn write_message(&mut self, topic: &str, stamp: u64, bytes: &[u8]) -> Result<(), Error> {
        send(&self.path, &mut self.writer, &mut self.channels, topic, stamp, bytes)
    }

    /// Writes the summaries and the index, and gives the file its name.
    pub(super) fn finish(mut self, summaries: &[TableSummary], last_stamp: u64) -> Result<(), Error> {
        for summary in summaries {
            self.write_json(names::SUMMARY_TOPIC, "table_summaries", last_stamp, summary)?;
        }
        let Self { path, partial, mut writer, .. } = self;
        writer.finish().map_err(|error| Error::container(&path, "MCAP")(error.into()))?;
        let mut file = writer.into_inner();
        file.flush().map_err(Error::io(&path))?;
        drop(file);
        partial.finish()
    }
}

fn send(
    path: &Path,
    writer: &mut Writer<BufWriter<File>>,
    channels: &mut HashMap<String, Channel>,
    topic: &str,
    stamp: u64,
    bytes: &[u8],
) -> Result<(), Error> {
    let failed = Error::container(path, "MCAP");
    let Some(channel) = channels.get_mut(topic) else {
        return Err(failed(format!("no channel was made for {topic}").into()));
    };
    let header = MessageHeader {
        channel_id: channel.id,
        sequence: channel.sequence,
        log_time: stamp,
        publish_time: stamp,
    };
    channel.sequence = channel.sequence.wrapping_add(1);
    writer.write_to_known_channel(&header, bytes).map_err(|error| failed(error.into()))
}
