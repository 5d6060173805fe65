//! What can be wrong with a recipe of a dataset.

/// Errors of this room.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A value cannot be used.
    #[error("{place}: expected {expected}, found {found}")]
    Value {
        /// Where the value stands, such as `camera.fx`.
        place: String,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// No recipe of that name travels with the program.
    #[error("there is no recipe `{name}`; expected a file, or one of {known}")]
    Unknown {
        /// The name.
        name: String,
        /// All names.
        known: String,
    },
}

impl Error {
    pub(super) fn value(
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl std::fmt::Display,
    ) -> Self {
        Self::Value { place: place.into(), expected: expected.into(), found: found.to_string() }
    }
}
