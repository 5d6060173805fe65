//! Noise-free observations of landmarks.

use super::id::{FrameId, LineId, PointId};
use super::record::record;

record! {
    /// Where a point landmark appears in a frame, without noise.
    pub struct PointObservation in point_observations (PerFrame, Optional, key: [frame_id, point_id], frame: frame_id) {
        /// Frame that sees the point.
        ["1", "-"]
        frame_id: FrameId,
        /// Point that is seen.
        ["1", "-"]
        point_id: PointId,
        /// Column.
        ["px", "image"]
        u: f64,
        /// Row.
        ["px", "image"]
        v: f64,
        /// Depth along the optical axis (z, not range); absent where it is not known.
        ["m", "camera"]
        depth: Option<f64>,
    }
}

record! {
    /// Where the visible part of a line landmark appears in a frame, without noise.
    ///
    /// Which end is the start is arbitrary and need not agree with the landmark.
    pub struct LineObservation in line_observations (PerFrame, Optional, key: [frame_id, line_id], frame: frame_id) {
        /// Frame that sees the line.
        ["1", "-"]
        frame_id: FrameId,
        /// Line that is seen.
        ["1", "-"]
        line_id: LineId,
        /// Column of the start.
        ["px", "image"]
        start_u: f64,
        /// Row of the start.
        ["px", "image"]
        start_v: f64,
        /// Depth of the start along the optical axis (z, not range); absent where it is not known.
        ["m", "camera"]
        start_depth: Option<f64>,
        /// Column of the end.
        ["px", "image"]
        end_u: f64,
        /// Row of the end.
        ["px", "image"]
        end_v: f64,
        /// Depth of the end along the optical axis (z, not range); absent where it is not known.
        ["m", "camera"]
        end_depth: Option<f64>,
    }
}
