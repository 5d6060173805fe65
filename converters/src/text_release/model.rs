//! The rows of a text release as plain data: every number as it stands in the file, in the file's order.

use super::problem::Problems;

/// A row that bears one id.
pub trait Row {
    /// The id.
    fn id(&self) -> i64;
    /// The line of the file it stands on, counted from 1.
    fn row(&self) -> u32;
}

macro_rules! impl_row {
    ($($name:ident . $id:ident),+) => {$(
        impl Row for $name {
            fn id(&self) -> i64 { self.$id }
            fn row(&self) -> u32 { self.row }
        }
    )+};
}
impl_row!(PoseLine.id, PointLine.id, SegmentLine.id, GroupLine.group);

/// `id tx ty tz qx qy qz qw`: a pose, `world_from_camera`, metres. The quaternion is as written, not normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseLine {
    /// The frame.
    pub id: i64,
    /// Position of the camera, world, metres.
    pub translation: [f64; 3],
    /// Orientation of the camera in the world, `[x, y, z, w]`, as written.
    pub rotation_xyzw: [f64; 4],
    /// The line of the file, counted from 1.
    pub row: u32,
}

/// `id x y z`: a point landmark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLine {
    /// The landmark.
    pub id: i64,
    /// Position, world, metres.
    pub position: [f64; 3],
    /// The line of the file, counted from 1.
    pub row: u32,
}

/// `id sx sy sz ex ey ez`: a line landmark by its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentLine {
    /// The landmark.
    pub id: i64,
    /// One end, world, metres.
    pub start: [f64; 3],
    /// The other end, world, metres.
    pub end: [f64; 3],
    /// The line of the file, counted from 1.
    pub row: u32,
}

/// `MappointFrameAsso: point frame u v`: a point seen in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointObservationLine {
    /// The landmark.
    pub point: i64,
    /// The frame.
    pub frame: i64,
    /// Column, image, pixels.
    pub u: f64,
    /// Row, image, pixels.
    pub v: f64,
    /// The line of the file, counted from 1.
    pub row: u32,
}

/// `MaplineFrameAsso: line frame u_s v_s d_s u_e v_e d_e`: a line seen in a frame.
///
/// The order of the ends has nothing to do with the order of the landmark's ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineObservationLine {
    /// The landmark.
    pub line: i64,
    /// The frame.
    pub frame: i64,
    /// One end `[u, v, d]`: image, pixels; depth along z of the camera, metres.
    pub start: [f64; 3],
    /// The other end `[u, v, d]`.
    pub end: [f64; 3],
    /// The line of the file, counted from 1.
    pub row: u32,
}

/// `ParalineMaplineAsso: group n line_1 … line_n`: lines of one direction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroupLine {
    /// The group.
    pub group: i64,
    /// The lines as listed, whatever `n` says.
    pub lines: Vec<i64>,
    /// The line of the file, counted from 1.
    pub row: u32,
}

/// Rows that belong together, as no id of the same tag came up again after other rows stood in between.
#[derive(Debug, Clone, PartialEq)]
pub struct Block<T> {
    /// Place among the blocks of the same tag in the file, from 0.
    pub number: u32,
    /// The rows, in the order of the file.
    pub rows: Vec<T>,
}

/// What one file holds, whatever part it plays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// `Vertex:` rows, or bare rows of a file of poses.
    pub vertices: Vec<Block<PoseLine>>,
    /// `Mappoint:` rows, or bare rows of a file of points.
    pub points: Vec<Block<PointLine>>,
    /// `Mapline:` rows, or bare rows of a file of lines.
    pub lines: Vec<Block<SegmentLine>>,
    /// `MappointFrameAsso:` rows.
    pub point_observations: Vec<PointObservationLine>,
    /// `MaplineFrameAsso:` rows.
    pub line_observations: Vec<LineObservationLine>,
    /// `ParalineMaplineAsso:` rows.
    pub groups: Vec<GroupLine>,
}

impl Rows {
    /// Whether there is nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
            && self.points.is_empty()
            && self.lines.is_empty()
            && self.point_observations.is_empty()
            && self.line_observations.is_empty()
            && self.groups.is_empty()
    }
}

/// A file of observations and groups. Embedded blocks of poses and landmarks are estimates, never ground truth.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Association {
    /// Where it was read from, as in [`super::Problem::file`].
    pub file: String,
    /// Its rows.
    pub rows: Rows,
}

/// A file of poses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PoseFile {
    /// Where it was read from, as in [`super::Problem::file`].
    pub file: String,
    /// The poses, in the order of the file.
    pub poses: Vec<PoseLine>,
}

/// A file of point landmarks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointFile {
    /// Where it was read from, as in [`super::Problem::file`].
    pub file: String,
    /// The points, in the order of the file.
    pub points: Vec<PointLine>,
}

/// A file of line landmarks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SegmentFile {
    /// Where it was read from, as in [`super::Problem::file`].
    pub file: String,
    /// The lines, in the order of the file.
    pub segments: Vec<SegmentLine>,
}

/// A published trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedTrajectory {
    /// Which estimate: `frame-to-frame`, `map-to-frame`, `point-ba`, `pointline-ba`, or another `…-ba`.
    pub estimate: String,
    /// Where it was read from, as in [`super::Problem::file`].
    pub file: String,
    /// The poses, in the order of the file.
    pub poses: Vec<PoseLine>,
}

/// A published map: the landmarks that belong to the trajectory of the same estimate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NamedMap {
    /// Which estimate, as in [`NamedTrajectory::estimate`].
    pub estimate: String,
    /// The points, in the order of the file.
    pub points: Vec<PointLine>,
    /// The lines, in the order of the file.
    pub lines: Vec<SegmentLine>,
    /// Where they were read from, as in [`super::Problem::file`].
    pub files: Vec<String>,
}

/// A file that was read: an archive as a whole, or one text file of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Its name, below the folder of its sequence.
    pub name: String,
    /// Its size, bytes.
    pub bytes: u64,
    /// SHA-256 of its bytes, lowercase hexadecimal.
    pub sha256: String,
}

/// One sequence of the text release, read and not yet judged.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TextSequence {
    /// The name, with the variant's suffix.
    pub name: String,
    /// The suffix that tells this variant from others of the same sequence, such as `v2`.
    pub variant: Option<String>,
    /// `camera_poses.txt`.
    pub ground_truth: Option<PoseFile>,
    /// `ground_truth.txt`, `ground_pose.txt`: the ground truth again, with fewer digits.
    pub repeated_ground_truth: Vec<PoseFile>,
    /// `point_landmarks.txt`.
    pub point_landmarks: Option<PointFile>,
    /// `structline_landmarks.txt`, `line_landmarks_refined.txt`: none, one, or both, sorted by file.
    pub line_landmarks: Vec<SegmentFile>,
    /// `association.txt`: truth or measurement, which only the residuals tell.
    pub association: Option<Association>,
    /// `venom_sequence.txt`: the initial factor graph.
    pub graph: Option<Association>,
    /// The published trajectories, sorted by estimate.
    pub trajectories: Vec<NamedTrajectory>,
    /// The published maps, sorted by estimate.
    pub maps: Vec<NamedMap>,
    /// `system_parameter.txt`, in the order of the file.
    pub system_parameter: Vec<(String, String)>,
    /// What could not be used.
    pub problems: Problems,
    /// What was read, sorted by name.
    pub provenance: Vec<Provenance>,
}
