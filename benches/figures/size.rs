//! How many bytes the published columns take.

use std::fs;
use std::path::Path;

use anyhow::{Result, ensure};
use open_structure::format::{self, WriteOptions};

use crate::data::{Published, published, synthetic};
use crate::figure::{Bound, Figures};

/// Both tables of each published file against a zip of the same lines.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let files = published()?;
    if files.is_empty() {
        eprintln!("SKIPPED: sizes of the published sequences, which are not here (see OPEN_STRUCTURE_DATA)");
    }
    for (index, file) in files.iter().enumerate() {
        let path = folder.path().join(index.to_string());
        let ours = written_bytes(file, &path)? as f64;
        figures.add(
            format!("size of {}: Parquet over zip", file.name),
            ours / file.zipped_bytes()? as f64,
            "",
            Bound::AtMost(0.9),
        );
    }
    let noisy = synthetic(200, 5000);
    let path = folder.path().join("noisy");
    format::write(&path, &noisy, WriteOptions::default())?;
    let bytes = fs::metadata(path.join("point_measurements.parquet"))?.len() as f64;
    // Two ids, three numbers.
    let plain = noisy.point_measurements.len() as f64 * 40.0;
    figures.add(
        "size of numbers with noise in every digit: Parquet over plain",
        bytes / plain,
        "",
        Bound::None,
    );
    Ok(())
}

/// Bytes of the two tables' files, footers and all, after a check that every number came back.
fn written_bytes(file: &Published, path: &Path) -> Result<u64> {
    let sequence = file.sequence();
    format::write(path, &sequence, WriteOptions::default())?;
    let back = format::read(path)?;
    ensure!(back.point_measurements == sequence.point_measurements, "{}: other points come back", file.name);
    ensure!(back.line_measurements == sequence.line_measurements, "{}: other lines come back", file.name);
    let mut bytes = 0;
    for table in ["point_measurements", "line_measurements"] {
        let file = path.join(format!("{table}.parquet"));
        bytes += if file.exists() { fs::metadata(file)?.len() } else { 0 };
    }
    Ok(bytes)
}
