//! From a factor graph to g2o.

use std::collections::{BTreeMap, BTreeSet};

use super::element::{G2oElement, G2oGraph, G2oKind};
use super::information;
use crate::exchange::remark::Remarks;
use crate::exchange::{Error, Remark};
use crate::geometry::Pose;
use crate::structure::{
    Camera, CameraId, FactorGraph, FrameId, GraphFactor, MeasurementNoise, PoseRow, registry,
};

/// How poses are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum G2oForm {
    /// In the plane where every pose and every factor is in it, otherwise in space.
    #[default]
    AsItIs,
    /// In the plane; what leaves it is projected.
    Plane,
    /// In space.
    Space,
}

/// A factor graph as a g2o graph.
///
/// Relative poses become `EDGE_SE2` or `EDGE_SE3:QUAT`. Points become `EDGE_PROJECT_P2MC` of `VERTEX_CAM`, or, where one
/// has depth or there are relative poses, `EDGE_PROJECT_DEPTH` of `VERTEX_SE3:QUAT`: g2o's bundle adjustment knows no
/// depth, and each edge ties vertices of one kind. A point without depth then has information of zero there. Both hold any
/// focal lengths, fy below 0 included. Where a factor has no information, the noise of the graph gives it; a depth of
/// other than constant noise has that noise at the depth that was measured.
///
/// Lines and parallelism have no place in g2o and are left out. A point whose id is a frame's too gets another, see
/// [`G2oGraph::point_offset`].
///
/// # Errors
/// [`Error::Unfit`] for a graph without a pose or without factors that could be written, a pose or a measurement that is
/// no rigid transform, a frame without camera, a factor whose vertices are not there, or one without its numbers.
pub fn to_g2o(graph: &FactorGraph, form: G2oForm) -> Result<(G2oGraph, Vec<Remark>), Error> {
    let mut remarks = Remarks::default();
    let kinds = |kind: &'static str| graph.factors.iter().filter(move |factor| factor.kind == kind);
    let known = [registry::RELATIVE_POSE, registry::POINT_REPROJECTION];
    let left_out = graph.factors.iter().filter(|factor| !known.contains(&factor.kind.as_str())).count();
    remarks.lost(left_out, "factors of lines or of other kinds are left out: g2o has no tag for them");
    remarks.lost(graph.lines.len(), "lines are left out: g2o has no tag for them");
    if left_out == graph.factors.len() {
        let expected = "relative poses or points seen in frames";
        return Err(Error::unfit(format!("graph `{}`", graph.name), expected, "no such factor"));
    }
    let has_points = !graph.points.is_empty() || kinds(registry::POINT_REPROJECTION).next().is_some();
    let has_depth = kinds(registry::POINT_REPROJECTION).any(|factor| factor.measurement.len() > 2);
    let is_flat = !has_points
        && graph.poses.iter().all(|row| is_planar(&row.world_from_camera()))
        && kinds(registry::RELATIVE_POSE).all(is_planar_factor);
    let plane = match form {
        G2oForm::AsItIs => is_flat,
        G2oForm::Plane if has_points => {
            let expected = "no points, for the plane";
            return Err(Error::unfit(format!("graph `{}`", graph.name), expected, "points"));
        }
        G2oForm::Plane => true,
        G2oForm::Space => false,
    };
    let poses = match (plane, has_points) {
        (true, _) => G2oKind::VertexSe2,
        (false, true) if !has_depth && kinds(registry::RELATIVE_POSE).next().is_none() => G2oKind::VertexCam,
        (false, _) => G2oKind::VertexSe3,
    };
    if plane && !is_flat {
        let away = graph.poses.iter().filter(|row| !is_planar(&row.world_from_camera())).count();
        let factors = kinds(registry::RELATIVE_POSE).filter(|factor| !is_planar_factor(factor)).count();
        remarks.lost(away + factors, "poses and relative poses that leave the plane were projected into it");
    }
    let mut export = Export {
        graph,
        cameras: graph.cameras.iter().map(|camera| (camera.camera_id, camera)).collect(),
        pose_ids: graph.poses.iter().map(|row| row.frame_id).collect(),
        point_ids: graph.points.iter().map(|row| row.point_id.0).collect(),
        elements: Vec::new(),
        point_offset: 0,
        poses,
    };
    export.point_offset = export.offset();
    export.vertices()?;
    for factor in &graph.factors {
        if factor.kind == registry::RELATIVE_POSE {
            export.relative(factor, &mut remarks)?;
        } else if factor.kind == registry::POINT_REPROJECTION {
            export.view(factor)?;
        }
    }
    remarks.said(
        if export.point_offset > 0 { graph.points.len() } else { 0 },
        format!("points got ids larger by {}, for frames have theirs", export.point_offset),
    );
    let model = G2oGraph {
        elements: export.elements,
        point_offset: export.point_offset,
        passed_over: BTreeMap::new(),
    };
    Ok((model, remarks.into_vec()))
}

struct Export<'a> {
    graph: &'a FactorGraph,
    cameras: BTreeMap<CameraId, &'a Camera>,
    pose_ids: BTreeSet<FrameId>,
    point_ids: BTreeSet<i64>,
    elements: Vec<G2oElement>,
    point_offset: i64,
    /// Kind of the pose vertices.
    poses: G2oKind,
}

impl Export<'_> {
    /// A power of ten above every frame id, where frames and points share an id; otherwise 0.
    fn offset(&self) -> i64 {
        if !self.pose_ids.iter().any(|frame| self.point_ids.contains(&frame.0)) {
            return 0;
        }
        let largest = self.pose_ids.last().map_or(0, |frame| frame.0);
        let mut offset = 10_i64;
        while offset <= largest && offset < i64::MAX / 10 {
            offset *= 10;
        }
        offset
    }

    fn vertices(&mut self) -> Result<(), Error> {
        let used: BTreeSet<CameraId> =
            self.pose_ids.iter().filter_map(|frame| self.graph.camera_of_frame.get(frame).copied()).collect();
        if self.poses == G2oKind::VertexSe3 && !self.graph.points.is_empty() {
            for camera in used.iter().filter_map(|id| self.cameras.get(id)) {
                let mut numbers = vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
                numbers.extend([camera.fx, camera.fy, camera.cx, camera.cy]);
                let id = camera.camera_id.0;
                self.elements.push(G2oElement::new(G2oKind::CameraCalibration, &[id], numbers));
            }
        }
        for row in &self.graph.poses {
            let pose = row.world_from_camera();
            checked(&pose, || row.frame_id.to_string())?;
            let mut numbers = pose.numbers().to_vec();
            match self.poses {
                G2oKind::VertexSe2 => numbers = flattened(&pose).to_vec(),
                G2oKind::VertexCam => {
                    let camera = self.camera(row.frame_id)?;
                    numbers.extend([camera.fx, camera.fy, camera.cx, camera.cy, 0.0]);
                }
                _ => {}
            }
            self.elements.push(G2oElement::new(self.poses, &[row.frame_id.0], numbers));
        }
        for row in &self.graph.points {
            let id = self.point(row.point_id.0)?;
            if ![row.x, row.y, row.z].iter().all(|number| number.is_finite()) {
                return Err(Error::unfit(row.point_id.to_string(), "finite numbers", "others"));
            }
            self.elements.push(G2oElement::new(G2oKind::VertexPoint, &[id], [row.x, row.y, row.z]));
        }
        let fixed: Vec<i64> =
            self.graph.poses.iter().filter(|row| row.fixed).map(|row| row.frame_id.0).collect();
        if !fixed.is_empty() {
            self.elements.push(G2oElement::new(G2oKind::Fix, &fixed, []));
        }
        Ok(())
    }

    fn relative(&mut self, factor: &GraphFactor, remarks: &mut Remarks) -> Result<(), Error> {
        let what = || format!("factor {} of graph `{}`", factor.factor_id, self.graph.name);
        let (Some(from), Some(to)) = (factor.frame_id, factor.other_frame_id) else {
            return Err(Error::unfit(what(), "two frames", "fewer"));
        };
        if let Some(missing) = [from, to].into_iter().find(|frame| !self.pose_ids.contains(frame)) {
            return Err(Error::unfit(what(), format!("{missing} among the poses"), "none"));
        }
        let measured = <[f64; 7]>::try_from(factor.measurement.as_slice())
            .map(PoseRow::from_numbers)
            .map_err(|_| Error::unfit(what(), "7 numbers", factor.measurement.len()))?;
        let pose = checked(&measured, what)?;
        let identity = upper_of_identity(6);
        let ours = if let Some(numbers) = factor.information.as_deref() {
            finite(numbers, 21, what)?
        } else {
            remarks.said(1, "relative poses without information got the identity, 1/rad² and 1/m²");
            identity.as_slice()
        };
        let (kind, mut numbers, weights) = if self.poses == G2oKind::VertexSe2 {
            let flat = flattened(&measured);
            (G2oKind::EdgeSe2, flat.to_vec(), information::to_plane(&pose, ours))
        } else {
            (G2oKind::EdgeSe3, measured.numbers().to_vec(), information::to_space(&pose, ours))
        };
        numbers.extend(weights);
        self.elements.push(G2oElement::new(kind, &[from.0, to.0], numbers));
        Ok(())
    }

    fn view(&mut self, factor: &GraphFactor) -> Result<(), Error> {
        let what = || format!("factor {} of graph `{}`", factor.factor_id, self.graph.name);
        let (Some(frame), Some(point)) = (factor.frame_id, factor.point_id) else {
            return Err(Error::unfit(what(), "a frame and a point", "fewer"));
        };
        if !self.pose_ids.contains(&frame) || !self.point_ids.contains(&point.0) {
            return Err(Error::unfit(what(), format!("{frame} and {point} among the vertices"), "none"));
        }
        let id = self.point(point.0)?;
        let seen = finite(&factor.measurement, factor.measurement.len(), what)?;
        let (pixel, depth) = match seen {
            [u, v] => ([*u, *v], None),
            [u, v, depth] => ([*u, *v], Some(*depth)),
            _ => return Err(Error::unfit(what(), "2 or 3 numbers", seen.len())),
        };
        let (depth, weights) = weights(factor, depth, &self.graph.noise, what)?;
        let element = if self.poses == G2oKind::VertexCam {
            let numbers = [pixel[0], pixel[1], weights[0], weights[1], weights[3]];
            G2oElement::new(G2oKind::EdgeP2mc, &[id, frame.0], numbers)
        } else {
            let camera = self.camera(frame)?.camera_id.0;
            // Any depth will do where nothing is said about it.
            let mut numbers = vec![pixel[0], pixel[1], depth.unwrap_or(1.0)];
            numbers.extend(weights);
            G2oElement::new(G2oKind::EdgeDepth, &[frame.0, id, camera], numbers)
        };
        self.elements.push(element);
        Ok(())
    }

    fn camera(&self, frame: FrameId) -> Result<&Camera, Error> {
        let id = self.graph.camera_of_frame.get(&frame);
        let camera = id.and_then(|id| self.cameras.get(id).copied());
        camera.ok_or_else(|| Error::unfit(frame.to_string(), "a camera", "none"))
    }

    fn point(&self, id: i64) -> Result<i64, Error> {
        id.checked_add(self.point_offset)
            .ok_or_else(|| Error::unfit(format!("point {id}"), "an id below 2^63", "a larger one"))
    }
}

/// The depth that was meant, and information over u, v, depth: 6 numbers, zero where nothing is said.
///
/// From the factor, or from the noise of the graph.
fn weights(
    factor: &GraphFactor,
    depth: Option<f64>,
    noise: &MeasurementNoise,
    what: impl Fn() -> String,
) -> Result<(Option<f64>, [f64; 6]), Error> {
    let pixel = 1.0 / (noise.sigma_px * noise.sigma_px);
    match (factor.information.as_deref(), depth) {
        (Some(numbers), None) => {
            let numbers = finite(numbers, 3, what)?;
            Ok((None, [numbers[0], numbers[1], 0.0, numbers[2], 0.0, 0.0]))
        }
        (Some(numbers), Some(_)) => {
            let numbers = finite(numbers, 6, what)?;
            Ok((depth, std::array::from_fn(|place| numbers[place])))
        }
        (None, _) => {
            let meant = depth.and_then(|depth| noise.depth(depth));
            let along = meant.map_or(0.0, |(_, sigma)| 1.0 / (sigma * sigma));
            Ok((meant.map(|(depth, _)| depth), [pixel, 0.0, 0.0, pixel, 0.0, along]))
        }
    }
}

/// Numbers as they are, if they are finite and as many as they should be.
fn finite(numbers: &[f64], count: usize, what: impl Fn() -> String) -> Result<&[f64], Error> {
    if numbers.len() != count || numbers.iter().any(|number| !number.is_finite()) {
        return Err(Error::unfit(what(), format!("{count} finite numbers"), format!("{numbers:?}")));
    }
    Ok(numbers)
}

fn checked(pose: &PoseRow, what: impl Fn() -> String) -> Result<Pose, Error> {
    pose.pose().map_err(|error| Error::unfit(what(), "a rigid transform", error))
}

fn upper_of_identity(side: usize) -> Vec<f64> {
    (0..side).flat_map(|row| (row..side).map(move |column| if row == column { 1.0 } else { 0.0 })).collect()
}

fn is_planar(pose: &PoseRow) -> bool {
    let [_, _, z, qx, qy, _, _] = pose.numbers();
    [z, qx, qy] == [0.0; 3]
}

/// Whether a relative pose keeps the plane and says nothing of what leaves it.
fn is_planar_factor(factor: &GraphFactor) -> bool {
    let Ok(numbers) = <[f64; 7]>::try_from(factor.measurement.as_slice()) else { return false };
    let outside = [0, 1, 5];
    is_planar(&PoseRow::from_numbers(numbers))
        && factor.information.as_deref().is_some_and(|numbers| {
            let places = (0..6).flat_map(|row| (row..6).map(move |column| [row, column]));
            numbers.len() == 21
                && places
                    .zip(numbers)
                    .all(|(place, number)| *number == 0.0 || !place.iter().any(|at| outside.contains(at)))
        })
}

/// x, y and the angle about z, radians in (−π, π].
pub(super) fn flattened(pose: &PoseRow) -> [f64; 3] {
    let [x, y, _, _, _, qz, qw] = pose.numbers();
    // Of the two quaternions of a rotation, the one with the real part above 0.
    let sign = if qw < 0.0 || (qw == 0.0 && qz < 0.0) { -1.0 } else { 1.0 };
    [x, y, 2.0 * libm::atan2(sign * qz, sign * qw)]
}
