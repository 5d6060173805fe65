//! Absolute errors of a trajectory: how far its poses are from where they should be.

use std::fmt::Display;

use super::errors::of_distance_and_angle;
use super::{Alignment, Error, Errors, Matched, Relation, Similarity, align};
use crate::geometry::Pose;

/// Absolute pose errors of an estimate, as evo's `evo_ape` defines them.
///
/// `E_i = x_i⁻¹ y_i` with the estimate's aligned pose x and the reference's pose y.
#[derive(Clone, Debug, PartialEq)]
pub struct Absolute<I> {
    /// What the poses are known by, ascending.
    pub ids: Vec<I>,
    /// How far along the reference's path each pose lies, metres.
    pub path_m: Vec<f64>,
    /// The matched poses, the estimate's aligned.
    pub aligned: Matched<I>,
    /// What laid the estimate on the reference.
    pub reference_from_estimate: Similarity,
    /// Distances between positions, metres.
    pub translation: Errors,
    /// Angles between attitudes, radians in `[0, π]`; accurate to rounding near 0 and near π.
    pub rotation: Errors,
    /// Poses of the reference that the estimate does not have.
    pub missing: usize,
    /// Poses of the estimate that the reference does not have.
    pub extra: usize,
}

/// Absolute errors of an estimated trajectory.
///
/// ```text
/// E_i = x_i⁻¹ y_i,   e_translation = |trans(E_i)|,   e_rotation = angle(rot(E_i))
/// ```
///
/// * `reference`, `estimate` — ids and `world_from_camera`, metres, in any order; poses with the same id are compared.
/// * `alignment` — what may be moved before; [`Alignment::SE3`] is usual.
///
/// # Errors
/// Those of [`Matched::by_id`] and [`align()`].
pub fn absolute<I: Copy + Ord + Display>(
    reference: &[(I, Pose)],
    estimate: &[(I, Pose)],
    alignment: Alignment,
) -> Result<Absolute<I>, Error> {
    Absolute::of(Matched::by_id(reference, estimate)?, alignment)
}

impl<I: Copy> Absolute<I> {
    /// Absolute errors of poses that are matched already, by stamp perhaps.
    ///
    /// # Errors
    /// Those of [`align()`].
    pub fn of(matched: Matched<I>, alignment: Alignment) -> Result<Self, Error> {
        let reference_from_estimate = align(&matched, alignment)?;
        let aligned = matched.moved(&reference_from_estimate);
        let pairs = || aligned.estimate.iter().zip(&aligned.reference);
        let distances = pairs().map(|(x, y)| (y.translation() - x.translation()).norm()).collect();
        let angles = pairs().map(|(x, y)| (x.inverse() * *y).rotation_angle()).collect();
        let none = || Error::NoMatch { reference: aligned.missing, estimate: aligned.extra };
        Ok(Self {
            ids: aligned.ids.clone(),
            path_m: aligned.path_m(),
            reference_from_estimate,
            translation: Errors::new(Relation::Translation, distances).ok_or_else(none)?,
            rotation: Errors::new(Relation::AngleRad, angles).ok_or_else(none)?,
            missing: aligned.missing,
            extra: aligned.extra,
            aligned,
        })
    }

    /// The errors of any relation.
    ///
    /// # Errors
    /// [`Error::NoRelation`] for [`Relation::PointDistanceRatio`].
    pub fn errors(&self, relation: Relation) -> Result<Errors, Error> {
        let found = match relation {
            Relation::PointDistance => Errors::new(relation, self.translation.values().to_vec()),
            relation => of_distance_and_angle(relation, &self.translation, &self.rotation),
        };
        found.ok_or(Error::NoRelation { relation: relation.name(), found: "absolute" })
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{path, pose, similarity};
    use super::*;
    use crate::structure::FrameId;
    use proptest::prelude::*;

    /// Rounding of coordinates up to about 30 m, metres.
    const ROUNDING_M: f64 = 1e-12;

    fn moved(path: &[(FrameId, Pose)], by: &Similarity) -> Vec<(FrameId, Pose)> {
        path.iter().map(|(id, pose)| (*id, by.pose(pose))).collect()
    }

    /// Largest difference of two lists of errors.
    fn apart(a: &Errors, b: &Errors) -> f64 {
        a.values().iter().zip(b.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn a_path_has_no_error_against_itself(path in path(), by in similarity()) {
            let found = absolute(&path, &path, Alignment::NONE).unwrap();
            for relation in Relation::ALL {
                if let Ok(errors) = found.errors(relation) {
                    // Products whose sum is zero are added in some order.
                    prop_assert!(errors.statistics().max < 1e-13);
                }
            }
            let found = absolute(&path, &moved(&path, &by), Alignment::SIM3).unwrap();
            prop_assert!(found.translation.statistics().max < ROUNDING_M * 100.0);
            prop_assert!(found.rotation.statistics().max < 1e-11);
        }

        #[test]
        fn moving_the_estimate_changes_nothing_after_alignment(path in path(), other in path(), by in similarity()) {
            let rigid = Similarity { scale: 1.0, ..by };
            for (alignment, by) in [(Alignment::SE3, rigid), (Alignment::ORIGIN, rigid), (Alignment::SIM3, by)] {
                let Ok(before) = absolute(&path, &other, alignment) else { continue };
                let after = absolute(&path, &moved(&other, &by), alignment).unwrap();
                // A covariance of unrelated paths may be nearly singular, which multiplies rounding.
                prop_assert!(apart(&before.translation, &after.translation) < 1e-8);
                prop_assert!(apart(&before.rotation, &after.rotation) < 1e-8);
            }
        }

        #[test]
        fn without_alignment_both_sides_are_alike(path in path(), other in path()) {
            let there = absolute(&path, &other, Alignment::NONE).unwrap();
            let back = absolute(&other, &path, Alignment::NONE).unwrap();
            prop_assert_eq!(there.translation, back.translation);
            prop_assert!(apart(&there.rotation, &back.rotation) < 1e-14);
        }

        #[test]
        fn the_first_poses_agree_after_alignment_at_the_origin(path in path(), other in path()) {
            let found = absolute(&path, &other, Alignment::ORIGIN).unwrap();
            prop_assert!(found.translation.values()[0] < ROUNDING_M);
            prop_assert!(found.rotation.values()[0] < 1e-14);
        }

        #[test]
        fn a_turn_of_any_size_is_its_angle(pose in pose(), exponent in -16.0..0.0_f64, axis in 0..3_usize) {
            for angle in [10_f64.powf(exponent), std::f64::consts::PI - 10_f64.powf(exponent)] {
                let mut tangent = nalgebra::Vector6::zeros();
                tangent[axis] = angle;
                let turned = pose * Pose::exp(&tangent);
                let found = absolute(&[(FrameId(0), pose)], &[(FrameId(0), turned)], Alignment::NONE).unwrap();
                // Rounding of quaternions, radians.
                prop_assert!((found.rotation.values()[0] - angle).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn one_pose_has_an_error_without_alignment_alone() {
        let one = [(FrameId(7), Pose::identity())];
        let found = absolute(&one, &one, Alignment::NONE).unwrap();
        assert_eq!((found.ids.as_slice(), found.path_m.as_slice()), (&[FrameId(7)][..], &[0.0][..]));
        assert!(matches!(absolute(&one, &one, Alignment::SE3), Err(Error::Degenerate { poses: 1, .. })));
        let error = found.errors(Relation::PointDistanceRatio).unwrap_err();
        assert!(error.to_string().contains("relative"), "{error}");
    }
}
