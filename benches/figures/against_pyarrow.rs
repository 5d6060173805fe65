//! How fast a table comes into memory, against pyarrow on the same file.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{PointMeasurement, Sequence};

use crate::data::{Published, published_folder, synthetic};
use crate::figure::{Bound, Figures};
use crate::reading::one_core;

/// Blocks of both in turn; the median of their ratios counts.
const BLOCKS: usize = 9;
/// Runs of one block, the first of which is not counted.
const IN_A_ROW: usize = 6;

/// Reads the file as often as it is told, line by line, and prints the median seconds.
const PROGRAM: &str = "
import sys, time
import pyarrow as pa, pyarrow.parquet as pq
path, threads = sys.argv[1], sys.argv[2] == 'threads'
if not threads:
    pa.set_cpu_count(1)
for line in sys.stdin:
    times = []
    for _ in range(int(line)):
        start = time.perf_counter()
        table = pq.read_table(path, use_threads=threads)
        times.append(time.perf_counter() - start)
        del table
    times = sorted(times[1:])
    print(times[len(times) // 2], flush=True)
";

/// Noisy numbers and those of a published sequence, on one thread and on all.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    against(figures, "noisy", &synthetic(800, 5000), folder.path())?;
    match published_folder() {
        Some(published) => {
            let file = Published::read(&published.join("office3"), "observation.zip", "association.txt")?;
            against(figures, "office3", &file.sequence(), folder.path())
        }
        None => {
            eprintln!("SKIPPED: reading office3, which is not here (see OPEN_STRUCTURE_DATA)");
            Ok(())
        }
    }
}

fn against(figures: &mut Figures, name: &str, sequence: &Sequence, folder: &Path) -> Result<()> {
    let path = folder.join(name);
    format::write(&path, sequence, WriteOptions::default())?;
    let expected = sequence.point_measurements.len();
    let columns = || -> Result<usize> {
        let mut held = Vec::new();
        for batch in format::open(&path)?.record_batches::<PointMeasurement>()? {
            held.push(batch?);
        }
        Ok(held.iter().map(|batch| batch.num_rows()).sum())
    };
    let rows = || -> Result<usize> { Ok(format::open(&path)?.table::<PointMeasurement>()?.len()) };
    ensure!(columns()? == expected && rows()? == expected, "{name}: other rows come back");
    for threads in ["one", "threads"] {
        let Some(mut peer) = Pyarrow::start(&path.join("point_measurements.parquet"), threads)? else {
            eprintln!("SKIPPED: pyarrow, which is not in .venv");
            return Ok(());
        };
        let on = if threads == "one" { "one thread" } else { "all threads" };
        let (mut of_columns, mut of_rows, mut of_pyarrow) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..BLOCKS {
            let pyarrow = peer.median_seconds()?;
            let (columns, rows) = if threads == "one" {
                one_core(|| -> Result<_> { Ok((median_seconds(columns)?, median_seconds(rows)?)) })??
            } else {
                (median_seconds(columns)?, median_seconds(rows)?)
            };
            of_columns.push(columns / pyarrow);
            of_rows.push(rows / pyarrow);
            of_pyarrow.push(pyarrow);
        }
        figures.add(
            format!("pyarrow.parquet.read_table of {name}, columns, {on}"),
            expected as f64 / median(&mut of_pyarrow) / 1e6,
            "million rows/s",
            Bound::None,
        );
        let what =
            |kind: &str| format!("time of reading {name} into {kind} over pyarrow's into columns, {on}");
        // Columns are decoded one after the other on one thread, whatever there are.
        let bound = if threads == "one" { Bound::AtMost(1.5) } else { Bound::None };
        figures.add(what("columns"), median(&mut of_columns), "times", bound);
        figures.add(what("rows"), median(&mut of_rows), "times", Bound::None);
    }
    Ok(())
}

fn median_seconds(mut read: impl FnMut() -> Result<usize>) -> Result<f64> {
    let mut times = Vec::new();
    for _ in 0..IN_A_ROW {
        let start = Instant::now();
        read()?;
        times.push(start.elapsed().as_secs_f64());
    }
    Ok(median(&mut times[1..]))
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A Python that waits for the next block.
struct Pyarrow {
    child: Child,
    ask: Option<ChildStdin>,
    answer: BufReader<ChildStdout>,
}

impl Pyarrow {
    /// `None` where it is not installed.
    fn start(path: &Path, threads: &str) -> Result<Option<Self>> {
        let python = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
        let here =
            Command::new(&python).args(["-c", "import pyarrow.parquet"]).stderr(Stdio::null()).status();
        if !here.is_ok_and(|status| status.success()) {
            return Ok(None);
        }
        let mut child = Command::new(&python)
            .args(["-c", PROGRAM])
            .arg(path)
            .arg(threads)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (ask, answer) = (child.stdin.take(), child.stdout.take().context("no output")?);
        Ok(Some(Self { child, ask, answer: BufReader::new(answer) }))
    }

    fn median_seconds(&mut self) -> Result<f64> {
        let ask = self.ask.as_mut().context("no input")?;
        writeln!(ask, "{IN_A_ROW}")?;
        let mut line = String::new();
        self.answer.read_line(&mut line)?;
        line.trim().parse().with_context(|| format!("pyarrow's time: {line}"))
    }
}

impl Drop for Pyarrow {
    fn drop(&mut self) {
        // Its input ends, so it does too.
        drop(self.ask.take());
        let _ = self.child.wait();
    }
}
