//! Sequences that the benchmarks read and write: the published ones, and synthetic ones of any size.

use std::fs::File;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use open_structure::structure::{
    CameraId, Frame, FrameId, LineId, LineMeasurement, Manifest, PointId, PointMeasurement, Sequence,
};
use open_structure_converters::text_release::{FileProblems, Rows, parse};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// One published file of observations.
pub(crate) struct Published {
    /// Sequence and file.
    pub(crate) name: String,
    /// The lines of observations alone.
    pub(crate) text: Vec<u8>,
}

impl Published {
    /// Reads the association file of `observation.zip` or the graph of `baseline.zip`.
    pub(crate) fn read(folder: &Path, archive: &str, file: &str) -> Result<Self> {
        let path = folder.join(archive);
        let opened = File::open(&path).with_context(|| path.display().to_string())?;
        let mut archive = ZipArchive::new(opened)?;
        let index = (0..archive.len())
            .find(|index| {
                archive.name_for_index(*index).is_some_and(|name| name.is_ok_and(|name| name.ends_with(file)))
            })
            .with_context(|| format!("no {file} in {}", path.display()))?;
        let mut whole = Vec::new();
        archive.by_index(index)?.read_to_end(&mut whole)?;
        let is_observation =
            |line: &&[u8]| line.starts_with(b"MappointFrameAsso") || line.starts_with(b"MaplineFrameAsso");
        let text =
            whole.split_inclusive(|byte| *byte == b'\n').filter(is_observation).collect::<Vec<_>>().concat();
        let sequence = folder.file_name().unwrap_or_default().to_string_lossy();
        Ok(Self { name: format!("{sequence}/{file}"), text })
    }

    /// The rows, as the project's own parser reads them.
    pub(crate) fn parse(&self) -> Rows {
        parse(&self.text, None, &mut FileProblems::new(&self.name))
    }

    /// Bytes that a zip archive needs for the same lines.
    pub(crate) fn zipped_bytes(&self) -> Result<u64> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        writer.start_file("association.txt", options)?;
        writer.write_all(&self.text)?;
        let mut archive = ZipArchive::new(writer.finish()?)?;
        Ok(archive.by_index_raw(0)?.compressed_size())
    }

    /// The same rows as a sequence of measurements.
    pub(crate) fn sequence(&self) -> Sequence {
        let rows = self.parse();
        let mut sequence = Sequence {
            manifest: Manifest { name: self.name.clone(), ..Manifest::default() },
            ..Sequence::default()
        };
        for row in &rows.point_observations {
            sequence.point_measurements.push(PointMeasurement {
                frame_id: FrameId(row.frame),
                point_id: PointId(row.point),
                u: row.u,
                v: row.v,
                depth: None,
            });
        }
        for row in &rows.line_observations {
            let ([start_u, start_v, start_depth], [end_u, end_v, end_depth]) = (row.start, row.end);
            sequence.line_measurements.push(LineMeasurement {
                frame_id: FrameId(row.frame),
                line_id: LineId(row.line),
                start_u,
                start_v,
                start_depth: Some(start_depth),
                end_u,
                end_v,
                end_depth: Some(end_depth),
            });
        }
        let mut ids: Vec<FrameId> = sequence.point_measurements.iter().map(|row| row.frame_id).collect();
        ids.extend(sequence.line_measurements.iter().map(|row| row.frame_id));
        ids.sort_unstable();
        ids.dedup();
        sequence.frames = ids.into_iter().map(frame).collect();
        sequence.sort();
        sequence.point_measurements.dedup_by_key(|row| (row.frame_id, row.point_id));
        sequence.line_measurements.dedup_by_key(|row| (row.frame_id, row.line_id));
        sequence
    }
}

/// Where the published sequences lie, if they are here.
pub(crate) fn published_folder() -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    Some(data.join("open-structure")).filter(|folder| folder.is_dir())
}

/// Every published file of observations, by sequence.
pub(crate) fn published() -> Result<Vec<Published>> {
    let Some(folder) = published_folder() else { return Ok(Vec::new()) };
    let mut sequences: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    sequences.sort();
    let mut files = Vec::new();
    for sequence in sequences.iter().filter(|path| path.is_dir()) {
        for (archive, file) in
            [("observation.zip", "association.txt"), ("baseline.zip", "venom_sequence.txt")]
        {
            if sequence.join(archive).is_file() {
                files.push(Published::read(sequence, archive, file)?);
            }
        }
    }
    Ok(files)
}

/// A frame of a camera at 30 Hz.
pub(crate) fn frame(frame_id: FrameId) -> Frame {
    Frame::new(frame_id, frame_id.0 * 33_333_333, CameraId(0), None)
}

/// Draws numbers in `[0, 1)`: splitmix64, so that every run measures the same bytes.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    /// The next number.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }
}

/// The measurements of one frame of a synthetic sequence: `points` landmarks in view, which drift through
/// the image as frames go by; positions and depths have noise in every digit.
pub(crate) fn synthetic_frame(frame_id: FrameId, points: i64, rows: &mut Vec<PointMeasurement>) {
    let mut draw = Draw(frame_id.0.cast_unsigned());
    rows.clear();
    rows.extend((0..points).map(|place| {
        // A landmark stays for about 100 frames.
        let point = frame_id.0 * points / 100 + place;
        let mut at = Draw(point.cast_unsigned() ^ 0x5eed);
        let noise = |draw: &mut Draw| draw.next() + draw.next() + draw.next() + draw.next() - 2.0;
        let drift = frame_id.0 as f64 * 0.37 + noise(&mut draw);
        PointMeasurement {
            frame_id,
            point_id: PointId(point),
            u: (at.next() * 640.0 + drift).rem_euclid(640.0),
            v: at.next() * 480.0 + noise(&mut draw),
            depth: (place % 16 != 0).then(|| 1.0 + at.next() * 8.0 + 0.05 * noise(&mut draw)),
        }
    }));
}

/// A synthetic sequence in memory.
pub(crate) fn synthetic(frames: i64, points: i64) -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "synthetic".to_owned();
    let mut rows = Vec::new();
    for frame_id in (0..frames).map(FrameId) {
        sequence.frames.push(frame(frame_id));
        synthetic_frame(frame_id, points, &mut rows);
        sequence.point_measurements.append(&mut rows);
    }
    sequence
}
