//! A progress bar on a terminal, for work over a second.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Sequences done, and rows so far.
pub(super) struct Progress {
    bar: ProgressBar,
    rows: AtomicU64,
}

impl Progress {
    /// A bar for a number of sequences; it stays hidden where stderr is no terminal.
    pub(super) fn new(sequences: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(sequences as u64), ProgressDrawTarget::hidden());
        let template = "{bar:30} sequence {pos} of {len} · {msg} · {elapsed}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message("reading");
        let waiting = bar.downgrade();
        // Ends by itself: a bar that is gone is not drawn.
        thread::spawn(move || {
            thread::sleep(PATIENCE);
            if let Some(bar) = waiting.upgrade()
                && !bar.is_finished()
            {
                bar.set_draw_target(ProgressDrawTarget::stderr());
                bar.enable_steady_tick(Duration::from_millis(200));
            }
        });
        Self { bar, rows: AtomicU64::new(0) }
    }

    /// A stage of a sequence begins.
    pub(super) fn stage(&self, name: &str, stage: &str) {
        let rows = self.rows.load(Ordering::Relaxed);
        self.bar.set_message(format!("{rows} rows · {stage} {name}"));
    }

    /// Rows were read.
    pub(super) fn rows(&self, rows: u64) {
        self.rows.fetch_add(rows, Ordering::Relaxed);
    }

    /// A sequence is done, well or not.
    pub(super) fn done(&self) {
        self.bar.inc(1);
    }

    /// The bar goes.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
