//! An MCAP file from its first byte to its last, without its index: what the validator holds it against.

use std::collections::{BTreeMap, BTreeSet};

use mcap::McapError;
use mcap::records::{Record, Statistics, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::counted_file::CountedFile;
use super::guard::guarded;
use super::mcap_reader::{CUT_SHORT, MAX_CHUNK_BYTES, MAX_CHUNK_RATIO};
use super::{Error, names};

/// Most faults of a kind that are kept in words; the rest is only counted.
const KEPT_FAULTS: usize = 16;
/// Most messages of the JSON topics that are kept; a sequence has one manifest and a summary a table.
const KEPT_MESSAGES: usize = 1 << 10;

/// Faults of one kind: the first ones in words, all of them counted.
#[derive(Clone, Debug, Default)]
pub(crate) struct Faults {
    /// The first ones.
    pub(crate) kept: Vec<String>,
    /// How many there are.
    pub(crate) count: u64,
}

impl Faults {
    fn add(&mut self, fault: impl FnOnce() -> String) {
        self.count += 1;
        if self.kept.len() < KEPT_FAULTS {
            self.kept.push(fault());
        }
    }
}

/// A channel as it stands in the data section.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurveyedChannel {
    /// Topic.
    pub(crate) topic: String,
    /// Message encoding.
    pub(crate) message_encoding: String,
    /// Encoding and bytes of its schema; `None` when it has none.
    pub(crate) schema: Option<(String, Vec<u8>)>,
}

/// What stands in an MCAP file, read in file order.
#[derive(Clone, Debug, Default)]
pub(crate) struct McapSurvey {
    /// The header's profile.
    pub(crate) profile: Option<String>,
    /// Whether the footer and the closing magic bytes were reached.
    pub(crate) complete: bool,
    /// What could not be decoded.
    pub(crate) unreadable: Faults,
    /// Checksums that are wrong.
    pub(crate) checksums: Faults,
    /// What the summary section and the indexes lack.
    pub(crate) index: Faults,
    /// Places where the log time falls.
    pub(crate) falling_times: Faults,
    /// Contents of the Metadata records that say what the file is.
    pub(crate) identities: Vec<BTreeMap<String, String>>,
    /// Channels, by id.
    pub(crate) channels: BTreeMap<u16, SurveyedChannel>,
    /// Log time and bytes of the first messages of the JSON topics.
    pub(crate) json: Vec<(String, u64, Vec<u8>)>,
}

/// Counts that the indexes are held against.
#[derive(Default)]
struct Tally {
    last_time: u64,
    messages: BTreeMap<u16, u64>,
    chunked_messages: u64,
    unchunked_messages: u64,
    message_index_entries: u64,
    chunks: u64,
    indexed_chunks: u64,
    in_summary: bool,
    summary_start: u64,
    summary_channels: BTreeSet<u16>,
    summary_schemas: BTreeSet<u16>,
    schemas: BTreeMap<u16, (String, Vec<u8>)>,
    channel_schemas: BTreeMap<u16, u16>,
    statistics: Option<Statistics>,
}

/// Whether the closing magic bytes are there.
fn ends_as_mcap(file: &CountedFile) -> bool {
    let end = file.length().checked_sub(mcap::MAGIC.len() as u64);
    end.and_then(|end| file.read_exact_at(end, mcap::MAGIC.len()).ok())
        .is_some_and(|bytes| *bytes == *mcap::MAGIC)
}

impl McapSurvey {
    pub(super) fn read(file: &CountedFile) -> Self {
        let (mut survey, mut tally) = (Self::default(), Tally::default());
        let walked = walk(file, options(file).with_emit_chunks(true), |opcode, data| {
            if opcode == op::CHUNK {
                survey.chunk(&mut tally, data, file);
            } else {
                survey.record(&mut tally, opcode, data, false);
            }
        });
        if let Err(error) = walked {
            survey.complete = false;
            if !ends_as_mcap(file) {
                survey.unreadable.add(|| CUT_SHORT.to_owned());
            }
            survey.unreadable.add(|| error.detail());
        }
        survey.sections(file);
        if survey.complete {
            survey.hold_index(&tally);
        }
        survey
    }

    /// Checks the checksums of the data section and of the summary section.
    fn sections(&mut self, file: &CountedFile) {
        let checked = |data: bool, summary: bool| {
            let options = options(file)
                .with_emit_chunks(true)
                .with_validate_data_section_crc(data)
                .with_validate_summary_section_crc(summary);
            walk(file, options, |_, _| {})
        };
        if let Err(Fault::Checksum(detail)) = checked(true, false) {
            self.checksums.add(|| detail);
        }
        if let Err(Fault::Checksum(detail)) = checked(false, true) {
            self.checksums.add(|| detail);
        }
    }

    fn chunk(&mut self, tally: &mut Tally, body: &[u8], file: &CountedFile) {
        tally.chunks += 1;
        let number = tally.chunks;
        match mcap::parse_record(op::CHUNK, body) {
            Ok(Record::Chunk { header, .. }) => {
                let limit = header.compressed_size.saturating_mul(MAX_CHUNK_RATIO).min(MAX_CHUNK_BYTES);
                if header.uncompressed_size > limit {
                    let size = header.uncompressed_size;
                    self.unreadable.add(|| {
                        format!("chunk {number}: uncompressed size {size} exceeds the limit of {limit}")
                    });
                    return;
                }
            }
            Ok(_) => return,
            Err(error) => {
                self.unreadable.add(|| format!("chunk {number}: {error}"));
                return;
            }
        }
        let mut head = [0; 9];
        head[0] = op::CHUNK;
        head[1..].copy_from_slice(&(body.len() as u64).to_le_bytes());
        let bytes: [&[u8]; 2] = [&head, body];
        let mut rest = std::io::Read::chain(bytes[0], bytes[1]);
        let options = options(file)
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(usize::try_from(MAX_CHUNK_BYTES).unwrap_or(usize::MAX));
        let walked = drive(
            options,
            |_, buffer| std::io::Read::read(&mut rest, buffer),
            |opcode, data| self.record(tally, opcode, data, true),
        );
        match walked {
            Ok(()) => {}
            Err(Fault::Checksum(detail)) => self.checksums.add(|| format!("chunk {number}: {detail}")),
            Err(Fault::Unreadable(detail)) => self.unreadable.add(|| format!("chunk {number}: {detail}")),
        }
    }

    fn record(&mut self, tally: &mut Tally, opcode: u8, data: &[u8], chunked: bool) {
        let record = match mcap::parse_record(opcode, data) {
            Ok(record) => record,
            Err(error) => {
                self.unreadable.add(|| format!("record with opcode {opcode:#04x}: {error}"));
                return;
            }
        };
        match record {
            Record::Header(header) => self.profile = Some(header.profile),
            Record::Schema { header, data } => {
                if tally.in_summary {
                    tally.summary_schemas.insert(header.id);
                } else {
                    tally.schemas.insert(header.id, (header.encoding, data.into_owned()));
                }
            }
            Record::Channel(channel) => {
                if tally.in_summary {
                    tally.summary_channels.insert(channel.id);
                } else {
                    if channel.schema_id != 0 {
                        tally.channel_schemas.insert(channel.id, channel.schema_id);
                    }
                    let schema = tally.schemas.get(&channel.schema_id).cloned();
                    let message_encoding = channel.message_encoding;
                    let surveyed = SurveyedChannel { topic: channel.topic, message_encoding, schema };
                    self.channels.insert(channel.id, surveyed);
                }
            }
            Record::Message { header, data } => {
                *tally.messages.entry(header.channel_id).or_default() += 1;
                if chunked {
                    tally.chunked_messages += 1;
                } else {
                    tally.unchunked_messages += 1;
                }
                let topic = self.channels.get(&header.channel_id).map(|channel| channel.topic.as_str());
                let topic = topic.unwrap_or("an unknown channel").to_owned();
                if header.log_time < tally.last_time {
                    let before = tally.last_time;
                    self.falling_times.add(|| {
                        format!("{topic}: a message at {} ns after one at {before} ns", header.log_time)
                    });
                }
                tally.last_time = header.log_time;
                let is_json = topic == names::MANIFEST_TOPIC || topic == names::SUMMARY_TOPIC;
                if is_json && self.json.len() < KEPT_MESSAGES {
                    self.json.push((topic, header.log_time, data.into_owned()));
                }
            }
            Record::MessageIndex(index) => tally.message_index_entries += index.records.len() as u64,
            Record::ChunkIndex(_) => tally.indexed_chunks += 1,
            Record::Statistics(statistics) => tally.statistics = Some(statistics),
            Record::Metadata(metadata)
                if metadata.name == names::IDENTITY && self.identities.len() < KEPT_MESSAGES =>
            {
                self.identities.push(metadata.metadata);
            }
            Record::DataEnd(_) => tally.in_summary = true,
            Record::Footer(footer) => {
                self.complete = true;
                tally.summary_start = footer.summary_start;
            }
            _ => {}
        }
    }

    /// Holds the summary section against what was seen.
    fn hold_index(&mut self, tally: &Tally) {
        if tally.unchunked_messages > 0 {
            self.index.add(|| format!("{} messages outside chunks", tally.unchunked_messages));
        }
        if tally.summary_start == 0 {
            self.index.add(|| "no summary section".to_owned());
            return;
        }
        let messages: u64 = tally.messages.values().sum();
        match &tally.statistics {
            None => self.index.add(|| "no statistics".to_owned()),
            Some(found) if found.message_count != messages => {
                self.index
                    .add(|| format!("statistics of {} messages; {messages} are there", found.message_count));
            }
            Some(found) if u64::from(found.chunk_count) != tally.chunks => {
                self.index.add(|| {
                    format!("statistics of {} chunks; {} are there", found.chunk_count, tally.chunks)
                });
            }
            Some(found)
                if found
                    .channel_message_counts
                    .iter()
                    .filter(|entry| *entry.1 > 0)
                    .ne(tally.messages.iter()) =>
            {
                self.index
                    .add(|| "statistics whose messages per channel are not those that are there".to_owned());
            }
            Some(_) => {}
        }
        if tally.indexed_chunks != tally.chunks {
            self.index.add(|| format!("{} chunk indexes for {} chunks", tally.indexed_chunks, tally.chunks));
        }
        if tally.message_index_entries != tally.chunked_messages {
            let (entries, messages) = (tally.message_index_entries, tally.chunked_messages);
            self.index.add(|| format!("{entries} message index entries for {messages} messages in chunks"));
        }
        for (id, channel) in &self.channels {
            if !tally.summary_channels.contains(id) {
                self.index
                    .add(|| format!("channel {} is not repeated in the summary section", channel.topic));
            }
        }
        for (channel, schema) in &tally.channel_schemas {
            if tally.schemas.contains_key(schema) && !tally.summary_schemas.contains(schema) {
                let topic = self.channels.get(channel).map_or("", |channel| channel.topic.as_str());
                self.index
                    .add(|| format!("the schema of channel {topic} is not repeated in the summary section"));
            }
        }
    }
}

/// Why a walk ended early.
enum Fault {
    Checksum(String),
    Unreadable(String),
}

impl Fault {
    fn detail(self) -> String {
        match self {
            Self::Checksum(detail) | Self::Unreadable(detail) => detail,
        }
    }
}

impl From<McapError> for Fault {
    fn from(error: McapError) -> Self {
        let detail = error.to_string();
        match error {
            McapError::BadChunkCrc { .. }
            | McapError::BadDataCrc { .. }
            | McapError::BadSummaryCrc { .. }
            | McapError::BadAttachmentCrc { .. } => Self::Checksum(detail),
            _ => Self::Unreadable(detail),
        }
    }
}

fn options(file: &CountedFile) -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_record_length_limit(usize::try_from(file.length().min(MAX_CHUNK_BYTES)).unwrap_or(usize::MAX))
}

/// Hands every record of a file to `visit`.
fn walk(file: &CountedFile, options: LinearReaderOptions, visit: impl FnMut(u8, &[u8])) -> Result<(), Fault> {
    let walked = guarded(file.path(), "MCAP", || {
        Ok(drive(options, |offset, buffer| file.read_at(offset, buffer), visit))
    });
    match walked {
        Ok(result) => result,
        Err(Error::Decoder { detail, .. }) => Err(Fault::Unreadable(detail)),
        Err(error) => Err(Fault::Unreadable(error.to_string())),
    }
}

fn drive(
    options: LinearReaderOptions,
    mut read: impl FnMut(u64, &mut [u8]) -> std::io::Result<usize>,
    mut visit: impl FnMut(u8, &[u8]),
) -> Result<(), Fault> {
    let mut reader = LinearReader::new_with_options(options);
    let mut offset = 0;
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                let count = read(offset, reader.insert(need))
                    .map_err(|error| Fault::Unreadable(error.to_string()))?;
                offset += count as u64;
                reader.notify_read(count);
            }
            LinearReadEvent::Record { data, opcode } => visit(opcode, data),
        }
    }
    Ok(())
}

/// The survey of a file that cannot be opened by its index.
pub(crate) fn survey_file(path: &std::path::Path) -> Result<McapSurvey, Error> {
    Ok(McapSurvey::read(&CountedFile::open(path, std::sync::Arc::default())?))
}
