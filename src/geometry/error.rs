//! What can be wrong with numbers that should be a pose, a camera or a line.

/// Numbers that are no pose, camera or line, or a line that has no image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number is NaN or infinite, or became so.
    #[error("{what}: expected finite numbers, found {found}")]
    NotFinite {
        /// The quantity the number belongs to.
        what: &'static str,
        /// The first number that is not finite.
        found: f64,
    },
    /// A quaternion too short to name a rotation.
    #[error("rotation: expected a quaternion of norm 1, found norm {norm:e}")]
    NoRotation {
        /// Norm of the four numbers.
        norm: f64,
    },
    /// A number outside its range.
    #[error("{what}: expected {expected}, found {found}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The range in words.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// Two ends at the same place, or a direction of length zero.
    #[error("{what}: expected a direction, found length zero")]
    NoDirection {
        /// The quantity that should have a direction.
        what: &'static str,
    },
    /// Moment and direction that no line has, because they are not perpendicular.
    #[error("plücker line: expected moment · direction = 0 m within {tolerance:e} m, found {found:e} m")]
    NotOrthogonal {
        /// What was allowed, metres, for a direction of length one.
        tolerance: f64,
        /// `n · d` in metres, for a direction of length one.
        found: f64,
    },
    /// Fewer measurements than unknowns.
    #[error("{what}: expected at least {expected}, found {found}")]
    TooFew {
        /// What is sought from them.
        what: &'static str,
        /// How many it takes.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// Measurements whose arrangement leaves the answer open, such as points on one line, or that no answer fits.
    #[error("{what}: {reason}")]
    Degenerate {
        /// What is sought.
        what: &'static str,
        /// What leaves it open.
        reason: &'static str,
    },
    /// A line that passes through the camera centre, or lies in the plane through it parallel to the image.
    #[error(
        "line has no image: its plane through the camera centre has the normal {moment:?} m in the camera"
    )]
    NoImage {
        /// The line's moment in the camera, metres.
        moment: [f64; 3],
    },
}

impl Error {
    /// The first number that is not finite, as an error.
    pub(super) fn check_finite<'a>(
        what: &'static str,
        numbers: impl IntoIterator<Item = &'a f64>,
    ) -> Result<(), Error> {
        match numbers.into_iter().find(|number| !number.is_finite()) {
            Some(&found) => Err(Error::NotFinite { what, found }),
            None => Ok(()),
        }
    }
}
