//! How an adjustment went: what was used, what was left out and why, and how it ended.

use super::error::Error;
use super::minimise::Ending;
use super::plan::Plan;
use crate::structure::{FrameId, GroupId, LineId, PointId};
use std::collections::BTreeMap;

/// Why something of a graph was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Reason {
    /// A number of it is NaN or infinite, or there are too few numbers.
    NotFinite,
    /// The same vertex again.
    Duplicate,
    /// It names a vertex that the graph does not have, or that is not used.
    UnknownVertex,
    /// Its frame has no camera.
    UnknownCamera,
    /// Its information matrix is not positive.
    BadInformation,
    /// A point behind the camera that measured it, at the start.
    BehindCamera,
    /// A point that the adjustment took behind the camera that measured it.
    WentBehindCamera,
    /// A segment of length zero.
    NoLength,
    /// A line through the centre of the camera that measured it.
    NoImage,
    /// A landmark in too few frames.
    TooFewViews,
    /// A kind of factor that is not known.
    UnknownKind,
    /// The depth of a measurement, which cannot be used; its pixels are.
    NoDepth,
}

impl Reason {
    /// The reason in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::NotFinite => "numbers that are not finite or are missing",
            Self::Duplicate => "a vertex that is there already",
            Self::UnknownVertex => "a vertex that is not in the graph or not used",
            Self::UnknownCamera => "a frame without camera",
            Self::BadInformation => "an information matrix that is not positive",
            Self::BehindCamera => "a point behind the camera at the start",
            Self::WentBehindCamera => "a point that went behind the camera",
            Self::NoLength => "a segment of length zero",
            Self::NoImage => "a line through the camera centre",
            Self::TooFewViews => "seen in too few frames",
            Self::UnknownKind => "a kind of factor that is not known",
            Self::NoDepth => "depth that cannot be used",
        }
    }
}

/// What was counted of one kind of thing.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Tally {
    /// Used.
    pub used: usize,
    /// Left out, by reason.
    pub excluded: BTreeMap<Reason, usize>,
}

impl Tally {
    pub(super) fn exclude(&mut self, reason: Reason) {
        *self.excluded.entry(reason).or_default() += 1;
    }
}

/// A line that contradicts its group and was adjusted without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReleasedLine {
    /// The line.
    pub line_id: LineId,
    /// Its group.
    pub group_id: GroupId,
    /// Its angle to the group's direction, radians.
    pub angle_rad: f64,
    /// The squared length of that difference in units of its covariance; two degrees of freedom.
    pub chi_squared: f64,
}

/// How an adjustment went.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Summary {
    /// Why it ended.
    pub ending: Ending,
    /// Steps tried.
    pub iterations: usize,
    /// Cost at the start, `½ Σ ρ`.
    pub initial_cost: f64,
    /// Cost at the end.
    pub final_cost: f64,
    /// Root mean square of the whitened residuals of what was used, in sigma.
    pub residual_rms: f64,
    /// Numbers of all residuals.
    pub residuals: usize,
    /// Degrees of freedom of all variables.
    pub unknowns: usize,
    /// How steps were solved for, in the last round.
    pub plan: Plan,
    /// Poses.
    pub poses: Tally,
    /// Points.
    pub points: Tally,
    /// Lines.
    pub lines: Tally,
    /// Factors of points.
    pub point_factors: Tally,
    /// Factors of lines.
    pub line_factors: Tally,
    /// Factors between poses.
    pub relative_factors: Tally,
    /// Parts of the graph that no factor ties to each other.
    pub components: usize,
    /// Frames that were held: by the graph, by an option, or as the gauge of their part.
    pub held: Vec<FrameId>,
    /// Frames whose measurements leave their pose open, which a weak prior keeps near the start.
    pub weak: Vec<FrameId>,
    /// Frames whose measurements hardly say where they are, which motion carries along with their neighbours.
    pub carried: Vec<FrameId>,
    /// Frames without any measurement that can be used, which stay where they are.
    pub unconstrained: Vec<FrameId>,
    /// Points in front of all their cameras at the start that ended behind one.
    pub behind: Vec<PointId>,
    /// Why there are no covariances, though they were asked for.
    pub no_covariance: Option<Error>,
    /// Lines that share the direction of their group.
    pub grouped: usize,
    /// Lines that contradict their group.
    pub released: Vec<ReleasedLine>,
}
