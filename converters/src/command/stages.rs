//! Bars for work in stages, on a terminal, for work over a second.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Work in stages, one after the other, each with a bar of its own.
#[derive(Default)]
pub(super) struct Stages {
    stage: Mutex<Option<Stage>>,
}

struct Stage {
    name: &'static str,
    begun: Instant,
    bar: Option<ProgressBar>,
}

impl Stages {
    /// Tells how far a stage is; one that is new ends the one before. Stages count frames, and `unpacking` bytes.
    pub(super) fn update(&self, name: &'static str, done: u64, total: u64) {
        if !io::stderr().is_terminal() {
            return;
        }
        let Ok(mut current) = self.stage.lock() else { return };
        if current.as_ref().is_none_or(|stage| stage.name != name) {
            *current = Some(Stage { name, begun: Instant::now(), bar: None });
        }
        let Some(stage) = current.as_mut() else { return };
        if stage.begun.elapsed() < PATIENCE {
            return;
        }
        let bar = stage.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(total);
            let template = if name == "unpacking" {
                "{msg} {wide_bar} {bytes}/{total_bytes} ({bytes_per_sec}, {eta} left)"
            } else {
                "{msg} {wide_bar} {human_pos}/{human_len} frames ({per_sec} frames, {eta} left)"
            };
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message(name);
            bar
        });
        bar.set_length(total);
        bar.set_position(done);
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}
