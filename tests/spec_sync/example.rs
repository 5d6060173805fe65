//! The worked example of the specification: a tiny sequence, byte by byte.

use std::fmt::Write as _;
use std::fs;

use arrow::ipc::root_as_message;
use mcap::records::op;
use open_structure::format::{self, WriteOptions, json_schema};
use open_structure::structure::*;

/// The sequence: one frame that measures one point.
fn tiny() -> Sequence {
    let mut sequence = Sequence::default();
    "tiny".clone_into(&mut sequence.manifest.name);
    registry::SIMULATION.clone_into(&mut sequence.manifest.source.dataset);
    "by hand".clone_into(&mut sequence.manifest.generator.tool);
    "1".clone_into(&mut sequence.manifest.generator.version);
    let camera = open_structure::geometry::PinholeCamera {
        fx: 500.0,
        fy: 500.0,
        cx: 319.5,
        cy: 239.5,
        width: 640,
        height: 480,
    };
    sequence.manifest.cameras = vec![Camera::pinhole(CameraId(0), &camera, registry::PIXEL_CENTER)];
    sequence.frames = vec![Frame::new(FrameId(3), 1_000_000_000, CameraId(0), None)];
    sequence.point_measurements = vec![PointMeasurement {
        frame_id: FrameId(3),
        point_id: PointId(7),
        u: 12.5,
        v: 80.25,
        depth: Some(2.0),
    }];
    sequence
}

/// The bytes of the sequence as an MCAP file.
fn tiny_mcap() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tiny.mcap");
    format::write(&path, &tiny(), WriteOptions::default()).unwrap();
    fs::read(path).unwrap()
}

/// A part of the example, by the name in its marker.
pub(crate) fn part(name: &str) -> Option<String> {
    let text = match name {
        "manifest" => pretty(&tiny_manifest()),
        "row" => pretty(&serde_json::to_string(&tiny().point_measurements[0]).unwrap()),
        "digest" => return Some(digest()),
        "records" => return Some(records(&tiny_mcap())),
        "head" => head(&tiny_mcap()),
        "message" => message(&tiny_mcap()),
        _ => return None,
    };
    Some(text)
}

fn pretty(json: &str) -> String {
    let value: crate::ordered::Ordered = serde_json::from_str(json).unwrap();
    format!("```json\n{}\n```", json_lines(&value, 0))
}

/// JSON over several lines, members in the order of the text.
fn json_lines(value: &crate::ordered::Ordered, depth: usize) -> String {
    use crate::ordered::Ordered;
    let indent = "  ".repeat(depth + 1);
    let close = "  ".repeat(depth);
    match value {
        Ordered::Plain(value) => value.to_string(),
        Ordered::Object(members) if !members.is_empty() => {
            let lines: Vec<_> = members
                .iter()
                .map(|(name, value)| format!("{indent}\"{name}\": {}", json_lines(value, depth + 1)))
                .collect();
            format!("{{\n{}\n{close}}}", lines.join(",\n"))
        }
        Ordered::Array(values) if !values.is_empty() => {
            let lines: Vec<_> =
                values.iter().map(|value| format!("{indent}{}", json_lines(value, depth + 1))).collect();
            format!("[\n{}\n{close}]", lines.join(",\n"))
        }
        Ordered::Object(_) => "{}".to_owned(),
        Ordered::Array(_) => "[]".to_owned(),
    }
}

/// The JSON of the message on `/manifest`.
fn tiny_manifest() -> String {
    let bytes = tiny_mcap();
    let message = messages(&bytes).into_iter().find(|(topic, _)| topic == "/manifest").unwrap();
    String::from_utf8(message.1).unwrap()
}

/// Topic and data of every message.
fn messages(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    mcap::MessageStream::new(bytes)
        .unwrap()
        .map(|message| {
            let message = message.unwrap();
            (message.channel.topic.clone(), message.data.into_owned())
        })
        .collect()
}

/// Bytes as pairs of digits.
fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

/// Lines of a dump: place, bytes, meaning.
#[derive(Default)]
struct Dump {
    offset: usize,
    text: String,
}

impl Dump {
    /// Adds some bytes; long runs take several lines, the meaning stands in the first.
    fn add(&mut self, bytes: &[u8], meaning: &str) {
        for (index, line) in bytes.chunks(16).enumerate() {
            let meaning = if index == 0 { meaning } else { "" };
            let line_text = format!("{:06x}  {:<47}  {meaning}", self.offset, digits(line));
            let _ = writeln!(self.text, "{}", line_text.trim_end());
            self.offset += line.len();
        }
    }

    fn fenced(&self) -> String {
        format!("```text\n{:6}  {:47}  meaning\n{}```", "offset", "bytes", self.text)
    }
}

fn number(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().unwrap())
}

/// The canonical bytes of the table's one row, and its digest.
fn digest() -> String {
    let rows = tiny().point_measurements;
    let mut bytes = Vec::new();
    rows[0].digest(&mut bytes);
    let mut dump = Dump::default();
    let row = &rows[0];
    let parts: [(usize, String); 6] = [
        (8, format!("frame_id = {}", row.frame_id.0)),
        (8, format!("point_id = {}", row.point_id.0)),
        (8, format!("u = {}", row.u)),
        (8, format!("v = {}", row.v)),
        (1, "depth is present".to_owned()),
        (8, format!("depth = {}", row.depth.unwrap())),
    ];
    let mut rest = bytes.as_slice();
    for (length, meaning) in parts {
        let (field, after) = rest.split_at(length);
        dump.add(field, &meaning);
        rest = after;
    }
    assert!(rest.is_empty(), "a column of point_measurements is not in the example");
    let mut digest = ContentDigest::default();
    digest.update(&rows);
    format!(
        "{}\n\nSHA-256 of these {} bytes:\n\n```text\n{}\n```",
        dump.fenced(),
        bytes.len(),
        digest.finish()
    )
}

fn opcode(byte: u8) -> &'static str {
    match byte {
        op::HEADER => "Header",
        op::FOOTER => "Footer",
        op::SCHEMA => "Schema",
        op::CHANNEL => "Channel",
        op::MESSAGE => "Message",
        op::CHUNK => "Chunk",
        op::MESSAGE_INDEX => "Message Index",
        op::CHUNK_INDEX => "Chunk Index",
        op::STATISTICS => "Statistics",
        op::METADATA => "Metadata",
        op::METADATA_INDEX => "Metadata Index",
        op::SUMMARY_OFFSET => "Summary Offset",
        op::DATA_END => "Data End",
        _ => panic!("a record of opcode {byte} is not in the example"),
    }
}

/// Records of a file: place, opcode and body.
fn walk(bytes: &[u8]) -> Vec<(usize, u8, &[u8])> {
    let mut records = Vec::new();
    let mut offset = mcap::MAGIC.len();
    while offset < bytes.len() - mcap::MAGIC.len() {
        let length = usize::try_from(number(&bytes[offset + 1..offset + 9])).unwrap();
        records.push((offset, bytes[offset], &bytes[offset + 9..offset + 9 + length]));
        offset += 9 + length;
    }
    records
}

/// The records of the file, one line for each run of the same kind.
fn records(bytes: &[u8]) -> String {
    let mut text = "| from byte | record | how many |\n|--:|---|--:|\n| 0 | magic | 1 |\n".to_owned();
    for run in walk(bytes).chunk_by(|left, right| left.1 == right.1) {
        let _ = writeln!(text, "| {} | {} | {} |", run[0].0, opcode(run[0].1), run.len());
    }
    let _ = writeln!(text, "| {} | magic | 1 |", bytes.len() - mcap::MAGIC.len());
    let topics: Vec<String> = messages(bytes).into_iter().map(|(topic, _)| format!("`{topic}`")).collect();
    format!(
        "{text}\nThe chunk holds schemas, channels, and these messages, in this order: {}.",
        topics.join(", ")
    )
}

/// Magic, header and identity.
fn head(bytes: &[u8]) -> String {
    let mut dump = Dump::default();
    dump.add(&bytes[..8], "magic");
    for (offset, kind, body) in walk(bytes) {
        if kind != op::HEADER && kind != op::METADATA {
            break;
        }
        dump.add(&bytes[offset..=offset], &format!("{} record", opcode(kind)));
        dump.add(&bytes[offset + 1..offset + 9], &format!("its body has {} bytes", body.len()));
        let mut rest = body;
        let mut string = |dump: &mut Dump, what: &str| {
            let length = usize::try_from(u32::from_le_bytes(rest[..4].try_into().unwrap())).unwrap();
            dump.add(&rest[..4], &format!("{what}: {length} bytes"));
            let text = String::from_utf8(rest[4..4 + length].to_vec()).unwrap();
            dump.add(&rest[4..4 + length], &format!("\"{text}\""));
            rest = &rest[4 + length..];
        };
        if kind == op::HEADER {
            string(&mut dump, "profile");
            string(&mut dump, "library");
        } else {
            string(&mut dump, "name");
            dump.add(&rest[..4], &format!("map of {} bytes", rest.len() - 4));
            rest = &rest[4..];
            let mut string = |dump: &mut Dump, what: &str| {
                let length = usize::try_from(u32::from_le_bytes(rest[..4].try_into().unwrap())).unwrap();
                dump.add(&rest[..4], &format!("{what}: {length} bytes"));
                let text = String::from_utf8(rest[4..4 + length].to_vec()).unwrap();
                dump.add(&rest[4..4 + length], &format!("\"{text}\""));
                rest = &rest[4 + length..];
                rest.is_empty()
            };
            while !{
                string(&mut dump, "key");
                string(&mut dump, "value")
            } {}
        }
    }
    dump.fenced()
}

/// The message on `/point_measurements`.
fn message(bytes: &[u8]) -> String {
    let (_, data) = messages(bytes).into_iter().find(|(topic, _)| topic == "/point_measurements").unwrap();
    let mut dump = Dump::default();
    dump.add(&data[..4], "continuation");
    let length = usize::try_from(u32::from_le_bytes(data[4..8].try_into().unwrap())).unwrap();
    dump.add(&data[4..8], &format!("the header has {length} bytes"));
    let header = &data[8..8 + length];
    let message = root_as_message(header).unwrap();
    let batch = message.header_as_record_batch().unwrap();
    let nodes = batch.nodes().unwrap();
    let buffers = batch.buffers().unwrap();
    dump.add(header, &format!("flatbuffer: record batch, {} row, {} columns", batch.length(), nodes.len()));
    let body = &data[8 + length..];
    let fields = PointMeasurement::TABLE.fields;
    assert_eq!((nodes.len(), buffers.len()), (fields.len(), 2 * fields.len()));
    let mut at = 0;
    for (index, buffer) in buffers.iter().enumerate() {
        let (start, length) =
            (usize::try_from(buffer.offset()).unwrap(), usize::try_from(buffer.length()).unwrap());
        if start > at {
            dump.add(&body[at..start], "padding");
        }
        let what = if index % 2 == 0 { "validity" } else { "values" };
        dump.add(&body[start..start + length], &format!("{}: {what}", fields[index / 2].name));
        at = start + length;
    }
    if at < body.len() {
        dump.add(&body[at..], "padding");
    }
    assert_eq!(dump.offset, data.len());
    dump.fenced()
}

#[test]
fn the_example_is_a_sequence_like_any_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tiny.mcap");
    fs::write(&path, tiny_mcap()).unwrap();
    let back = format::read(&path).unwrap();
    assert_eq!(back.point_measurements, tiny().point_measurements);
    assert_eq!(back.frames, tiny().frames);
    let manifest: serde_json::Value = serde_json::from_str(&tiny_manifest()).unwrap();
    let schema = serde_json::from_str(&json_schema("manifest").unwrap()).unwrap();
    assert!(jsonschema::draft202012::is_valid(&schema, &manifest));
}

#[test]
fn the_example_has_the_same_bytes_whenever_it_is_written() {
    assert_eq!(tiny_mcap(), tiny_mcap());
}

#[test]
fn a_copy_by_way_of_parquet_has_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let [first, parquet, second] =
        ["first.mcap", "parquet", "second.mcap"].map(|name| folder.path().join(name));
    format::write(&first, &crate::sample::sample(), WriteOptions::default()).unwrap();
    for (from, to) in [(&first, &parquet), (&parquet, &second)] {
        format::copy(&format::open(from).unwrap(), to, WriteOptions::default(), &|_, _| {}).unwrap();
    }
    assert!(fs::read(first).unwrap() == fs::read(second).unwrap(), "the bytes differ");
}
