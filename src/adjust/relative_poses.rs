//! Relative poses of a graph: what can be used of them, and their factors.

use super::error::Error;
use super::estimation::Estimation;
use super::observations::{Observations, information};
use super::options::Options;
use super::planar_pose::{PLANE, PlanarPoseFactor, is_planar};
use super::relative_pose_factor::RelativePoseFactor;
use super::summary::Reason;
use super::whitening::root;
use crate::geometry::Pose;
use crate::structure::{FrameId, GraphFactor};
use nalgebra::linalg::Cholesky;
use nalgebra::{DMatrix, Matrix3, Matrix6};
use std::collections::BTreeMap;

/// A frame as seen from another.
#[derive(Clone, Debug)]
pub(super) struct RelativeView {
    pub(super) frame: usize,
    pub(super) other: usize,
    pub(super) frame_from_other: Pose,
    pub(super) information: Option<DMatrix<f64>>,
}

impl RelativeView {
    /// Whether it keeps the plane and says nothing of what leaves it.
    pub(super) fn is_planar(&self) -> bool {
        let is_outside = |row: usize| !PLANE.contains(&row);
        is_planar(&self.frame_from_other)
            && self.information.as_ref().is_some_and(|information| {
                let mut places = (0..6).flat_map(|row| (0..6).map(move |column| (row, column)));
                places.all(|(row, column)| {
                    information[(row, column)] == 0.0 || !(is_outside(row) || is_outside(column))
                })
            })
    }
}

/// A relative pose of a graph, if it can be used.
pub(super) fn relative_view(
    factor: &GraphFactor,
    frames: &BTreeMap<FrameId, usize>,
) -> Result<RelativeView, Reason> {
    let [tx, ty, tz, qx, qy, qz, qw] = factor.measurement[..] else { return Err(Reason::NotFinite) };
    let pose = Pose::from_components([tx, ty, tz], [qx, qy, qz, qw]).map_err(|_| Reason::NotFinite)?;
    let place = |id: Option<FrameId>| id.and_then(|id| frames.get(&id).copied()).ok_or(Reason::UnknownVertex);
    let (frame, other) = (place(factor.frame_id)?, place(factor.other_frame_id)?);
    if frame == other {
        return Err(Reason::UnknownVertex);
    }
    let information = information(factor, 6, 6)?;
    Ok(RelativeView { frame, other, frame_from_other: pose, information })
}

impl Estimation {
    /// Adds the factors of relative poses.
    pub(super) fn add_relatives(
        &mut self,
        observations: &Observations,
        options: &Options,
    ) -> Result<(), Error> {
        let (mut planar, mut spatial) = (Vec::new(), Vec::new());
        for view in &observations.relatives {
            let variables = [self.poses[view.frame], self.poses[view.other]];
            if observations.planar {
                let information = view.information.as_ref();
                let information = information.map_or_else(
                    || DMatrix::identity(3, 3),
                    |all| DMatrix::from_fn(3, 3, |row, column| all[(PLANE[row], PLANE[column])]),
                );
                let root = root(&information)
                    .map_or_else(Matrix3::zeros, |root| root.fixed_view::<3, 3>(0, 0).into_owned());
                planar.push(PlanarPoseFactor::new(variables, &view.frame_from_other, &root));
            } else {
                let root = view.information.as_ref().map_or_else(Matrix6::identity, |information| {
                    let whole = Cholesky::new(information.fixed_view::<6, 6>(0, 0).into_owned());
                    let whole = whole.map(|factor| factor.l().transpose());
                    whole
                        .or_else(|| Some(root(information)?.fixed_view::<6, 6>(0, 0).into_owned()))
                        .unwrap_or_default()
                });
                spatial.push(RelativePoseFactor::new(variables, &view.frame_from_other, &root));
            }
        }
        self.problem.add_factors(planar, options.loss)?;
        self.problem.add_factors(spatial, options.loss)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{DIFFERENCES, estimation, jacobian_error, options};
    use super::super::{Method, adjust};
    use super::*;
    use crate::structure::{FactorGraph, GraphPose, PoseRow, registry};
    use nalgebra::{UnitQuaternion, Vector3, Vector6};
    use proptest::prelude::*;

    /// Two poses, and one as seen from the other with an information matrix.
    fn edge(poses: [Pose; 2], measured: &Pose, information: &Matrix6<f64>) -> FactorGraph {
        let row = |(at, pose): (i64, &Pose)| {
            GraphPose::new("g".to_owned(), FrameId(at), false, PoseRow::from(pose))
        };
        let (t, q) = measured.components();
        let upper = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
        let factor = GraphFactor {
            graph: "g".to_owned(),
            kind: registry::RELATIVE_POSE.to_owned(),
            frame_id: Some(FrameId(0)),
            other_frame_id: Some(FrameId(1)),
            measurement: t.iter().chain(&q).copied().collect(),
            information: Some(upper.map(|place| information[place]).collect()),
            ..GraphFactor::default()
        };
        FactorGraph {
            name: "g".to_owned(),
            poses: (0..).zip(&poses).map(row).collect(),
            factors: vec![factor],
            ..FactorGraph::default()
        }
    }

    fn planar(x: f64, y: f64, angle: f64) -> Pose {
        Pose::new(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle), Vector3::new(x, y, 0.0))
    }

    /// A positive definite matrix.
    fn information() -> impl Strategy<Value = Matrix6<f64>> {
        prop::collection::vec(-1.0..1.0_f64, 36).prop_map(|numbers| {
            let root = Matrix6::from_iterator(numbers);
            root.transpose() * root + Matrix6::identity() * 0.1
        })
    }

    /// `Ad(Z)` by its definition, column by column: `Z Exp(ξ) Z⁻¹`.
    fn carried(measured: &Pose, tangent: &Vector6<f64>) -> Vector6<f64> {
        let small = 1e-7;
        (*measured * Pose::exp(&(tangent * small)) * measured.inverse()).log() / small
    }

    proptest! {
        #[test]
        fn the_cost_is_that_of_twice_the_quaternion_and_the_translation(
            poses in prop::array::uniform3(prop::array::uniform6(-1.5..1.5_f64)), weights in information(),
        ) {
            let [first, second, measured] = poses.map(|tangent| Pose::exp(&Vector6::from(tangent)));
            let problem = estimation(&edge([first, second], &measured, &weights), &options(Method::PoseGraph)).problem;
            prop_assert!(jacobian_error(&problem) < DIFFERENCES);
            let ([tx, ty, tz], [x, y, z, w]) = (measured.inverse() * first.inverse() * second).components();
            let twice = 2.0 * w.signum();
            let error = carried(&measured, &Vector6::new(twice * x, twice * y, twice * z, tx, ty, tz));
            let expected = 0.5 * error.dot(&(weights * error));
            // Differences of 1e-7 leave seven digits.
            prop_assert!((problem.cost() - expected).abs() < 1e-5 * (1.0 + expected), "{} {expected}", problem.cost());
        }

        #[test]
        fn in_the_plane_the_cost_is_that_of_angle_and_translation(
            numbers in prop::array::uniform9(-3.0..3.0_f64), root in prop::array::uniform9(-1.0..1.0_f64),
        ) {
            let [a, b, angle, c, d, other_angle, x, y, measured_angle] = numbers;
            let (first, second, measured) = (planar(a, b, angle), planar(c, d, other_angle), planar(x, y, measured_angle));
            let root = Matrix3::from_row_slice(&root);
            let weights = root.transpose() * root + Matrix3::identity() * 0.1;
            let mut lifted = Matrix6::zeros();
            lifted.fixed_view_mut::<3, 3>(2, 2).copy_from(&weights);
            let graph = edge([first, second], &measured, &lifted);
            let estimation = estimation(&graph, &options(Method::PoseGraph));
            prop_assert_eq!(estimation.problem.freedom(estimation.poses[0]), 3);
            let away = other_angle - angle - measured_angle;
            let away = away - std::f64::consts::TAU * (away / std::f64::consts::TAU).round();
            prop_assume!(away.abs() < 3.1);
            prop_assert!(jacobian_error(&estimation.problem) < DIFFERENCES);
            let (t, _) = (measured.inverse() * first.inverse() * second).components();
            // Ad(Z) in the plane: a turn by θ about the origin of Z carries Z's place.
            let turned = measured.rotation() * Vector3::new(t[0], t[1], 0.0);
            let error = Vector3::new(away, turned.x + y * away, turned.y - x * away);
            let expected = 0.5 * error.dot(&(weights * error));
            prop_assert!((estimation.problem.cost() - expected).abs() < 1e-11 * (1.0 + expected));
        }
    }

    #[test]
    fn what_leaves_the_plane_is_adjusted_in_space() {
        let [first, second, measured] = [planar(0.0, 0.0, 0.3), planar(1.0, 2.0, 0.5), planar(1.1, 1.9, 0.1)];
        let mut flat = Matrix6::zeros();
        flat.fixed_view_mut::<3, 3>(2, 2).copy_from(&Matrix3::identity());
        let freedom = |graph: &FactorGraph| {
            let estimation = estimation(graph, &options(Method::PoseGraph));
            estimation.problem.freedom(estimation.poses[0])
        };
        assert_eq!(freedom(&edge([first, second], &measured, &flat)), 3);
        assert_eq!(freedom(&edge([first, second], &measured, &Matrix6::identity())), 6);
        let tilted = Pose::exp(&Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0)) * second;
        assert_eq!(freedom(&edge([first, tilted], &measured, &flat)), 6);
    }

    #[test]
    fn a_pose_in_the_plane_is_found_with_its_covariance() {
        let measured = planar(1.1, 1.9, 0.1);
        let mut flat = Matrix6::zeros();
        flat.fixed_view_mut::<3, 3>(2, 2).copy_from(&Matrix3::from_diagonal(&Vector3::new(100.0, 4.0, 25.0)));
        let graph = edge([planar(0.0, 0.0, 0.0), planar(1.0, 2.0, 0.5)], &measured, &flat);
        let options = Options { covariance: true, ..options(Method::PoseGraph) };
        let found = adjust(&graph, &options).unwrap();
        assert!(found.summary.final_cost < 1e-20, "{}", found.summary.final_cost);
        let row = &found.estimate.trajectory[1];
        assert!((row.world_from_camera().pose().unwrap() * measured.inverse()).log().norm() < 1e-10);
        // The tangent on the left of what was measured from the origin is that of the pose itself.
        let covariance = row.covariance.as_ref().unwrap();
        let mut places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column))).zip(covariance);
        let expected = [0.0, 0.0, 0.01, 0.25, 0.04, 0.0];
        assert!(
            places.all(|((row, column), number)| {
                let expected = if row == column { expected[row] } else { 0.0 };
                (number - expected).abs() < 1e-12
            }),
            "{covariance:?}"
        );
    }
}
