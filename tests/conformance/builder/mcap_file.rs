//! A document as an MCAP file.

use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;

use arrow::ipc::MetadataVersion;
use arrow::ipc::writer::{IpcWriteOptions, StreamWriter};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions};
use open_structure::format::json_schema;
use open_structure::structure::Storage;
use serde::Deserialize;
use serde_json::Value;

use super::document::{Cell, Document, Table};
use super::edit::Edit;
use super::{Result, arrays};

/// How the file is written.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub(crate) struct Options {
    profile: Option<String>,
    /// Replaces the values of the identity record; a null takes one out.
    #[serde(default)]
    identity: BTreeMap<String, Option<String>>,
    /// Name of the identity record.
    identity_name: Option<String>,
    /// How often the identity record is written.
    identity_records: Option<usize>,
    /// `none`, `lz4` or `zstd`.
    compression: Option<String>,
    chunk_bytes: Option<u64>,
    #[serde(default)]
    no_chunks: bool,
    #[serde(default)]
    no_statistics: bool,
    #[serde(default)]
    no_chunk_indexes: bool,
    #[serde(default)]
    no_message_indexes: bool,
    #[serde(default)]
    no_metadata_indexes: bool,
    #[serde(default)]
    no_repeated_channels: bool,
    #[serde(default)]
    no_repeated_schemas: bool,
    #[serde(default)]
    no_summary_offsets: bool,
    #[serde(default)]
    no_summary: bool,
    #[serde(default)]
    no_crcs: bool,
    /// Adds a Metadata record of another name.
    other_metadata: Option<String>,
    /// Adds an attachment.
    attachment: Option<String>,
}

/// Which messages of a topic are changed, and how.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub(crate) struct MessageEdit {
    topic: String,
    /// Which message of the topic; all without it.
    nth: Option<usize>,
    stamp: Option<u64>,
    /// Replaces the data by text.
    text: Option<String>,
    /// Sets a value of a JSON message by pointer.
    set: Option<(String, Value)>,
    /// Cuts the data off after so many bytes.
    cut: Option<usize>,
    /// Writes the message once more.
    #[serde(default)]
    repeat: bool,
    /// Puts the message after all others of the file.
    #[serde(default)]
    last: bool,
    /// Leaves the message out.
    #[serde(default)]
    remove: bool,
    /// Writes the rows of a table's message in two messages, the second from this row on.
    split: Option<usize>,
    /// Puts the rows of the next message into this one.
    #[serde(default)]
    join_next: bool,
}

/// What is different about a channel.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChannelEdit {
    topic: String,
    message_encoding: Option<String>,
    schema_name: Option<String>,
    schema_encoding: Option<String>,
    /// Replaces the schema by text.
    schema_text: Option<String>,
    /// Takes the schema out.
    #[serde(default)]
    no_schema: bool,
    rename: Option<String>,
}

/// A channel that is not of the specification.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewChannel {
    topic: String,
    message_encoding: String,
    schema_name: String,
    schema_encoding: String,
    schema_text: String,
    /// Stamp and text of each message.
    messages: Vec<(u64, String)>,
}

struct Channel {
    topic: String,
    message_encoding: String,
    /// Name, encoding, data.
    schema: Option<(String, String, Vec<u8>)>,
}

struct Message {
    topic: String,
    stamp: u64,
    data: Vec<u8>,
    /// The rows, where it is a table's.
    rows: Vec<Vec<Cell>>,
}

/// The bytes of the file.
pub(crate) fn encode(document: &Document, edits: &[Edit]) -> Result<Vec<u8>> {
    let mut options = Options::default();
    let (mut channels, mut messages) = (Vec::new(), Vec::new());
    lay_out(document, &mut channels, &mut messages)?;
    for edit in edits {
        match edit {
            Edit::Mcap(chosen) => options = chosen.clone(),
            Edit::Message(edit) => edit.apply(document, &mut messages)?,
            Edit::Channel(edit) => edit.apply(&mut channels, &mut messages)?,
            Edit::AddChannel(added) => {
                channels.push(Channel {
                    topic: added.topic.clone(),
                    message_encoding: added.message_encoding.clone(),
                    schema: Some((
                        added.schema_name.clone(),
                        added.schema_encoding.clone(),
                        added.schema_text.clone().into_bytes(),
                    )),
                });
                for (stamp, text) in &added.messages {
                    let data = text.clone().into_bytes();
                    let at = messages.partition_point(|message: &Message| message.stamp <= *stamp);
                    let message =
                        Message { topic: added.topic.clone(), stamp: *stamp, data, rows: Vec::new() };
                    messages.insert(at, message);
                }
            }
            _ => {}
        }
    }
    write(document, &options, &channels, &messages).map_err(|error| format!("MCAP: {error}"))
}

/// Encoder of one table: the serialised schema, and one message for some rows.
fn encoded(document: &Document, table: &Table, rows: Option<&[Vec<Cell>]>) -> Result<Vec<u8>> {
    let version = document.manifest["spec_version"].as_str().unwrap_or("1.0.0");
    let schema = arrays::schema(table, version);
    let failed = |error: arrow::error::ArrowError| format!("{}: {error}", table.name);
    let options = IpcWriteOptions::try_new(8, false, MetadataVersion::V5).map_err(failed)?;
    let mut writer = StreamWriter::try_new_with_options(Vec::new(), &schema, options).map_err(failed)?;
    let Some(rows) = rows else { return Ok(writer.get_ref().clone()) };
    let header = writer.get_ref().len();
    writer.write(&arrays::batch(table, &schema, rows)?).map_err(failed)?;
    Ok(writer.get_ref()[header..].to_vec())
}

/// Channels in the order of the specification, messages in the order of time.
fn lay_out(document: &Document, channels: &mut Vec<Channel>, messages: &mut Vec<Message>) -> Result<()> {
    let stamps = document.stamps();
    let first = stamps.first().map_or(0, |(_, stamp)| *stamp);
    let last = stamps.last().map_or(0, |(_, stamp)| *stamp);
    let json = |name: &str| {
        let schema = json_schema(name).unwrap_or_default().into_bytes();
        Channel {
            topic: format!("/{name}"),
            message_encoding: "json".to_owned(),
            schema: Some((format!("open_structure.{name}"), "jsonschema".to_owned(), schema)),
        }
    };
    channels.push(json("manifest"));
    let text = serde_json::to_string(&document.manifest).map_err(|error| error.to_string())?;
    let data = document.manifest_text.clone().unwrap_or(text).into_bytes();
    messages.push(Message { topic: "/manifest".to_owned(), stamp: first, data, rows: Vec::new() });
    for table in &document.tables {
        let topic = format!("/{}", table.name);
        let name = table.info.map_or(table.name.as_str(), |info| info.record);
        channels.push(Channel {
            topic: topic.clone(),
            message_encoding: "arrow".to_owned(),
            schema: Some((
                format!("open_structure.{name}"),
                "arrow".to_owned(),
                encoded(document, table, None)?,
            )),
        });
        let per_frame = table.info.is_some_and(|info| info.storage == Storage::PerFrame);
        let frame = table.columns.iter().position(|column| column.name == "frame_id").filter(|_| per_frame);
        let runs = table.rows.chunk_by(|left, right| frame.is_none_or(|frame| left[frame] == right[frame]));
        let mut before = first;
        for rows in runs {
            let id = frame.and_then(|frame| rows[0][frame].int());
            let known = stamps.iter().find(|(known, _)| Some(*known) == id).map(|(_, stamp)| *stamp);
            before = known.unwrap_or(before);
            let data = encoded(document, table, Some(rows))?;
            messages.push(Message { topic: topic.clone(), stamp: before, data, rows: rows.to_vec() });
        }
    }
    // Whole tables have the first stamp and stay in front, the sort being stable.
    let place = |message: &Message| {
        let name = message.topic.trim_start_matches('/');
        document
            .table(name)
            .and_then(|table| table.info)
            .is_some_and(|info| info.storage == Storage::PerFrame)
    };
    messages.sort_by_key(|message| (message.stamp, place(message)));
    channels.push(json("table_summaries"));
    for summary in &document.summaries {
        let data = serde_json::to_vec(summary).map_err(|error| error.to_string())?;
        messages.push(Message { topic: "/table_summaries".to_owned(), stamp: last, data, rows: Vec::new() });
    }
    Ok(())
}

impl MessageEdit {
    fn apply(&self, document: &Document, messages: &mut Vec<Message>) -> Result<()> {
        let of_topic = messages.iter().enumerate().filter(|(_, message)| message.topic == self.topic);
        let places: Vec<usize> = of_topic.map(|(place, _)| place).collect();
        let chosen: Vec<usize> = match self.nth {
            Some(nth) => places.get(nth).copied().into_iter().collect(),
            None => places.clone(),
        };
        if chosen.is_empty() {
            return Err(format!("no message {:?} on {}", self.nth, self.topic));
        }
        let table = document.table(self.topic.trim_start_matches('/'));
        let encode = |rows: &[Vec<Cell>]| match table {
            Some(table) => encoded(document, table, Some(rows)),
            None => Err(format!("{} is not the topic of a table", self.topic)),
        };
        for place in chosen.into_iter().rev() {
            let message = &mut messages[place];
            if let Some(stamp) = self.stamp {
                message.stamp = stamp;
            }
            if let Some(text) = &self.text {
                message.data = text.clone().into_bytes();
            }
            if let Some((pointer, value)) = &self.set {
                let mut json = serde_json::from_slice(&message.data).map_err(|error| error.to_string())?;
                super::edit::set(&mut json, pointer, Some(value))?;
                message.data = serde_json::to_vec(&json).map_err(|error| error.to_string())?;
            }
            if let Some(cut) = self.cut {
                message.data.truncate(cut);
            }
            if let Some(row) = self.split {
                let rest = message.rows.split_off(row);
                message.data = encode(&message.rows)?;
                let second = Message {
                    topic: message.topic.clone(),
                    stamp: message.stamp,
                    data: encode(&rest)?,
                    rows: rest,
                };
                messages.insert(place + 1, second);
            } else if self.join_next {
                let next = places.iter().find(|next| **next > place).ok_or("no next message")?;
                let rows = messages.remove(*next).rows;
                messages[place].rows.extend(rows);
                messages[place].data = encode(&messages[place].rows)?;
            } else if self.repeat {
                let copy = Message {
                    topic: message.topic.clone(),
                    stamp: message.stamp,
                    data: message.data.clone(),
                    rows: message.rows.clone(),
                };
                messages.insert(place + 1, copy);
            } else if self.last {
                let message = messages.remove(place);
                messages.push(message);
            } else if self.remove {
                messages.remove(place);
            }
        }
        Ok(())
    }
}

impl ChannelEdit {
    fn apply(&self, channels: &mut [Channel], messages: &mut [Message]) -> Result<()> {
        let channel = channels
            .iter_mut()
            .find(|channel| channel.topic == self.topic)
            .ok_or_else(|| format!("no channel {}", self.topic))?;
        if let Some(encoding) = &self.message_encoding {
            channel.message_encoding.clone_from(encoding);
        }
        if let Some((name, encoding, data)) = &mut channel.schema {
            if let Some(changed) = &self.schema_name {
                name.clone_from(changed);
            }
            if let Some(changed) = &self.schema_encoding {
                encoding.clone_from(changed);
            }
            if let Some(text) = &self.schema_text {
                *data = text.clone().into_bytes();
            }
        }
        if self.no_schema {
            channel.schema = None;
        }
        if let Some(topic) = &self.rename {
            channel.topic.clone_from(topic);
            for message in messages.iter_mut().filter(|message| message.topic == self.topic) {
                message.topic.clone_from(topic);
            }
        }
        Ok(())
    }
}

fn write_options(options: &Options) -> Result<WriteOptions> {
    let compression = match options.compression.as_deref() {
        Some("none") => None,
        Some("lz4") => Some(Compression::Lz4),
        None | Some("zstd") => Some(Compression::Zstd),
        Some(other) => return Err(format!("no compression is called {other}")),
    };
    Ok(WriteOptions::new()
        .profile(options.profile.clone().unwrap_or_default())
        .library("open-structure conformance corpus")
        .compression(compression)
        .compression_threads(0)
        .chunk_size(Some(options.chunk_bytes.unwrap_or(1 << 20)))
        .use_chunks(!options.no_chunks)
        .emit_statistics(!(options.no_statistics || options.no_summary))
        .emit_chunk_indexes(!(options.no_chunk_indexes || options.no_summary))
        .emit_message_indexes(!(options.no_message_indexes || options.no_summary))
        .emit_metadata_indexes(!(options.no_metadata_indexes || options.no_summary))
        .emit_attachment_indexes(!options.no_summary)
        .repeat_channels(!(options.no_repeated_channels || options.no_summary))
        .repeat_schemas(!(options.no_repeated_schemas || options.no_summary))
        .emit_summary_offsets(!(options.no_summary_offsets || options.no_summary))
        .calculate_chunk_crcs(!options.no_crcs)
        .calculate_data_section_crc(!options.no_crcs)
        .calculate_summary_section_crc(!options.no_crcs))
}

fn write(
    document: &Document,
    options: &Options,
    channels: &[Channel],
    messages: &[Message],
) -> Result<Vec<u8>> {
    let failed = |error: mcap::McapError| error.to_string();
    let mut writer = write_options(options)?.create(Cursor::new(Vec::new())).map_err(failed)?;
    let said = |name: &str| document.manifest[name].as_str().unwrap_or_default().to_owned();
    let mut identity = BTreeMap::from(
        [("spec_version", said("spec_version")), ("name", said("name"))].map(|(k, v)| (k.to_owned(), v)),
    );
    for (name, value) in &options.identity {
        match value {
            Some(value) => identity.insert(name.clone(), value.clone()),
            None => identity.remove(name),
        };
    }
    let name = options.identity_name.clone().unwrap_or_else(|| "open-structure".to_owned());
    for _ in 0..options.identity_records.unwrap_or(1) {
        writer
            .write_metadata(&Metadata { name: name.clone(), metadata: identity.clone() })
            .map_err(failed)?;
    }
    if let Some(name) = &options.other_metadata {
        writer.write_metadata(&Metadata { name: name.clone(), metadata: BTreeMap::new() }).map_err(failed)?;
    }
    let mut known = HashMap::new();
    for channel in channels {
        let schema = match &channel.schema {
            Some((name, encoding, data)) => writer.add_schema(name, encoding, data).map_err(failed)?,
            None => 0,
        };
        let id = writer
            .add_channel(schema, &channel.topic, &channel.message_encoding, &BTreeMap::new())
            .map_err(failed)?;
        known.insert(channel.topic.clone(), (id, 0_u32));
    }
    for message in messages {
        let (id, sequence) =
            known.get_mut(&message.topic).ok_or_else(|| format!("no channel {}", message.topic))?;
        let header = MessageHeader {
            channel_id: *id,
            sequence: *sequence,
            log_time: message.stamp,
            publish_time: message.stamp,
        };
        *sequence += 1;
        writer.write_to_known_channel(&header, &message.data).map_err(failed)?;
    }
    if let Some(name) = &options.attachment {
        let attachment = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: name.clone(),
            media_type: "text/plain".to_owned(),
            data: std::borrow::Cow::Borrowed(b"attached"),
        };
        writer.attach(&attachment).map_err(failed)?;
    }
    writer.finish().map_err(failed)?;
    Ok(writer.into_inner().into_inner())
}
