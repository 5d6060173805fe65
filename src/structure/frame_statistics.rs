//! What one frame sees, in numbers.

use super::id::FrameId;
use super::record::record;

record! {
    /// Statistics of one frame, as the paper's section on statistical analysis has them, and what it shares with the frame before it.
    ///
    /// Counted over the measurements, or over the observations of a sequence without measurements. The frame before it is the one in
    /// the row before in the table `frames`; the columns about the two are absent for the first frame.
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
        /// Cells of the image in which a point or any part of a segment lies; absent for an image of over 16 384 pixels a side.
        ["1", "image", "1.1.0"]
        covered_cells: Option<i64>,
        /// Angle by which the camera turned since the frame before, from the true poses; absent where one is not known.
        ["rad", "-", "1.1.0"]
        rotation_since_previous: Option<f64>,
        /// Distance by which the camera centre moved since the frame before, from the true poses; absent where one is not known.
        ["m", "world", "1.1.0"]
        translation_since_previous: Option<f64>,
        /// Points that the frame before shows too.
        ["1", "-", "1.1.0"]
        points_shared_with_previous: Option<i64>,
        /// Lines that the frame before shows too.
        ["1", "-", "1.1.0"]
        lines_shared_with_previous: Option<i64>,
        /// Median over the shared points of the angle between the two rays to the point; absent without true poses or shared points.
        ["rad", "world", "1.1.0"]
        median_parallax_to_previous: Option<f64>,
    }
}
