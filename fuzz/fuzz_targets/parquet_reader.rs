//! Any bytes as one Parquet file of an otherwise good folder; the first byte says of which table.

#![no_main]

mod use_all;

use std::fs;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use open_structure::format::{WriteOptions, write};
use open_structure::structure::{CameraId, Frame, FrameId, Sequence};
use tempfile::TempDir;

/// Tables with numbers and nulls, with texts and lists, with bytes, with truth values.
const TABLES: [&str; 5] = ["frames", "point_measurements", "graph_factors", "point_landmarks", "graph_poses"];

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = TempDir::new().expect("a temporary folder");
    let frames = (0..3).map(|id| Frame::new(FrameId(id), id * 1000, CameraId(0), None)).collect();
    let sequence = Sequence { frames, ..Sequence::default() };
    write(&folder.path().join("good"), &sequence, WriteOptions::default()).expect("a good folder");
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let Some((first, bytes)) = bytes.split_first() else { return };
    let good = FOLDER.path().join("good");
    let folder = FOLDER.path().join("input");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir(&folder).expect("room for the input");
    for name in ["sequence.json", "frames.parquet"] {
        fs::copy(good.join(name), folder.join(name)).expect("room for the input");
    }
    let table = TABLES[usize::from(*first) % TABLES.len()];
    fs::write(folder.join(format!("{table}.parquet")), bytes).expect("room for the input");
    use_all::use_all(&folder);
});
