//! How fast every frame of an MCAP file comes, against the same frames as JSON messages in the plain reader's hands.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Result, ensure};
use mcap::{Compression, MessageStream, WriteOptions as McapOptions};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{FrameId, PointMeasurement};

use crate::data::synthetic;
use crate::figure::{Bound, Figures, median_ratio, median_time};

const RUNS: usize = 5;
const FRAMES: i64 = 200;
const POINTS: i64 = 500;

/// Iterates the frames of a sequence, and the messages of a file with the same rows.
///
/// The peer is what one writes without us: `mcap::MessageStream` over the file's bytes, and a message a frame that
/// `serde_json::from_slice` turns into a vector of the very same row type.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let sequence = synthetic(FRAMES, POINTS);
    let (ours, json) = (folder.path().join("ours.mcap"), folder.path().join("json.mcap"));
    format::write(&ours, &sequence, WriteOptions::default())?;
    let rows = &sequence.point_measurements;
    write_json(&json, rows)?;

    let frames = || -> Result<Vec<PointMeasurement>> {
        let mut rows = Vec::new();
        for frame in format::open(&ours)?.frames()? {
            rows.append(&mut frame?.point_measurements);
        }
        Ok(rows)
    };
    let messages = || -> Result<Vec<PointMeasurement>> {
        let mut rows = Vec::new();
        for message in MessageStream::new(&fs::read(&json)?)? {
            rows.append(&mut serde_json::from_slice(&message?.data)?);
        }
        Ok(rows)
    };
    ensure!(frames()? == *rows && messages()? == *rows, "other rows come back");
    let speed = |time: std::time::Duration| FRAMES as f64 / time.as_secs_f64();
    let what = format!("{FRAMES} frames of {POINTS} points");
    figures.add(format!("MCAP, {what}"), speed(median_time(RUNS, frames)), "frames/s", Bound::None);
    figures.add(
        format!("mcap::MessageStream and serde_json, {what}"),
        speed(median_time(RUNS, messages)),
        "frames/s",
        Bound::None,
    );
    let ratio = median_ratio(RUNS, frames, messages);
    figures.add("time of MCAP's frames over that of JSON messages", ratio, "times", Bound::AtMost(1.5));
    Ok(())
}

/// A message for each frame: its rows as a JSON array, in chunks compressed as ours are.
fn write_json(path: &Path, rows: &[PointMeasurement]) -> Result<()> {
    let mut writer =
        McapOptions::new().compression(Some(Compression::Zstd)).create(fs::File::create(path)?)?;
    let channel = writer.add_channel(0, "/point_measurements", "json", &BTreeMap::new())?;
    let mut frames: BTreeMap<FrameId, Vec<&PointMeasurement>> = BTreeMap::new();
    for row in rows {
        frames.entry(row.frame_id).or_default().push(row);
    }
    for (sequence, (frame_id, rows)) in (0..).zip(frames) {
        let log_time = u64::try_from(frame_id.0)? * 33_333_333;
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &serde_json::to_vec(&rows)?)?;
    }
    writer.finish()?;
    Ok(())
}
