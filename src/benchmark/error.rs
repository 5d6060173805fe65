//! What keeps a benchmark from being run.

use std::path::PathBuf;

use crate::format;
use crate::simulate;

/// What keeps a benchmark from being run; a method that fails on a sequence is a result, not an error.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A sequence cannot be read.
    #[error(transparent)]
    Format(#[from] format::Error),
    /// A recipe cannot be followed.
    #[error("recipe {name}: {cause}")]
    Recipe {
        /// Name of the recipe.
        name: String,
        /// What is wrong.
        cause: simulate::Error,
    },
    /// A file of the results cannot be read or written.
    #[error("{}: {cause}", path.display())]
    Io {
        /// File or folder concerned.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file of the results is not what it should be.
    #[error("{}: {detail}", path.display())]
    Stored {
        /// File concerned.
        path: PathBuf,
        /// What is wrong.
        detail: String,
    },
    /// The results in a folder come from another plan.
    #[error("{}: holds results of another plan: {difference}; use another folder, or --force to begin anew", path.display())]
    OtherPlan {
        /// The folder.
        path: PathBuf,
        /// What differs.
        difference: String,
    },
    /// A run cannot be put together with others.
    #[error("{}: cannot be gathered with the others: {difference}", path.display())]
    Apart {
        /// Folder of the run.
        path: PathBuf,
        /// What keeps it apart.
        difference: String,
    },
    /// No run has what the others promise.
    #[error("{sequence}: none of the runs has its {what}")]
    Missing {
        /// Name of the sequence.
        sequence: String,
        /// What is missing.
        what: String,
    },
    /// Two sequences have one name.
    #[error("two sequences are called `{name}`: results would be mixed up")]
    SameName {
        /// The name.
        name: String,
    },
    /// A sequence cannot be benchmarked.
    #[error("{sequence}: {reason}")]
    Unfit {
        /// Name of the sequence.
        sequence: String,
        /// Why.
        reason: String,
    },
}

impl Error {
    /// Puts a path to what the system said.
    pub(super) fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |cause| Self::Io { path: path.to_owned(), cause }
    }
}
