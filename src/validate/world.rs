//! The truth that rows are held against.

use nalgebra::Point3;

use super::frames::{FrameIndex, View};
use super::groups::GroupsOfLine;
use super::landmarks::{Landmarks, LineEntry};
use super::noise::Declared;

/// Frames, cameras, landmarks and noise of a sequence.
pub(crate) struct World<'a> {
    pub(crate) frames: &'a FrameIndex,
    /// Cameras in the order of the manifest; `None` for one whose numbers cannot be used.
    pub(crate) views: &'a [Option<View>],
    /// `None` when there is no such table, or it cannot be read.
    pub(crate) points: Option<&'a Landmarks<Point3<f64>>>,
    /// `None` when there is no such table, or it cannot be read.
    pub(crate) lines: Option<&'a Landmarks<LineEntry>>,
    pub(crate) groups: &'a GroupsOfLine,
    pub(crate) noise: Declared,
}
