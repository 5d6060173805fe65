//! What can be wrong with a problem or a graph.

use super::loss::Loss;
use crate::structure::{CameraId, FrameId};

/// A problem that cannot be posed or solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A factor that does not fit its problem.
    #[error("factor {factor} of its kind: expected {expected}")]
    Factor {
        /// Place among the factors that were added together.
        factor: usize,
        /// What is expected.
        expected: &'static str,
    },
    /// A loss without a usable scale.
    #[error("loss {loss:?}: expected a scale over zero")]
    Loss {
        /// The loss.
        loss: Loss,
    },
    /// A space with degrees of freedom that the solver has no blocks for.
    #[error("a space of {found} degrees of freedom: expected 1 to {most}")]
    Freedom {
        /// Most degrees of freedom.
        most: usize,
        /// Those of the space.
        found: usize,
    },
    /// An option outside its range.
    #[error("option {option}: expected {expected}, found {found}")]
    Option {
        /// The option.
        option: &'static str,
        /// What is expected.
        expected: &'static str,
        /// The value.
        found: f64,
    },
    /// The start has no cost: a residual is not finite there.
    #[error("start: expected a finite cost, found {found}")]
    Start {
        /// The cost.
        found: f64,
    },
    /// A graph without anything to adjust.
    #[error("graph `{graph}`: expected {expected}, found none that can be used")]
    Nothing {
        /// Name of the graph.
        graph: String,
        /// What is expected.
        expected: &'static str,
    },
    /// A frame that is asked for is not in the graph.
    #[error("graph `{graph}`: {frame} is not among its poses")]
    UnknownFrame {
        /// Name of the graph.
        graph: String,
        /// The frame.
        frame: FrameId,
    },
    /// A camera that the graph does not have, or whose numbers are no camera.
    #[error("graph `{graph}`: {frame} names {camera}, which is not among its cameras")]
    UnknownCamera {
        /// Name of the graph.
        graph: String,
        /// The frame.
        frame: FrameId,
        /// Its camera.
        camera: CameraId,
    },
    /// The information matrix is singular: something is left open by gauge and measurements.
    #[error("information matrix: expected a positive one, found it singular; is the gauge held?")]
    Singular,
    /// What the options ask to eliminate first cannot be: some of it meets in a factor, or there is none.
    #[error("cannot eliminate {asked} first: expected variables of which no two share a factor")]
    Elimination {
        /// What was asked for.
        asked: &'static str,
    },
    /// The problem is larger than what fits into memory.
    #[error("reduced system: expected at most {most} unknowns, found {found}")]
    TooLarge {
        /// Unknowns that are allowed.
        most: usize,
        /// Unknowns.
        found: usize,
    },
}
