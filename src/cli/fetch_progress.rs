//! What `os fetch` says while it works: a bar of bytes, and a line about everything that is not as usual.

use std::cell::RefCell;
use std::io::{self, Write};

use super::progress::Progress;
use super::text;
use crate::fetch::Event;

/// Shows events on standard error.
#[derive(Default)]
pub(super) struct FetchProgress {
    bar: RefCell<Option<(String, Progress)>>,
}

impl FetchProgress {
    /// Shows an event.
    pub(super) fn show(&self, event: &Event<'_>) {
        match event {
            Event::Bytes { file, done, total } => self.bar(file, *done, total.unwrap_or(*done)),
            Event::Unpacking { file, done, total } => self.bar(&format!("unpacking {file}"), *done, *total),
            Event::Asked { file, url } => self.line(&format!("{file}: from {url}")),
            Event::Resumed { file, at } => self.line(&format!("{file}: goes on after {}", text::bytes(*at))),
            Event::StartedOver { file, reason } => self.line(&format!("{file}: starts over, {reason}")),
            Event::Failed { file, reason, wait } => {
                self.line(&format!("{file}: {reason}; again in {:.1} s", wait.as_secs_f64()));
            }
            Event::GoneElsewhere { file, reason } => {
                self.line(&format!("{file}: {reason}; the next place is asked"));
            }
            Event::There { file, bytes } => self.line(&format!("{file}: is there, {}", text::bytes(*bytes))),
        }
    }

    fn bar(&self, what: &str, done: u64, total: u64) {
        let mut bar = self.bar.borrow_mut();
        if bar.as_ref().is_none_or(|(now, _)| now != what) {
            *bar = Some((what.to_owned(), Progress::bytes(what)));
        }
        if let Some((_, progress)) = bar.as_ref() {
            progress.update(done, total);
        }
    }

    fn line(&self, words: &str) {
        // The bar goes, and comes again below the line.
        self.bar.borrow_mut().take();
        // Where even stderr is closed there is nobody to tell.
        let _ = writeln!(io::stderr(), "{words}");
    }
}
