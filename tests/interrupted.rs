//! A program that is killed while it writes leaves nothing under the final name, and nothing in the way.

#![cfg(unix)]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use open_structure::format::{self, FrameRows, SequenceWriter, WriteOptions};
use open_structure::structure::{CameraId, Frame, FrameId, Manifest, PointId, PointMeasurement};

/// Says to the child where to write.
const OUTPUT: &str = "OPEN_STRUCTURE_TEST_OUTPUT";
/// Frames of the child's sequence: more than it will ever get to write.
const FRAMES: i64 = 1_000_000;

fn write(path: &Path, frames: i64) -> Result<(), format::Error> {
    let list: Vec<Frame> =
        (0..frames).map(|id| Frame::new(FrameId(id), id * 1000, CameraId(0), None)).collect();
    let mut writer = SequenceWriter::create(path, &Manifest::default(), &list, WriteOptions::default())?;
    for frame in &list {
        let frame_id = frame.frame_id;
        let rows: Vec<_> = (0..500_u32)
            .map(|point| {
                // Digits that do not compress, so that the file grows.
                let noise = f64::from(point.wrapping_mul(2_654_435_761) ^ (frame_id.0 as u32) << 7).sqrt();
                PointMeasurement {
                    frame_id,
                    point_id: PointId(i64::from(point)),
                    u: noise,
                    v: -noise,
                    depth: None,
                }
            })
            .collect();
        writer.append_frame(frame_id, FrameRows { point_measurements: &rows, ..FrameRows::default() })?;
    }
    writer.finish()?;
    Ok(())
}

/// Not a test: what the child process does until it is killed.
#[test]
fn child() {
    if let Some(output) = env::var_os(OUTPUT) {
        write(Path::new(&output), FRAMES).unwrap();
    }
}

fn size_of(path: &Path) -> u64 {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => fs::read_dir(path)
            .map(|entries| {
                entries.flatten().map(|entry| entry.metadata().map_or(0, |found| found.len())).sum()
            })
            .unwrap_or(0),
        Ok(found) => found.len(),
        Err(_) => 0,
    }
}

/// Starts a child that writes, and waits until it is well under way.
fn child_under_way(output: &Path) -> (Child, PathBuf) {
    let mut child = Command::new(env::current_exe().unwrap())
        .args(["--exact", "child", "--test-threads=1"])
        .env(OUTPUT, output)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let name = output.file_name().unwrap().to_string_lossy();
    let partial = output.with_file_name(format!(".{name}.{}.partial", child.id()));
    let start = Instant::now();
    while size_of(&partial) < 1 << 20 {
        assert!(child.try_wait().unwrap().is_none(), "the child ended by itself");
        assert!(start.elapsed() < Duration::from_secs(120), "the child writes nothing");
        sleep(Duration::from_millis(5));
    }
    (child, partial)
}

#[test]
fn killing_a_writer_leaves_nothing_under_the_final_name() {
    for name in ["sequence.mcap", "sequence"] {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join(name);
        let (mut child, partial) = child_under_way(&output);
        assert!(output.symlink_metadata().is_err(), "{name} has its final name before it is whole");
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(output.symlink_metadata().is_err(), "{name} is there though its writer was killed");
        assert!(partial.exists(), "{name} was not written beside its final name");
        assert!(format::open(&partial).is_err(), "{name}: half a sequence opens as if it were whole");

        // What the killed one left is not in the way of the next.
        write(&output, 3).unwrap();
        assert_eq!(format::open(&output).unwrap().frames().unwrap().count(), 3);
    }
}

/// Process ids come again: the name may be taken by what another process with this id has left.
#[test]
fn what_a_killed_process_of_the_same_id_left_is_replaced() {
    for name in ["sequence.mcap", "sequence"] {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join(name);
        let left = folder.path().join(format!(".{name}.{}.partial", std::process::id()));
        if name.contains('.') {
            fs::write(&left, vec![7; 1 << 16]).unwrap();
        } else {
            fs::create_dir(&left).unwrap();
            fs::write(left.join("line_measurements.parquet"), "PAR1").unwrap();
        }
        write(&output, 2).unwrap();
        let reader = format::open(&output).unwrap();
        assert_eq!(reader.table::<PointMeasurement>().unwrap().len(), 1000);
        assert_eq!(reader.tables().len(), 2, "a table of the other process came along");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something is left beside the output");
    }
}

#[test]
fn an_output_that_is_there_stays_until_its_successor_is_whole() {
    for name in ["sequence.mcap", "sequence"] {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join(name);
        write(&output, 2).unwrap();
        let options = WriteOptions { force: true, ..WriteOptions::default() };
        let frames = [Frame::new(FrameId(0), 0, CameraId(0), None)];
        let writer = SequenceWriter::create(&output, &Manifest::default(), &frames, options.clone()).unwrap();
        assert_eq!(format::open(&output).unwrap().frames().unwrap().count(), 2);
        drop(writer);
        assert_eq!(format::open(&output).unwrap().frames().unwrap().count(), 2);
        SequenceWriter::create(&output, &Manifest::default(), &frames, options).unwrap().finish().unwrap();
        assert_eq!(format::open(&output).unwrap().frames().unwrap().count(), 1);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
