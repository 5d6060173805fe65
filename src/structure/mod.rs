//! The nouns of the specification in memory: one struct per table row, the manifest and the whole sequence.
//!
//! Every row struct is the single source of its JSON Schema, its Arrow schema and its table in the
//! specification; [`Record`] and [`Field`] carry that description.

mod camera;
mod catalogue;
mod cells;
mod column;
mod column_view;
mod correspondence;
mod digest;
mod estimate;
mod factor_graph;
mod field;
mod frame;
mod frame_statistics;
mod graph;
mod id;
mod iteration;
mod landmark;
mod landmark_rows;
mod manifest;
mod map;
mod measured_frame;
mod measurement;
mod measurement_noise;
mod motion_grade;
mod observation;
mod pose_row;
mod provenance;
mod record;
pub mod registry;
mod result_table;
mod segment_row;
mod sequence;
mod statistics;
mod structural_group;
mod table;
mod tracking;
mod trajectory;
mod trajectory_file;

pub use camera::{Camera, Distortion};
pub use catalogue::CatalogueEntry;
pub use cells::ImageCells;
pub use column::{ColumnSink, ColumnSource, ColumnValue};
pub use column_view::{Bitmap, Lists, Nullable, TextLists};
pub use correspondence::{
    LineCorrespondence, PointCorrespondence, line_correspondences, point_correspondences,
};
pub use digest::{ContentDigest, hex};
pub use estimate::Estimate;
pub use factor_graph::FactorGraph;
pub use field::{ColumnType, Field, Need, Storage, TableInfo};
pub use frame::Frame;
pub use frame_statistics::FrameStatistics;
pub use graph::{GraphFactor, GraphLine, GraphPoint, GraphPose};
pub use id::{CameraId, FrameId, GroupId, LineId, PointId};
pub use iteration::Iteration;
pub use landmark::{Descriptor, LineLandmark, PointLandmark};
pub use landmark_rows::{KeptRows, LandmarkRows, RowsOfLandmark};
pub use manifest::{Clock, Conventions, Manifest, Noise, TableSummary};
pub use map::{MapLine, MapPoint};
pub use measured_frame::MeasuredFrame;
pub use measurement::{LineMeasurement, PointMeasurement};
pub use measurement_noise::{DepthNoise, MeasurementNoise};
pub use motion_grade::{MotionGrade, grade_of, typical_rotation};
pub use observation::{LineObservation, PointObservation};
pub use pose_row::PoseRow;
pub use provenance::{Exclusion, Generator, Recovery, Source, SourceFile};
pub use record::Record;
pub use result_table::{ResultColumn, ResultTable, ResultValues};
pub use sequence::{FrameBundle, Sequence};
pub use statistics::{CELL_SIZE_PX, FrameCounter, frame_statistics};
pub(crate) use statistics::{angle, median, ray, shared};
pub use structural_group::StructuralGroup;
pub use table::{CATALOGUE, TABLES, any_table_info, table_info};
pub(crate) use table::{for_each_frame_table, for_each_table};
pub use tracking::TrackedFrame;
pub use trajectory::TrajectoryPose;
pub use trajectory_file::{
    LARGEST_TRAJECTORY_FILE_BYTES, MOST_TRAJECTORY_ROWS, TrajectoryFileError, TrajectoryFormat,
    TrajectoryRow, read_trajectory, write_trajectory,
};
