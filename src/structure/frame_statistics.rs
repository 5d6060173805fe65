//! What one frame sees, in numbers.

use super::id::FrameId;
use super::record::record;

record! {
    /// Statistics of one frame, as the paper's section on statistical analysis has them.
    ///
    /// Counted over the measurements, or over the observations of a sequence without measurements.
    pub struct FrameStatistics in frame_statistics (Whole, Optional, key: [frame_id]) {
        /// Frame that is described.
        ["1", "-"]
        frame_id: FrameId,
        /// Points in the frame.
        ["1", "-"]
        point_count: i64,
        /// Line segments in the frame.
        ["1", "-"]
        line_count: i64,
        /// Cells of 10 × 10 pixels in which a point or an end of a segment lies.
        ["1", "image"]
        occupied_cells: i64,
        /// Independent constraints among the lines of the frame: the sum over groups of (lines in the frame − 1).
        ["1", "-"]
        structural_constraints: i64,
    }
}
