//! An MCAP file as a sequence.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use arrow::array::RecordBatch;
use arrow::datatypes::SchemaRef;
use mcap::Summary;
use mcap::sans_io::indexed_reader::{IndexedReadEvent, IndexedReader, IndexedReaderOptions};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use serde::de::DeserializeOwned;

use super::arrow_batch::from_batch;
use super::arrow_message::{decode_batch, decode_schema};
use super::counted_file::CountedFile;
use super::guard::guarded;
use super::mcap_chunk::{AFTER_CHECKSUM, Checksum};
use super::mcap_survey::McapSurvey;
use super::reader::Damaged;
use super::stored_table::StoredTable;
use super::{Error, names};
use crate::structure::{Manifest, Record, TableInfo, TableSummary, table_info};

/// Largest chunk that is decompressed; writers keep to a few MiB.
pub(super) const MAX_CHUNK_BYTES: u64 = 1 << 29;
/// Largest plausible ratio of a chunk's sizes; zstd reaches a few thousand on constant data.
pub(super) const MAX_CHUNK_RATIO: u64 = 1 << 16;
/// Largest plausible ratio of all chunks together, uncompressed, to the file.
const MAX_RATIO: u64 = 512;
/// Uncompressed size that any file may have, however well it compresses.
const ALWAYS_PERMITTED_BYTES: u64 = 1 << 26;

/// A table's channel.
#[derive(Clone, Debug)]
struct TableChannel {
    id: u16,
    schema: SchemaRef,
}

/// An indexed MCAP file that holds a sequence.
pub(super) struct McapReader {
    file: CountedFile,
    summary: Summary,
    channels: BTreeMap<&'static str, Vec<TableChannel>>,
    stored: Vec<StoredTable>,
    passed_over: Vec<String>,
    /// Whether chunks are held against their checksums.
    checks: bool,
}

impl McapReader {
    /// Opens a file; tables whose channels cannot be understood are listed apart.
    ///
    /// * `checks` — whether chunks are refused whose checksums are wrong.
    pub(super) fn open(
        path: &Path,
        bytes_read: Arc<AtomicU64>,
        checks: bool,
    ) -> Result<(Self, Damaged), Error> {
        let file = CountedFile::open(path, bytes_read)?;
        let summary = guarded(path, "MCAP", || read_summary(&file))?;
        check_chunks(path, &summary, file.length())?;
        let mut channels: BTreeMap<&'static str, Vec<TableChannel>> = BTreeMap::new();
        let (mut stored, mut passed_over, mut damaged) = (Vec::new(), Vec::new(), Vec::new());
        let mut listed: Vec<_> = summary.channels.values().collect();
        listed.sort_by(|left, right| left.topic.cmp(&right.topic).then(left.id.cmp(&right.id)));
        for channel in listed {
            let topic = channel.topic.as_str();
            // Topics for viewers say nothing that the tables do not say.
            let for_viewers = topic.starts_with(names::FOXGLOVE_PREFIX);
            if topic == names::MANIFEST_TOPIC || topic == names::SUMMARY_TOPIC || for_viewers {
                continue;
            }
            let Some(table) = topic.strip_prefix('/').and_then(table_info) else {
                passed_over.push(topic.to_owned());
                continue;
            };
            match table_schema(path, channel) {
                Ok(schema) => {
                    stored.push(StoredTable::new(table, &schema, None));
                    channels.entry(table.name).or_default().push(TableChannel { id: channel.id, schema });
                }
                Err(error) => damaged.push((table, error)),
            }
        }
        Ok((Self { file, summary, channels, stored, passed_over, checks }, damaged))
    }

    pub(super) fn path(&self) -> &Path {
        self.file.path()
    }

    /// Tables that are there, known ones alone.
    pub(super) fn stored(&self) -> &[StoredTable] {
        &self.stored
    }

    /// Topics that this version does not know.
    pub(super) fn passed_over(&self) -> &[String] {
        &self.passed_over
    }

    /// Topics that are neither of this format nor of the viewer channels that a writer may add.
    pub(super) fn unknown_topics(&self) -> Vec<String> {
        let for_viewers = |topic: &str| {
            self.summary.channels.values().any(|channel| {
                channel.topic == topic
                    && channel.schema.as_ref().is_some_and(|schema| schema.name.starts_with("foxglove."))
            })
        };
        self.passed_over.iter().filter(|topic| !for_viewers(topic)).cloned().collect()
    }

    /// Reads the whole file once, without its index.
    pub(super) fn survey(&self) -> McapSurvey {
        McapSurvey::read(&self.file)
    }

    fn channel_named(&self, topic: &str) -> Option<u16> {
        self.summary.channels.values().find(|channel| channel.topic == topic).map(|channel| channel.id)
    }

    /// The JSON records of a topic.
    fn json<T: DeserializeOwned>(&self, topic: &str) -> Result<Vec<T>, Error> {
        let Some(id) = self.channel_named(topic) else { return Ok(Vec::new()) };
        let mut records = Vec::new();
        for message in self.messages([topic.to_owned()], None)? {
            let message = message?;
            if message.channel == id {
                records.push(serde_json::from_slice(&message.data).map_err(|error| Error::Manifest {
                    path: self.path().to_owned(),
                    detail: format!("topic {topic}: {error}"),
                })?);
            }
        }
        Ok(records)
    }

    /// The text of the manifest message, as it is.
    pub(super) fn manifest_text(&self) -> Result<Vec<u8>, Error> {
        match self.messages([names::MANIFEST_TOPIC.to_owned()], None)?.next() {
            Some(message) => Ok(message?.data),
            None => Err(Error::NotASequence {
                path: self.path().to_owned(),
                found: format!("an MCAP file without a message on {}", names::MANIFEST_TOPIC),
            }),
        }
    }

    /// The texts of the table summaries, as they are.
    pub(super) fn summary_texts(&self) -> Result<Vec<Vec<u8>>, Error> {
        self.messages([names::SUMMARY_TOPIC.to_owned()], None)?
            .map(|message| message.map(|message| message.data))
            .collect()
    }

    /// The manifest, with the table summaries put in.
    pub(super) fn manifest(&self) -> Result<Manifest, Error> {
        let mut manifest: Manifest = serde_json::from_slice(&self.manifest_text()?)
            .map_err(|error| Error::Manifest { path: self.path().to_owned(), detail: error.to_string() })?;
        let summaries: Vec<TableSummary> = self.json(names::SUMMARY_TOPIC)?;
        if !summaries.is_empty() {
            manifest.tables = summaries;
        }
        Ok(manifest)
    }

    /// Messages of some topics in time order, within a range of stamps.
    pub(super) fn messages(
        &self,
        topics: impl IntoIterator<Item = String>,
        stamps: Option<(u64, u64)>,
    ) -> Result<Messages, Error> {
        let topics: Vec<String> =
            topics.into_iter().filter(|topic| self.channel_named(topic).is_some()).collect();
        let mut options = IndexedReaderOptions::new()
            .with_record_length_limit(usize::try_from(MAX_CHUNK_BYTES).unwrap_or(usize::MAX));
        if let Some((first, last)) = stamps {
            options = options.starting_at(first).ending_at(last);
        }
        let mut checks = None;
        let reader = if topics.is_empty() {
            None
        } else {
            let options = options.include_topics(topics);
            Some(guarded(self.path(), "MCAP", || {
                let failed = |error: mcap::McapError| Error::container(self.path(), "MCAP")(error.into());
                let mut reader = IndexedReader::new_with_options(&self.summary, options).map_err(failed)?;
                if self.checks {
                    let checksum = Checksum::default();
                    checksum.checked_by(&mut reader).map_err(failed)?;
                    checks = Some((checksum, self.compressions()?));
                }
                Ok(reader)
            })?)
        };
        Ok(Messages { file: self.file.clone(), reader, checks })
    }

    /// How long the name of each chunk's compression is, by the place where its contents begin.
    fn compressions(&self) -> Result<BTreeMap<u64, u64>, Error> {
        let failed = |error: mcap::McapError| Error::container(self.path(), "MCAP")(error.into());
        let chunks = self.summary.chunk_indexes.iter();
        chunks
            .map(|chunk| {
                Ok((chunk.compressed_data_offset().map_err(failed)?, chunk.compression.len() as u64))
            })
            .collect()
    }

    /// The table that a message belongs to.
    pub(super) fn table_of(&self, message: &Message) -> Option<&'static str> {
        let listed =
            |channels: &Vec<TableChannel>| channels.iter().any(|channel| channel.id == message.channel);
        self.channels.iter().find(|(_, channels)| listed(channels)).map(|(table, _)| *table)
    }

    /// Appends the rows of one message, if it is one of their table, and says whether it is.
    pub(super) fn rows_into<R: Record>(
        &self,
        message: Message,
        first_row: u64,
        rows: &mut Vec<R>,
    ) -> Result<bool, Error> {
        let make = |batch: &RecordBatch| from_batch(batch, first_row, rows);
        Ok(self.batch_as(message, R::TABLE, make)?.is_some())
    }

    /// The columns of one message, if it is one of the table.
    pub(super) fn columns(&self, message: Message, table: &TableInfo) -> Result<Option<RecordBatch>, Error> {
        self.batch_as(message, table, |batch| Ok(batch.clone()))
    }

    /// What is made of the record batch of one message, if it is one of the table.
    fn batch_as<T>(
        &self,
        message: Message,
        table: &TableInfo,
        make: impl FnOnce(&RecordBatch) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        let mut channels = self.channels.get(table.name).into_iter().flatten();
        let Some(channel) = channels.find(|channel| channel.id == message.channel) else { return Ok(None) };
        guarded(self.path(), "Arrow", || {
            let Message { log_time, data, .. } = message;
            let batch =
                decode_batch(data, Arc::clone(&channel.schema)).map_err(|error| Error::Container {
                    path: self.path().to_owned(),
                    container: "Arrow",
                    detail: format!("{} message at {log_time} ns: {error}", table.name),
                })?;
            make(&batch).map(Some)
        })
    }

    /// Reads the whole file once and checks every CRC of the container.
    pub(super) fn verify(&self) -> Result<(), Error> {
        let path = self.path();
        guarded(path, "MCAP", || {
            let failed = |error: mcap::McapError| Error::container(path, "MCAP")(error.into());
            let options = LinearReaderOptions::default()
                .with_emit_chunks(false)
                .with_validate_chunk_crcs(true)
                .with_validate_data_section_crc(true)
                .with_validate_summary_section_crc(true)
                .with_record_length_limit(
                    usize::try_from(self.file.length().min(MAX_CHUNK_BYTES)).unwrap_or(usize::MAX),
                );
            let mut reader = LinearReader::new_with_options(options);
            let mut offset = 0;
            while let Some(event) = reader.next_event() {
                match event.map_err(failed)? {
                    LinearReadEvent::ReadRequest(need) => {
                        let read = self.file.read_at(offset, reader.insert(need)).map_err(Error::io(path))?;
                        offset += read as u64;
                        reader.notify_read(read);
                    }
                    LinearReadEvent::Record { .. } => {}
                }
            }
            Ok(())
        })
    }
}

/// The Arrow schema of a table's channel.
fn table_schema(path: &Path, channel: &mcap::Channel<'_>) -> Result<SchemaRef, Error> {
    let topic = &channel.topic;
    let failed = |detail: String| Error::Container { path: path.to_owned(), container: "MCAP", detail };
    if channel.message_encoding != names::ARROW_ENCODING {
        return Err(failed(format!(
            "topic {topic} has message encoding `{}`; expected `{}`",
            channel.message_encoding,
            names::ARROW_ENCODING
        )));
    }
    let Some(schema) = channel.schema.as_ref() else {
        return Err(failed(format!("topic {topic} has no schema")));
    };
    guarded(path, "Arrow", || {
        decode_schema(&schema.data).map_err(|error| failed(format!("schema of topic {topic}: {error}")))
    })
    .map(Arc::new)
}

/// A message and where it belongs.
#[derive(Clone, Debug)]
pub(super) struct Message {
    pub(super) channel: u16,
    pub(super) log_time: u64,
    pub(super) data: Vec<u8>,
}

/// Messages in time order.
pub(super) struct Messages {
    file: CountedFile,
    reader: Option<IndexedReader>,
    /// What chunks are held against, and how long the name of each one's compression is.
    checks: Option<(Checksum, BTreeMap<u64, u64>)>,
}

impl Messages {
    fn advance(&mut self) -> Result<Option<Message>, Error> {
        let Self { file, reader, checks } = self;
        let Some(indexed) = reader else { return Ok(None) };
        guarded(file.path(), "MCAP", || {
            let failed = |error: mcap::McapError| Error::container(file.path(), "MCAP")(error.into());
            loop {
                let (offset, length) = match indexed.next_event() {
                    None => return Ok(None),
                    Some(event) => match event.map_err(failed)? {
                        IndexedReadEvent::Message { header, data } => {
                            return Ok(Some(Message {
                                channel: header.channel_id,
                                log_time: header.log_time,
                                data: data.to_vec(),
                            }));
                        }
                        IndexedReadEvent::ReadChunkRequest { offset, length } => (offset, length),
                    },
                };
                // With the end of its header, where the checksum stands.
                let compression = checks.as_ref().and_then(|(_, names)| names.get(&offset)).copied();
                let before = compression.map_or(0, |name| AFTER_CHECKSUM + name);
                let begin = offset.checked_sub(before).ok_or_else(|| failed(mcap::McapError::BadIndex))?;
                let whole = usize::try_from(before).unwrap_or_default().saturating_add(length);
                let bytes = file.read_exact_at(begin, whole).map_err(Error::io(file.path()))?;
                let (header, bytes) = bytes.split_at(bytes.len() - length);
                if let (Some((checksum, _)), Some(saved)) = (&*checks, header.first_chunk()) {
                    checksum.expect(u32::from_le_bytes(*saved));
                    if compression == Some(0) {
                        checksum.check(bytes).map_err(failed)?;
                    }
                }
                indexed.insert_chunk_record_data(offset, bytes).map_err(failed)?;
            }
        })
    }
}

impl Iterator for Messages {
    type Item = Result<Message, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let result = self.advance().transpose();
        if matches!(result, Some(Err(_))) {
            // The reader's state is not to be trusted after an error.
            self.reader = None;
        }
        result
    }
}

/// Said of a file without its end.
pub(super) const CUT_SHORT: &str = "the closing magic bytes are missing; was the file cut short?";

/// Refuses an index whose chunks would not fit into the file, or would take much more memory than files do.
fn check_chunks(path: &Path, summary: &Summary, length: u64) -> Result<(), Error> {
    let too_large =
        |what: String, found, limit| Err(Error::TooLarge { path: path.to_owned(), what, found, limit });
    let (mut compressed, mut uncompressed) = (0_u64, 0_u64);
    for chunk in &summary.chunk_indexes {
        if chunk.uncompressed_size > MAX_CHUNK_BYTES {
            let what = format!("a chunk's uncompressed size (at byte {})", chunk.chunk_start_offset);
            return too_large(what, chunk.uncompressed_size, MAX_CHUNK_BYTES);
        }
        compressed = compressed.saturating_add(chunk.compressed_size);
        uncompressed = uncompressed.saturating_add(chunk.uncompressed_size);
    }
    if compressed > length {
        // Chunks that overlap would be read, and their rows taken, again and again.
        return too_large("size of all chunks".to_owned(), compressed, length);
    }
    let limit = length.saturating_mul(MAX_RATIO).saturating_add(ALWAYS_PERMITTED_BYTES);
    if uncompressed > limit {
        return too_large("uncompressed size of all chunks".to_owned(), uncompressed, limit);
    }
    Ok(())
}

fn read_summary(file: &CountedFile) -> Result<Summary, Error> {
    let path = file.path();
    let failed = |error: mcap::McapError| match error {
        // Those at the beginning are looked at below.
        mcap::McapError::BadMagic => {
            Error::Container { path: path.to_owned(), container: "MCAP", detail: CUT_SHORT.to_owned() }
        }
        error => Error::container(path, "MCAP")(error.into()),
    };
    let mut magic = [0; 8];
    let read = file.read_at(0, &mut magic).map_err(Error::io(path))?;
    if magic[..read] != *mcap::MAGIC {
        return Err(Error::NotASequence {
            path: path.to_owned(),
            found: "a file without MCAP's magic bytes".to_owned(),
        });
    }
    let options = SummaryReaderOptions::default()
        .with_file_size(file.length())
        .with_record_length_limit(usize::try_from(file.length()).unwrap_or(usize::MAX));
    let mut reader = SummaryReader::new_with_options(options);
    let mut position = 0;
    while let Some(event) = reader.next_event() {
        match event.map_err(failed)? {
            SummaryReadEvent::ReadRequest(need) => {
                let read = file.read_at(position, reader.insert(need)).map_err(Error::io(path))?;
                position += read as u64;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(std::io::SeekFrom::Start(target)) => {
                position = target;
                reader.notify_seeked(target);
            }
            SummaryReadEvent::SeekRequest(std::io::SeekFrom::End(back)) => {
                position = file.length().saturating_add_signed(back);
                reader.notify_seeked(position);
            }
            SummaryReadEvent::SeekRequest(std::io::SeekFrom::Current(by)) => {
                position = position.saturating_add_signed(by);
                reader.notify_seeked(position);
            }
        }
    }
    match reader.finish() {
        Some(summary) if !summary.channels.is_empty() => Ok(summary),
        _ => Err(Error::Container {
            path: path.to_owned(),
            container: "MCAP",
            detail: "no summary section: the file was cut off or written without an index".to_owned(),
        }),
    }
}
