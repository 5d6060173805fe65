//! Noisy measurements of landmarks: what a SLAM system is given.

use super::id::{FrameId, LineId, PointId};
use super::record::record;

record! {
    /// Where a point landmark was measured in a frame, with noise.
    pub struct PointMeasurement in point_measurements (PerFrame, Optional, key: [frame_id, point_id], frame: frame_id) {
        /// Frame of the measurement.
        ["1", "-"]
        frame_id: FrameId,
        /// Point to which the measurement is associated.
        ["1", "-"]
        point_id: PointId,
        /// Column.
        ["px", "image"]
        u: f64,
        /// Row.
        ["px", "image"]
        v: f64,
        /// Depth along the optical axis (z, not range); absent where it was not measured.
        ["m", "camera"]
        depth: Option<f64>,
    }
}

record! {
    /// Where a segment of a line landmark was measured in a frame, with noise.
    ///
    /// Which end is the start is arbitrary and need not agree with the landmark.
    pub struct LineMeasurement in line_measurements (PerFrame, Optional, key: [frame_id, line_id], frame: frame_id) {
        /// Frame of the measurement.
        ["1", "-"]
        frame_id: FrameId,
        /// Line to which the measurement is associated.
        ["1", "-"]
        line_id: LineId,
        /// Column of the start.
        ["px", "image"]
        start_u: f64,
        /// Row of the start.
        ["px", "image"]
        start_v: f64,
        /// Depth of the start along the optical axis (z, not range); absent where it was not measured.
        ["m", "camera"]
        start_depth: Option<f64>,
        /// Column of the end.
        ["px", "image"]
        end_u: f64,
        /// Row of the end.
        ["px", "image"]
        end_v: f64,
        /// Depth of the end along the optical axis (z, not range); absent where it was not measured.
        ["m", "camera"]
        end_depth: Option<f64>,
    }
}
