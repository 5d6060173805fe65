//! From a g2o graph to a sequence.

use std::collections::{BTreeMap, BTreeSet};

use super::element::{G2oElement, G2oGraph, G2oKind};
use super::information;
use crate::exchange::Error;
use crate::exchange::imported::{Draft, ImportNames, Imported};
use crate::geometry::{PinholeCamera, Pose};
use crate::structure::{Camera, CameraId, FrameId, GraphFactor, PointId, PoseRow, registry};

/// A g2o graph as a sequence: a frame for each pose, a point for each point, a factor for each edge.
///
/// Poses and measurements keep their digits (SE(2) is lifted: z, roll and pitch are zero); information, taken to be per
/// radian, is turned to the registry's tangent, and is zero for z, roll and pitch of SE(2), where g2o says nothing. Ids are those of the file
/// (less [`G2oGraph::point_offset`] for points). Frames are a second apart.
///
/// # Errors
/// [`Error::Unfit`] for an id that is given twice, an edge to a vertex that is not there or of another kind, a
/// quaternion without length, a focal length that is no pinhole camera's, a camera that is not where its vertex is, or a
/// pose seen through two cameras.
pub fn from_g2o(graph: &G2oGraph, names: &ImportNames) -> Result<Imported, Error> {
    let mut import = Import {
        draft: Draft { graph: names.graph.clone(), ..Draft::default() },
        vertices: BTreeMap::new(),
        parameters: BTreeMap::new(),
        cameras: BTreeMap::new(),
        graph,
    };
    for (tag, count) in &graph.passed_over {
        import
            .draft
            .remarks
            .lost(*count, format!("lines `{tag}` were passed over: not known, or nothing here says it"));
    }
    let fixed: BTreeSet<i64> = graph
        .elements
        .iter()
        .filter(|element| element.kind == G2oKind::Fix)
        .flat_map(|element| element.ids.iter().copied())
        .collect();
    for element in &graph.elements {
        import.vertex(element)?;
    }
    for (id, element) in import.vertices.clone() {
        import.add_vertex(id, element, fixed.contains(&id))?;
    }
    let unknown = fixed.iter().filter(|id| !import.vertices.contains_key(*id)).count();
    import.draft.remarks.lost(unknown, "vertices that FIX names are not there");
    let points_fixed = import
        .vertices
        .iter()
        .filter(|(id, element)| element.kind == G2oKind::VertexPoint && fixed.contains(*id))
        .count();
    import.draft.remarks.lost(points_fixed, "points that FIX holds are free here: a graph holds poses alone");
    for element in &graph.elements {
        import.edge(element)?;
    }
    import.draft.guess_sizes();
    Ok(import.draft.finish("g2o", names))
}

struct Import<'a> {
    draft: Draft,
    vertices: BTreeMap<i64, &'a G2oElement>,
    parameters: BTreeMap<i64, &'a G2oElement>,
    /// Cameras by the bits of fx, fy, cx, cy.
    cameras: BTreeMap<[u64; 4], CameraId>,
    graph: &'a G2oGraph,
}

impl<'a> Import<'a> {
    /// Remembers a vertex or a parameter under its id.
    fn vertex(&mut self, element: &'a G2oElement) -> Result<(), Error> {
        use G2oKind::{
            CameraCalibration, CameraParameters, Offset, VertexCam, VertexExpmap, VertexPoint, VertexSe2,
            VertexSe3,
        };
        let (word, known) = match element.kind {
            Offset | CameraParameters | CameraCalibration => ("parameter", &mut self.parameters),
            VertexSe2 | VertexSe3 | VertexExpmap | VertexCam | VertexPoint => ("vertex", &mut self.vertices),
            _ => return Ok(()),
        };
        match known.insert(element.id(), element) {
            None => Ok(()),
            Some(_) => Err(Error::unfit(format!("{word} {}", element.id()), "one of this id", "two")),
        }
    }

    fn add_vertex(&mut self, id: i64, element: &G2oElement, fixed: bool) -> Result<(), Error> {
        match (element.kind, element.numbers.as_slice()) {
            (G2oKind::VertexPoint, [x, y, z]) => {
                let point = self.point(id);
                self.draft.add_point(point.0, [*x, *y, *z]);
            }
            (G2oKind::VertexSe2, [x, y, theta]) => self.draft.add_pose(id, fixed, lifted(*x, *y, *theta))?,
            (_, pose) => {
                self.draft.add_pose(id, fixed, pose_row(pose))?;
                if let [_, _, _, _, _, _, _, fx, fy, cx, cy, _] = element.numbers.as_slice() {
                    self.camera(FrameId(id), [*fx, *fy, *cx, *cy])?;
                }
            }
        }
        Ok(())
    }

    fn edge(&mut self, element: &G2oElement) -> Result<(), Error> {
        use G2oKind::{
            EdgeDepth, EdgeP2mc, EdgeSe2, EdgeSe3, EdgeXyz2uv, VertexCam, VertexExpmap, VertexPoint,
            VertexSe2, VertexSe3,
        };
        let (ids, numbers) = (element.ids.as_slice(), element.numbers.as_slice());
        match (element.kind, ids, numbers) {
            (EdgeSe2, [from, to], [x, y, theta, weights @ ..]) => {
                self.check(element, &[(*from, VertexSe2), (*to, VertexSe2)])?;
                let measured = lifted(*x, *y, *theta);
                self.relative([*from, *to], measured, |pose| information::from_plane(pose, weights))
            }
            (EdgeSe3, [from, to], [tx, ty, tz, qx, qy, qz, qw, weights @ ..]) => {
                self.check(element, &[(*from, VertexSe3), (*to, VertexSe3)])?;
                let measured = PoseRow::from_numbers([*tx, *ty, *tz, *qx, *qy, *qz, *qw]);
                self.relative([*from, *to], measured, |pose| information::from_space(pose, weights))
            }
            (EdgeP2mc, [point, frame], [u, v, weights @ ..]) => {
                self.check(element, &[(*point, VertexPoint), (*frame, VertexCam)])?;
                self.view(*frame, *point, &[*u, *v], weights);
                Ok(())
            }
            (EdgeXyz2uv, [point, frame, parameter], [u, v, weights @ ..]) => {
                self.check(element, &[(*point, VertexPoint), (*frame, VertexExpmap)])?;
                let numbers = self.parameter(*parameter, G2oKind::CameraParameters)?;
                if let [f, cx, cy, _] = numbers {
                    self.camera(FrameId(*frame), [*f, *f, *cx, *cy])?;
                }
                self.view(*frame, *point, &[*u, *v], weights);
                Ok(())
            }
            (EdgeDepth, [frame, point, parameter], [u, v, depth, weights @ ..]) => {
                self.check(element, &[(*frame, VertexSe3), (*point, VertexPoint)])?;
                let numbers = self.parameter(*parameter, G2oKind::CameraCalibration)?;
                if let [offset @ .., fx, fy, cx, cy] = numbers {
                    if offset[..6].iter().any(|number| *number != 0.0) || offset[6] == 0.0 {
                        let what = format!("parameter {parameter}");
                        return Err(Error::unfit(what, "a camera where its vertex is", "one beside it"));
                    }
                    self.camera(FrameId(*frame), [*fx, *fy, *cx, *cy])?;
                }
                match weights {
                    // Nothing is said about depth.
                    [uu, uv, ud, vv, vd, dd] if [ud, vd, dd].iter().all(|number| **number == 0.0) => {
                        self.view(*frame, *point, &[*u, *v], &[*uu, *uv, *vv]);
                    }
                    _ => self.view(*frame, *point, &[*u, *v, *depth], weights),
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Checks that the vertices of an edge are there and of the kinds that it ties.
    fn check(&self, edge: &G2oElement, expected: &[(i64, G2oKind)]) -> Result<(), Error> {
        for (id, kind) in expected {
            let found = self.vertices.get(id).map(|vertex| vertex.kind);
            if found != Some(*kind) {
                let found = found.map_or("none".to_owned(), |kind| format!("a {kind:?}"));
                let what = format!("an {:?} of {:?}: vertex {id}", edge.kind, edge.ids);
                return Err(Error::unfit(what, format!("a {kind:?}"), found));
            }
        }
        Ok(())
    }

    fn relative(
        &mut self,
        [from, to]: [i64; 2],
        measured: PoseRow,
        information: impl Fn(&Pose) -> Vec<f64>,
    ) -> Result<(), Error> {
        let what = || format!("edge from {from} to {to}");
        if from == to {
            return Err(Error::unfit(what(), "two vertices", "one"));
        }
        let measured = self.draft.unit(measured, what)?;
        let pose = measured.pose().map_err(|error| Error::unfit(what(), "a rigid transform", error))?;
        let information = information(&pose);
        if information.iter().any(|number| !number.is_finite()) {
            return Err(Error::unfit(what(), "information within the range of numbers", "too large"));
        }
        self.draft.factors.push(GraphFactor {
            frame_id: Some(FrameId(from)),
            other_frame_id: Some(FrameId(to)),
            measurement: measured.numbers().to_vec(),
            information: Some(information),
            ..self.draft.factor(registry::RELATIVE_POSE)
        });
        Ok(())
    }

    fn view(&mut self, frame: i64, point: i64, measurement: &[f64], information: &[f64]) {
        let point = self.point(point);
        self.draft.add_view(FrameId(frame), point, measurement.to_vec(), Some(information.to_vec()));
    }

    fn point(&self, id: i64) -> PointId {
        PointId(self.graph.point_id(id))
    }

    fn parameter(&self, id: i64, kind: G2oKind) -> Result<&'a [f64], Error> {
        match self.parameters.get(&id) {
            Some(parameter) if parameter.kind == kind => Ok(&parameter.numbers),
            found => {
                let found = found.map_or("none".to_owned(), |parameter| format!("{:?}", parameter.kind));
                Err(Error::unfit(format!("parameter {id}"), format!("{kind:?}"), found))
            }
        }
    }

    /// Says which camera took a frame.
    fn camera(&mut self, frame: FrameId, [fx, fy, cx, cy]: [f64; 4]) -> Result<(), Error> {
        let next = CameraId(i64::try_from(self.cameras.len()).unwrap_or(i64::MAX));
        let id = *self.cameras.entry([fx, fy, cx, cy].map(f64::to_bits)).or_insert(next);
        if id == next {
            if fx <= 0.0 || fy == 0.0 {
                let expected = "focal lengths fx above 0 and fy not 0";
                return Err(Error::unfit(
                    format!("camera of {frame}"),
                    expected,
                    format!("{fx:?} and {fy:?}"),
                ));
            }
            let pinhole = PinholeCamera { fx, fy, cx, cy, width: 1, height: 1 };
            self.draft.cameras.push(Camera::pinhole(id, &pinhole, registry::PIXEL_CENTER));
        }
        match self.draft.camera_of_frame.insert(frame, id) {
            Some(other) if other != id => Err(Error::unfit(
                frame.to_string(),
                "one camera for each pose",
                "two of different intrinsics",
            )),
            _ => Ok(()),
        }
    }
}

fn pose_row(numbers: &[f64]) -> PoseRow {
    let mut pose = [0.0; 7];
    for (to, from) in pose.iter_mut().zip(numbers) {
        *to = *from;
    }
    PoseRow::from_numbers(pose)
}

/// A pose in the plane as one in space.
fn lifted(x: f64, y: f64, theta: f64) -> PoseRow {
    let half = 0.5 * theta;
    PoseRow { translation: [x, y, 0.0], rotation_xyzw: [0.0, 0.0, libm::sin(half), libm::cos(half)] }
}
