//! Co-visibility factor graphs and pose graphs: initial values and factors.

use super::id::{FrameId, GroupId, LineId, PointId};
use super::pose_row::{PoseRow, stored_pose};
use super::record::record;
use super::segment_row::stored_segment;

record! {
    /// Initial value of a pose vertex of a factor graph.
    pub struct GraphPose in graph_poses (Whole, Optional, key: [graph, frame_id]) {
        /// Name of the graph; a sequence may hold several.
        ["1", "-"]
        graph: String,
        /// Frame of the vertex.
        ["1", "-"]
        frame_id: FrameId,
        /// Whether the vertex is held at its initial value (gauge).
        ["1", "-"]
        fixed: bool,
        /// Initial camera centre, x.
        ["m", "world"]
        world_from_camera_tx: f64,
        /// Initial camera centre, y.
        ["m", "world"]
        world_from_camera_ty: f64,
        /// Initial camera centre, z.
        ["m", "world"]
        world_from_camera_tz: f64,
        /// Initial rotation, Hamilton quaternion, x.
        ["1", "world_from_camera"]
        world_from_camera_qx: f64,
        /// Initial rotation, Hamilton quaternion, y.
        ["1", "world_from_camera"]
        world_from_camera_qy: f64,
        /// Initial rotation, Hamilton quaternion, z.
        ["1", "world_from_camera"]
        world_from_camera_qz: f64,
        /// Initial rotation, Hamilton quaternion, w.
        ["1", "world_from_camera"]
        world_from_camera_qw: f64,
    }
}

stored_pose!(GraphPose { graph: String, frame_id: FrameId, fixed: bool });

record! {
    /// Initial value of a point vertex of a factor graph.
    pub struct GraphPoint in graph_points (Whole, Optional, key: [graph, point_id]) {
        /// Name of the graph.
        ["1", "-"]
        graph: String,
        /// Point of the vertex.
        ["1", "-"]
        point_id: PointId,
        /// Initial position, x.
        ["m", "world"]
        x: f64,
        /// Initial position, y.
        ["m", "world"]
        y: f64,
        /// Initial position, z.
        ["m", "world"]
        z: f64,
    }
}

record! {
    /// Initial value of a line vertex of a factor graph, as a segment.
    pub struct GraphLine in graph_lines (Whole, Optional, key: [graph, line_id]) {
        /// Name of the graph.
        ["1", "-"]
        graph: String,
        /// Line of the vertex.
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
    }
}

record! {
    /// One factor of a factor graph: a measurement and the vertices that it ties.
    ///
    /// The registry says for each `kind` which vertices are named and what the numbers of
    /// `measurement` and `information` mean.
    pub struct GraphFactor in graph_factors (Whole, Optional, key: [graph, factor_id]) {
        /// Name of the graph.
        ["1", "-"]
        graph: String,
        /// Name of the factor within its graph.
        ["1", "-"]
        factor_id: i64,
        /// Kind of the factor, such as `point-reprojection`; see the registry.
        ["1", "-"]
        kind: String,
        /// Pose vertex.
        ["1", "-"]
        frame_id: Option<FrameId>,
        /// Second pose vertex of a relative-pose factor.
        ["1", "-"]
        other_frame_id: Option<FrameId>,
        /// Point vertex.
        ["1", "-"]
        point_id: Option<PointId>,
        /// Line vertex.
        ["1", "-"]
        line_id: Option<LineId>,
        /// Structural group of a parallelism factor.
        ["1", "-"]
        group_id: Option<GroupId>,
        /// Measured numbers, in the order, units and spaces that the registry gives for the kind.
        ["by kind", "by kind"]
        measurement: Vec<f64>,
        /// Upper triangle, row by row, of the information matrix (inverse covariance) of the measurement; absent means that the manifest's noise model applies.
        ["by kind", "by kind"]
        information: Option<Vec<f64>>,
    }
}

stored_segment!(GraphLine { graph: String, line_id: LineId });
