//! What can go wrong in tracking.

use crate::structure::{CameraId, FrameId};

/// An error of the room `track`.
///
/// Too few measurements are none: they are a [`TrackState`](super::TrackState).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A frame of a camera that is not there.
    #[error("{frame}: expected a camera of the manifest, found {camera}")]
    UnknownCamera {
        /// The frame.
        frame: FrameId,
        /// Its camera.
        camera: CameraId,
    },
    /// A camera that projects nothing.
    #[error("{camera}: expected finite intrinsics and focal lengths that are not zero, found {found:?} px")]
    Camera {
        /// The camera.
        camera: CameraId,
        /// fx, fy, cx, cy.
        found: [f64; 4],
    },
    /// A number among the options or the noise that cannot be used.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// Which number.
        what: &'static str,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// The same frame twice.
    #[error("{frame}: expected once, found again")]
    Repeated {
        /// The frame.
        frame: FrameId,
    },
}
