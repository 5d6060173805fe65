//! The tables of the format, listed once.

use super::field::TableInfo;
use super::record::Record;

/// Calls a macro with every table, in specification order: `name: Row`.
macro_rules! for_each_table {
    ($callback:ident) => {
        $callback! {
            frames: Frame,
            trajectories: TrajectoryPose,
            point_landmarks: PointLandmark,
            line_landmarks: LineLandmark,
            structural_groups: StructuralGroup,
            map_points: MapPoint,
            map_lines: MapLine,
            tracking: TrackedFrame,
            iterations: Iteration,
            point_correspondences: PointCorrespondence,
            line_correspondences: LineCorrespondence,
            graph_poses: GraphPose,
            graph_points: GraphPoint,
            graph_lines: GraphLine,
            graph_factors: GraphFactor,
            frame_statistics: FrameStatistics,
            point_observations: PointObservation,
            line_observations: LineObservation,
            point_measurements: PointMeasurement,
            line_measurements: LineMeasurement,
        }
    };
}
pub(crate) use for_each_table;

/// Calls a macro with every per-frame table, in specification order: `name: Row`.
macro_rules! for_each_frame_table {
    ($callback:ident) => {
        $callback! {
            point_observations: PointObservation,
            line_observations: LineObservation,
            point_measurements: PointMeasurement,
            line_measurements: LineMeasurement,
        }
    };
}
pub(crate) use for_each_frame_table;

macro_rules! list {
    ($($name:ident: $row:ident,)+) => {
        /// Every table of the format, in specification order.
        pub const TABLES: &[&TableInfo] = &[$(<super::$row as Record>::TABLE),+];
    };
}
for_each_table!(list);

/// The table of a collection of sequences; it is not a table of any of them.
pub const CATALOGUE: &TableInfo = <super::CatalogueEntry as Record>::TABLE;

/// The table of sequences of a name.
#[must_use]
pub fn table_info(name: &str) -> Option<&'static TableInfo> {
    TABLES.iter().copied().find(|table| table.name == name)
}

/// The table of a name, be it of sequences or of collections.
#[must_use]
pub fn any_table_info(name: &str) -> Option<&'static TableInfo> {
    table_info(name).or_else(|| Some(CATALOGUE).filter(|table| table.name == name))
}
