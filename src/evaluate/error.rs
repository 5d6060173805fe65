//! What keeps an estimate from being compared.

/// Why there are no figures.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A trajectory or map that names something twice.
    #[error("{of}: expected one entry for each id, found {id} twice")]
    Twice {
        /// Which side: the reference or the estimate.
        of: &'static str,
        /// What comes twice.
        id: String,
    },
    /// A number that is NaN or infinite, or becomes so when it is squared.
    #[error("{of}, {id}: expected finite numbers, found {found}")]
    NotFinite {
        /// Which side: the reference or the estimate.
        of: &'static str,
        /// Whose number it is.
        id: String,
        /// The number.
        found: f64,
    },
    /// A stored pose that is none.
    #[error("{of}, {id}: {source}")]
    NoPose {
        /// Which side: the reference or the estimate.
        of: &'static str,
        /// Whose pose it is.
        id: String,
        /// What is wrong with it.
        source: crate::geometry::Error,
    },
    /// Two trajectories without a pose in common.
    #[error(
        "expected poses that match, found none among {reference} of the reference and {estimate} of the estimate"
    )]
    NoMatch {
        /// Poses of the reference.
        reference: usize,
        /// Poses of the estimate.
        estimate: usize,
    },
    /// Too few different positions to align.
    #[error(
        "alignment needs positions that do not all lie on one line; those of the {poses} matched poses do (σ₂/σ₁ of their covariance is {ratio:e}); alignment `origin` or `none` is possible"
    )]
    Degenerate {
        /// Poses that were to be aligned.
        poses: usize,
        /// Second over first singular value of the covariance.
        ratio: f64,
    },
    /// No two poses that are so far apart.
    #[error("expected pairs of poses {delta} apart, found none among {poses} poses")]
    NoPairs {
        /// The distance asked for, with its unit.
        delta: String,
        /// Poses that were searched.
        poses: usize,
    },
    /// A distance between the poses of a pair that is none.
    #[error("delta: expected {expected}, found {found}")]
    Delta {
        /// What is possible.
        expected: &'static str,
        /// What was asked for.
        found: f64,
    },
    /// More pairs to look at than is sensible.
    #[error("all pairs by angle: expected at most {most} poses, found {found}")]
    TooManyPoses {
        /// The most that are searched.
        most: usize,
        /// Poses there are.
        found: usize,
    },
    /// More pairs than is sensible.
    #[error("all pairs {delta} apart: expected at most {most}, found more")]
    TooManyPairs {
        /// The distance asked for, with its unit.
        delta: String,
        /// The most that are compared.
        most: usize,
    },
    /// A relation that these errors do not have.
    #[error("{relation} is defined for relative errors whose reference moves, and these are {found}")]
    NoRelation {
        /// The relation.
        relation: &'static str,
        /// What there is in its place.
        found: &'static str,
    },
}
