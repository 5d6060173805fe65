//! What can keep a picture from being made.

/// Why there is no picture.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Nothing that could be drawn.
    #[error("{name}: expected landmarks or true poses with finite positions, found none")]
    Nothing {
        /// Name of the sequence.
        name: String,
    },
    /// A direction that is none.
    #[error(
        "view from azimuth {azimuth_degrees}°, elevation {elevation_degrees}°: expected finite angles, elevation within ±90°"
    )]
    View {
        /// Azimuth, degrees.
        azimuth_degrees: f64,
        /// Elevation, degrees.
        elevation_degrees: f64,
    },
}
