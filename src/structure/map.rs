//! Estimated landmarks: the map that goes with an estimated trajectory.

use nalgebra::Point3;

use super::id::{LineId, PointId};
use super::record::record;
use super::segment_row::stored_segment;

record! {
    /// One estimated point.
    pub struct MapPoint in map_points (Whole, Optional, key: [estimate, point_id]) {
        /// Name of the estimate, shared with `trajectories`.
        ["1", "-"]
        estimate: String,
        /// Point that is estimated.
        ["1", "-"]
        point_id: PointId,
        /// Estimated position, x.
        ["m", "world"]
        x: f64,
        /// Estimated position, y.
        ["m", "world"]
        y: f64,
        /// Estimated position, z.
        ["m", "world"]
        z: f64,
        /// Upper triangle, row by row, of the covariance of x, y, z: 6 numbers; absent where it is not known.
        ["m²", "world", "1.3.0"]
        covariance: Option<Vec<f64>>,
    }
}

record! {
    /// One estimated line, as a segment.
    pub struct MapLine in map_lines (Whole, Optional, key: [estimate, line_id]) {
        /// Name of the estimate, shared with `trajectories`.
        ["1", "-"]
        estimate: String,
        /// Line that is estimated.
        ["1", "-"]
        line_id: LineId,
        /// First end, x.
        ["m", "world"]
        start_x: f64,
        /// First end, y.
        ["m", "world"]
        start_y: f64,
        /// First end, z.
        ["m", "world"]
        start_z: f64,
        /// Second end, x.
        ["m", "world"]
        end_x: f64,
        /// Second end, y.
        ["m", "world"]
        end_y: f64,
        /// Second end, z.
        ["m", "world"]
        end_z: f64,
        /// Upper triangle, row by row, of the covariance of start and end: 21 numbers, of a matrix that is zero along the line; absent where it is not known.
        ["m²", "world", "1.3.0"]
        covariance: Option<Vec<f64>>,
    }
}

stored_segment!(MapLine { estimate: String, line_id: LineId } absent: covariance);

impl MapPoint {
    /// A row with its point, metres in `world`.
    #[must_use]
    pub fn new(estimate: String, point_id: PointId, at: &Point3<f64>) -> Self {
        Self { estimate, point_id, x: at.x, y: at.y, z: at.z, covariance: None }
    }
}
