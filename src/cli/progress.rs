//! A progress bar for work that takes over a second, on terminals alone.

use std::io::{self, IsTerminal};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// A bar that appears when the work turns out to be long.
pub(super) struct Progress {
    what: String,
    template: String,
    begun: Instant,
    bar: Mutex<Option<ProgressBar>>,
}

impl Progress {
    /// Work on something, counted in a unit.
    pub(super) fn new(what: impl Into<String>, unit: &'static str) -> Self {
        let template =
            format!("{{msg}} {{wide_bar}} {{human_pos}}/{{human_len}} {unit} ({{per_sec}}, {{eta}} left)");
        Self { what: what.into(), template, begun: Instant::now(), bar: Mutex::new(None) }
    }

    /// Work on something, counted in bytes.
    pub(super) fn bytes(what: impl Into<String>) -> Self {
        let template =
            "{msg} {wide_bar} {decimal_bytes}/{decimal_total_bytes} ({decimal_bytes_per_sec}, {eta} left)";
        Self {
            what: what.into(),
            template: template.to_owned(),
            begun: Instant::now(),
            bar: Mutex::new(None),
        }
    }

    /// Tells how far the work is.
    pub(super) fn update(&self, done: u64, total: u64) {
        if self.begun.elapsed() < PATIENCE || !io::stderr().is_terminal() {
            return;
        }
        let Ok(mut bar) = self.bar.lock() else { return };
        let bar = bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(total);
            if let Ok(style) = ProgressStyle::with_template(&self.template) {
                bar.set_style(style);
            }
            bar.set_message(self.what.clone());
            // What is done already, in an earlier run perhaps, tells nothing of the speed from here.
            bar.set_position(done);
            bar.reset_eta();
            bar
        });
        bar.set_length(total);
        bar.set_position(done);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Ok(Some(bar)) = self.bar.get_mut().map(Option::take) {
            bar.finish_and_clear();
        }
    }
}

/// Work on frames in stages, one after the other, each with a bar of its own.
#[derive(Default)]
pub(super) struct Stages {
    stage: Mutex<Option<(&'static str, Progress)>>,
}

impl Stages {
    /// Tells how far a stage is, in frames; one that is new ends the one before.
    pub(super) fn update(&self, stage: &'static str, done: u64, total: u64) {
        self.update_in(stage, "frames", done, total);
    }

    /// As [`update`](Self::update), counted in another unit.
    pub(super) fn update_in(&self, stage: &'static str, unit: &'static str, done: u64, total: u64) {
        let Ok(mut current) = self.stage.lock() else { return };
        if current.as_ref().is_none_or(|(name, _)| *name != stage) {
            *current = Some((stage, Progress::new(stage, unit)));
        }
        if let Some((_, progress)) = current.as_ref() {
            progress.update(done, total);
        }
    }
}
