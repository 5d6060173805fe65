//! What became of everything that was detected.

use std::collections::BTreeMap;

use serde::Serialize;

/// What became of everything that was detected, counted.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Ledger {
    /// Frames whose images were used.
    pub frames: u64,
    /// Points that were detected.
    pub points_detected: u64,
    /// Points that have a place in the world.
    pub points_lifted: u64,
    /// Segments that were detected, after pieces were merged.
    pub segments_detected: u64,
    /// Segments that have a place in the world.
    pub segments_lifted: u64,
    /// What was left out, and why.
    pub left_out: BTreeMap<String, u64>,
}

impl Ledger {
    /// Counts what is left out.
    pub fn leave_out(&mut self, reason: &str, count: u64) {
        if count > 0 {
            *self.left_out.entry(reason.to_owned()).or_default() += count;
        }
    }

    /// Adds the counts of another.
    pub fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.points_detected += other.points_detected;
        self.points_lifted += other.points_lifted;
        self.segments_detected += other.segments_detected;
        self.segments_lifted += other.segments_lifted;
        for (reason, count) in &other.left_out {
            self.leave_out(reason, *count);
        }
    }
}
