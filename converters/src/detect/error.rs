//! What can go wrong with a detector.

/// Errors of this room.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// OpenCV refused.
    #[error("OpenCV: {0}")]
    OpenCv(String),
}

impl From<opencv::Error> for Error {
    fn from(error: opencv::Error) -> Self {
        Self::OpenCv(error.message)
    }
}
