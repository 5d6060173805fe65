//! A sequence of fifty million measurements: memory while it is written, bytes that one of its frames costs.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use open_structure::format::{self, FrameRows, SequenceWriter, WriteOptions};
use open_structure::structure::{FrameId, Manifest};

use crate::data::{frame, synthetic_frame};
use crate::figure::{Bound, Figures};

/// Measurements of each frame.
const POINTS: i64 = 5000;
/// Set for the child process that writes: where to.
const CHILD: &str = "OPEN_STRUCTURE_BENCH_CHILD";
/// Number of frames, where it is to be another than 10 000.
const FRAMES: &str = "OPEN_STRUCTURE_BENCH_FRAMES";

fn frames() -> Result<i64> {
    match env::var(FRAMES) {
        Ok(frames) => frames.parse().with_context(|| format!("{FRAMES} is {frames}")),
        Err(_) => Ok(10_000),
    }
}

/// Whether this process is to write and nothing else.
pub(crate) fn is_child() -> bool {
    env::var_os(CHILD).is_some()
}

/// Writes the sequence, and prints the process's greatest resident memory in KiB.
pub(crate) fn write_as_child() -> Result<()> {
    let path = PathBuf::from(env::var_os(CHILD).context("no output")?);
    let list: Vec<_> = (0..frames()?).map(|id| frame(FrameId(id))).collect();
    let manifest = Manifest { name: "synthetic".to_owned(), ..Manifest::default() };
    let mut writer = SequenceWriter::create(&path, &manifest, &list, WriteOptions::default())?;
    let mut rows = Vec::new();
    for frame in &list {
        synthetic_frame(frame.frame_id, POINTS, &mut rows);
        writer
            .append_frame(frame.frame_id, FrameRows { point_measurements: &rows, ..FrameRows::default() })?;
    }
    writer.finish()?;
    let status = fs::read_to_string("/proc/self/status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).context("no VmHWM")?;
    println!("{}", peak.trim().trim_end_matches(" kB"));
    Ok(())
}

/// Writes in a child process, then reads one frame from the middle.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let frames = frames()?;
    let rows = frames as f64 * POINTS as f64 / 1e6;
    for encoding in ["parquet", "mcap"] {
        let path = folder.path().join(format!("synthetic.{encoding}"));
        let start = Instant::now();
        let output = Command::new(env::current_exe()?).env(CHILD, &path).output()?;
        let seconds = start.elapsed().as_secs_f64();
        ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let peak: f64 = String::from_utf8(output.stdout)?.trim().parse()?;
        let what = format!("{rows} million measurements, {encoding}");
        figures.add(format!("writing {what}: resident memory"), peak / 1024.0, "MiB", Bound::AtMost(512.0));
        figures.add(format!("writing {what}: speed"), rows / seconds, "million rows/s", Bound::None);
        let total = bytes_of(&path)? as f64;
        figures.add(format!("writing {what}: bytes a row"), total / rows / 1e6, "B", Bound::None);

        let start = Instant::now();
        let reader = format::open(&path)?;
        let bundle = reader.frame(FrameId(frames / 2))?.context("the frame is not there")?;
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let mut expected = Vec::new();
        synthetic_frame(FrameId(frames / 2), POINTS, &mut expected);
        ensure!(bundle.point_measurements == expected, "other rows come back");
        let touched = reader.bytes_read() as f64 / total * 100.0;
        figures.add(format!("one frame of {what}: bytes touched"), touched, "%", Bound::AtMost(1.0));
        figures.add(format!("one frame of {what}: opening and reading"), milliseconds, "ms", Bound::None);
    }
    Ok(())
}

fn bytes_of(path: &Path) -> Result<u64> {
    if !path.is_dir() {
        return Ok(fs::metadata(path)?.len());
    }
    let mut bytes = 0;
    for entry in fs::read_dir(path)? {
        bytes += entry?.metadata()?.len();
    }
    Ok(bytes)
}
