//! Why nothing was detected.

/// An image that cannot be searched.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The image is not a grey one.
    #[error("expected one channel of 8 bits, found {channels} channels of OpenCV depth {depth}")]
    NotGrey {
        /// Channels of the image.
        channels: i32,
        /// OpenCV's number for the type of a channel.
        depth: i32,
    },
    /// A detector failed.
    #[error("detector: {cause}")]
    OpenCv {
        /// Why.
        cause: opencv::Error,
    },
}

impl From<opencv::Error> for Error {
    fn from(cause: opencv::Error) -> Self {
        Self::OpenCv { cause }
    }
}
