//! How long a bench of criterion takes.

use criterion::Criterion;
use std::time::Duration;

/// Medians over seconds, not minutes: all of them together are meant to run often.
pub(crate) fn brief(seconds: u64) -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(seconds))
}
