//! How many frames a second the tracker takes.

use anyhow::Result;
use open_structure::format::{self, WriteOptions};
use open_structure::structure::MeasuredFrame;
use open_structure_converters::release;
use open_structure_converters::text_release::{Limits, discover, read};

use crate::data::published_folder;
use crate::figure::{Bound, Figures, median_time};
use crate::simulated::tracked;

const RUNS: usize = 3;

/// Tracks office3 of the first release by default options: from memory, and from the Parquet folder.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let Some(published) = published_folder() else {
        eprintln!("SKIPPED: tracking office3, which is not here (see OPEN_STRUCTURE_DATA)");
        return Ok(());
    };
    let limits = Limits::default();
    let text = read(&discover(&[published.join("office3")], &limits)?.sequences[0], &limits)?;
    let sequence = release::convert(&text, &release::Options::default())?.sequence;
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let path = folder.path().join("office3");
    format::write(&path, &sequence, WriteOptions::default())?;
    let frames = MeasuredFrame::of(&sequence);
    let speed = |time: std::time::Duration| frames.len() as f64 / time.as_secs_f64();
    let time = median_time(RUNS, || tracked(&sequence, &frames));
    figures.add("tracking office3, in memory", speed(time), "frames/s", Bound::AtLeast(200.0));
    let time = median_time(RUNS, || -> Result<_> {
        let sequence = format::read(&path)?;
        tracked(&sequence, &MeasuredFrame::of(&sequence))
    });
    figures.add("tracking office3, with reading it", speed(time), "frames/s", Bound::AtLeast(200.0));
    Ok(())
}
