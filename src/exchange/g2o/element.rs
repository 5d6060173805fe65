//! The elements of a g2o file: vertices, edges, parameters, each ids and numbers after a tag.

use std::collections::BTreeMap;

/// Kind of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum G2oKind {
    /// `PARAMS_SE3OFFSET id | pose`: a sensor on a robot.
    Offset,
    /// `PARAMS_CAMERAPARAMETERS id | f cx cy baseline`.
    CameraParameters,
    /// `PARAMS_CAMERACALIB id | pose of the camera in the vertex, fx fy cx cy`.
    CameraCalibration,
    /// `VERTEX_SE2 id | x y theta`.
    VertexSe2,
    /// `VERTEX_SE3:QUAT id | x y z qx qy qz qw`.
    VertexSe3,
    /// `VERTEX_SE3:EXPMAP id | x y z qx qy qz qw`.
    VertexExpmap,
    /// `VERTEX_CAM id | x y z qx qy qz qw fx fy cx cy baseline`.
    VertexCam,
    /// `VERTEX_TRACKXYZ id | x y z`, also called `VERTEX_XYZ` and `VERTEX_POINT_XYZ`.
    VertexPoint,
    /// `FIX id …`: vertices that are held.
    Fix,
    /// `EDGE_SE2 from to | x y theta, 6 of information`.
    EdgeSe2,
    /// `EDGE_SE3:QUAT from to | x y z qx qy qz qw, 21 of information`.
    EdgeSe3,
    /// `EDGE_PROJECT_P2MC point camera | u v, 3 of information`.
    EdgeP2mc,
    /// `EDGE_PROJECT_XYZ2UV:EXPMAP point pose parameter | u v, 3 of information`.
    EdgeXyz2uv,
    /// `EDGE_PROJECT_DEPTH pose point parameter | u v depth, 6 of information`.
    EdgeDepth,
}

/// How a kind is written: its tags (the first is written), its ids, its numbers.
pub(super) struct Layout {
    pub(super) kind: G2oKind,
    pub(super) tags: &'static [&'static str],
    /// Ids; `None` for any number of at least one.
    pub(super) ids: Option<usize>,
    pub(super) numbers: usize,
}

const fn layout(kind: G2oKind, tags: &'static [&'static str], ids: usize, numbers: usize) -> Layout {
    Layout { kind, tags, ids: Some(ids), numbers }
}

/// Every kind, in the order in which elements are written.
pub(super) const LAYOUTS: [Layout; 14] = [
    layout(G2oKind::Offset, &["PARAMS_SE3OFFSET"], 1, 7),
    layout(G2oKind::CameraParameters, &["PARAMS_CAMERAPARAMETERS"], 1, 4),
    layout(G2oKind::CameraCalibration, &["PARAMS_CAMERACALIB"], 1, 11),
    layout(G2oKind::VertexSe2, &["VERTEX_SE2"], 1, 3),
    layout(G2oKind::VertexSe3, &["VERTEX_SE3:QUAT"], 1, 7),
    layout(G2oKind::VertexExpmap, &["VERTEX_SE3:EXPMAP"], 1, 7),
    layout(G2oKind::VertexCam, &["VERTEX_CAM"], 1, 12),
    layout(G2oKind::VertexPoint, &["VERTEX_TRACKXYZ", "VERTEX_XYZ", "VERTEX_POINT_XYZ"], 1, 3),
    Layout { kind: G2oKind::Fix, tags: &["FIX"], ids: None, numbers: 0 },
    layout(G2oKind::EdgeSe2, &["EDGE_SE2"], 2, 9),
    layout(G2oKind::EdgeSe3, &["EDGE_SE3:QUAT"], 2, 28),
    layout(G2oKind::EdgeP2mc, &["EDGE_PROJECT_P2MC"], 2, 5),
    layout(G2oKind::EdgeXyz2uv, &["EDGE_PROJECT_XYZ2UV:EXPMAP", "EDGE_PROJECT_XYZ2UV"], 3, 5),
    layout(G2oKind::EdgeDepth, &["EDGE_PROJECT_DEPTH"], 3, 9),
];

/// One line of a g2o file.
#[derive(Clone, Debug, PartialEq)]
pub struct G2oElement {
    /// What it is.
    pub kind: G2oKind,
    /// Its ids: its own, or of the vertices and the parameter that it names, in the order of [`G2oKind`].
    pub ids: Vec<i64>,
    /// Its numbers, in the order of [`G2oKind`]; information is the upper triangle, row by row.
    pub numbers: Vec<f64>,
}

impl G2oElement {
    pub(super) fn new(kind: G2oKind, ids: &[i64], numbers: impl Into<Vec<f64>>) -> Self {
        Self { kind, ids: ids.to_vec(), numbers: numbers.into() }
    }

    /// Its first id: the vertex or the parameter itself.
    pub(super) fn id(&self) -> i64 {
        self.ids.first().copied().unwrap_or(-1)
    }
}

/// The lines of a g2o file, with all digits, nothing interpreted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct G2oGraph {
    /// Elements in the file's order.
    pub elements: Vec<G2oElement>,
    /// What was added to the ids of points so that they differ from those of frames; 0 where nothing was.
    ///
    /// Stands in a comment, `# open-structure point-offset N`, that other readers pass over.
    pub point_offset: i64,
    /// Lines that were passed over, by tag; not written.
    pub passed_over: BTreeMap<String, usize>,
}

impl G2oGraph {
    /// The id of a point by that of its vertex.
    pub(super) fn point_id(&self, id: i64) -> i64 {
        if self.point_offset <= id { id - self.point_offset } else { id }
    }
}
