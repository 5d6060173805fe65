//! Commands of `os-convert`: arguments, calls, rendering.

pub mod completions;
pub mod man;
mod parse;
mod progress;
pub mod rgbd;
mod stages;
mod summary;
pub mod text_release;
mod unpacked;

/// How a command ended; `main` makes the exit code of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All was done.
    Done,
    /// All was done, and something was found that people should look at.
    Findings,
    /// Something failed and was told.
    Failed,
    /// The arguments contradict each other or what was found; told.
    Misused,
}

impl Outcome {
    /// The exit code.
    #[must_use]
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Misused => 2,
            Self::Findings => 3,
        }
    }
}
