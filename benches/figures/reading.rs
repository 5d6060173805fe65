//! How fast measurements come into memory.

use std::path::Path;

use anyhow::{Result, ensure};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{LineMeasurement, PointMeasurement, Sequence};

use crate::data::{Published, published_folder, synthetic};
use crate::figure::{Bound, Figures, median_ratio, median_time};

const RUNS: usize = 15;

/// Reading rows on one core, from noisy numbers and from the digits of a published sequence.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let noisy = synthetic(800, 5000);
    points(figures, "noisy", &noisy, folder.path())?;
    drop(noisy);
    match published_folder() {
        Some(published) => {
            let file = Published::read(&published.join("office3"), "observation.zip", "association.txt")?;
            points(figures, "office3", &file.sequence(), folder.path())?;
            against_text(figures, &file, folder.path())
        }
        None => {
            eprintln!("SKIPPED: reading office3, which is not here (see OPEN_STRUCTURE_DATA)");
            Ok(())
        }
    }
}

/// Opens a sequence and reads its point measurements.
fn points(figures: &mut Figures, name: &str, sequence: &Sequence, folder: &Path) -> Result<()> {
    for encoding in ["parquet", "mcap"] {
        let path = folder.join(format!("{name}.{encoding}"));
        format::write(&path, sequence, WriteOptions::default())?;
        let read = || format::open(&path)?.table::<PointMeasurement>();
        ensure!(read()? == sequence.point_measurements, "{}: other rows come back", path.display());
        let time = one_core(|| median_time(RUNS, read))?;
        let speed = sequence.point_measurements.len() as f64 / time.as_secs_f64() / 1e6;
        let bound = if encoding == "parquet" { Bound::AtLeast(10.0) } else { Bound::None };
        figures.add(format!("reading {name}, {encoding}, one core"), speed, "million rows/s", bound);
    }
    Ok(())
}

/// The same rows from the text that was published and from Parquet, in the same run.
fn against_text(figures: &mut Figures, file: &Published, folder: &Path) -> Result<()> {
    let path = folder.join("office3.parquet");
    let read = || {
        let reader = format::open(&path)?;
        Ok::<_, format::Error>((reader.table::<PointMeasurement>()?, reader.table::<LineMeasurement>()?))
    };
    let rows = file.parse();
    let rows = (rows.point_observations.len() + rows.line_observations.len()) as f64;
    let text = one_core(|| median_time(RUNS, || file.parse()))?;
    figures.add(
        "parsing the text of office3, in memory",
        rows / text.as_secs_f64() / 1e6,
        "million rows/s",
        Bound::None,
    );
    let ratio = one_core(|| median_ratio(RUNS, || file.parse(), read))?;
    figures.add(
        "reading office3's points and lines: Parquet on disk over text in memory",
        ratio,
        "times",
        Bound::AtLeast(3.0),
    );
    Ok(())
}

/// Runs with one thread, whatever the machine has.
pub(crate) fn one_core<T: Send>(run: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(run))
}
