//! What was left out or changed on the way into another format.

use std::fmt;

/// Something that the other format cannot say as ours does, and how often it came up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    /// How many rows or numbers it concerns.
    pub count: usize,
    /// Whether something is lost; otherwise it was said in another way.
    pub loss: bool,
    /// What happened to them.
    pub text: String,
}

impl fmt::Display for Remark {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.count, self.text)
    }
}

/// Remarks in the order in which they came up.
#[derive(Clone, Debug, Default)]
pub(super) struct Remarks(Vec<Remark>);

impl Remarks {
    /// Something is left out.
    pub(super) fn lost(&mut self, count: usize, text: impl Into<String>) {
        self.add(count, true, text.into());
    }

    /// Something is said in another way.
    pub(super) fn said(&mut self, count: usize, text: impl Into<String>) {
        self.add(count, false, text.into());
    }

    fn add(&mut self, count: usize, loss: bool, text: String) {
        if count == 0 {
            return;
        }
        match self.0.iter_mut().find(|remark| remark.text == text) {
            Some(remark) => remark.count += count,
            None => self.0.push(Remark { count, loss, text }),
        }
    }

    pub(super) fn into_vec(self) -> Vec<Remark> {
        self.0
    }
}
