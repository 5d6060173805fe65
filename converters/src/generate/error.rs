//! What can go wrong while a sequence is made of images.

use std::path::PathBuf;

use open_structure::structure::LineId;

use crate::{detect, rgbd};

/// Errors of this room.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The raw data cannot be used.
    #[error(transparent)]
    Raw(#[from] rgbd::Error),
    /// A detector refused an image.
    #[error("{}: {cause}", path.display())]
    Detect {
        /// The image.
        path: PathBuf,
        /// Why.
        cause: detect::Error,
    },
    /// An option cannot be used.
    #[error("{place}: expected {expected}, found {found}")]
    Option {
        /// The option, as in the configuration.
        place: String,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// There is nothing to write.
    #[error("{what}: none is left of {frames} frames; {reason}")]
    Nothing {
        /// What there is none of.
        what: &'static str,
        /// Frames that were looked at.
        frames: usize,
        /// Where it went.
        reason: String,
    },
    /// A picture cannot be drawn or written.
    #[error("{}: {detail}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// Why.
        detail: String,
    },
    /// The sequence cannot be written.
    #[error(transparent)]
    Format(#[from] open_structure::format::Error),
    /// A line landmark has no length.
    #[error("{line_id}: {cause}")]
    Line {
        /// The landmark.
        line_id: LineId,
        /// What is wrong with it.
        cause: open_structure::geometry::Error,
    },
}
