//! Relative errors of a trajectory: how far the motion between two of its poses is from what it should be.

use std::fmt::Display;

use super::errors::of_distance_and_angle;
use super::{Alignment, Error, Errors, Matched, Relation, Step, align};
use crate::geometry::Pose;

/// Relative pose errors of an estimate, as evo's `evo_rpe` defines them.
#[derive(Clone, Debug, PartialEq)]
pub struct Relative<I> {
    /// The two poses of each pair.
    pub pairs: Vec<[I; 2]>,
    /// The places of the second poses in the list of matched poses.
    pub ends: Vec<usize>,
    /// Distances between what both moved, metres.
    pub translation: Errors,
    /// Angles between how both turned, radians in `[0, π]`.
    pub rotation: Errors,
    /// Differences between how far both moved, metres.
    pub point_distance: Errors,
    /// How far the reference moved, metres.
    reference_m: Vec<f64>,
}

/// Relative errors of an estimated trajectory.
///
/// ```text
/// E = (y_i⁻¹ y_j)⁻¹ (x_i⁻¹ x_j),   e_translation = |trans(E)|,   e_rotation = angle(rot(E))
/// ```
///
/// with the estimate's poses x and the reference's poses y.
///
/// * `reference`, `estimate` — ids and `world_from_camera`, metres, in any order; poses with the same id are compared.
/// * `alignment` — only one that scales changes anything, so another is not made and cannot fail.
/// * `step` — which pairs; frames that are not in both are not counted.
///
/// # Errors
/// Those of [`Matched::by_id`], [`align()`] and [`Step::pairs`].
pub fn relative<I: Copy + Ord + Display>(
    reference: &[(I, Pose)],
    estimate: &[(I, Pose)],
    alignment: Alignment,
    step: Step,
) -> Result<Relative<I>, Error> {
    Relative::of(Matched::by_id(reference, estimate)?, alignment, step)
}

impl<I: Copy> Relative<I> {
    /// Relative errors of poses that are matched already, by stamp perhaps.
    ///
    /// # Errors
    /// Those of [`align()`] and [`Step::pairs`].
    pub fn of(matched: Matched<I>, alignment: Alignment, step: Step) -> Result<Self, Error> {
        let matched = if alignment.scales() {
            let reference_from_estimate = align(&matched, alignment)?;
            matched.moved(&reference_from_estimate)
        } else {
            matched
        };
        let Matched { ids, reference, estimate, .. } = &matched;
        let pairs = step.pairs(if step.of_reference { reference } else { estimate })?;
        let mut errors = [const { Vec::new() }; 3];
        let mut reference_m = Vec::with_capacity(pairs.len());
        for [begin, end] in &pairs {
            let motion = |poses: &[Pose]| poses[*begin].inverse() * poses[*end];
            let moved = |poses: &[Pose]| (poses[*end].translation() - poses[*begin].translation()).norm();
            let error = motion(reference).inverse() * motion(estimate);
            errors[0].push(error.translation().norm());
            errors[1].push(error.rotation_angle());
            errors[2].push((moved(reference) - moved(estimate)).abs());
            reference_m.push(moved(reference));
        }
        let [translation, rotation, point_distance] = errors;
        let none = || Error::NoPairs { delta: step.delta.to_string(), poses: ids.len() };
        Ok(Self {
            pairs: pairs.iter().map(|pair| pair.map(|place| ids[place])).collect(),
            ends: pairs.iter().map(|[_, end]| *end).collect(),
            translation: Errors::new(Relation::Translation, translation).ok_or_else(none)?,
            rotation: Errors::new(Relation::AngleRad, rotation).ok_or_else(none)?,
            point_distance: Errors::new(Relation::PointDistance, point_distance).ok_or_else(none)?,
            reference_m,
        })
    }

    /// The errors of any relation.
    ///
    /// Of [`Relation::PointDistanceRatio`], pairs between which the reference did not move are left out.
    ///
    /// # Errors
    /// [`Error::NoRelation`] when no pair is left.
    pub fn errors(&self, relation: Relation) -> Result<Errors, Error> {
        let found = match relation {
            Relation::PointDistance => Some(self.point_distance.clone()),
            Relation::PointDistanceRatio => {
                let values = self.point_distance.values().iter().zip(&self.reference_m);
                let moved = values.filter(|(_, moved)| **moved > 0.0);
                Errors::new(relation, moved.map(|(error, moved)| error / moved * 100.0).collect())
            }
            relation => of_distance_and_angle(relation, &self.translation, &self.rotation),
        };
        found.ok_or(Error::NoRelation { relation: relation.name(), found: "of one that stands still" })
    }
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{path, pose, similarity};
    use super::super::{Delta, Similarity};
    use super::*;
    use crate::structure::FrameId;
    use proptest::prelude::*;

    fn moved(path: &[(FrameId, Pose)], by: &Similarity) -> Vec<(FrameId, Pose)> {
        path.iter().map(|(id, pose)| (*id, by.pose(pose))).collect()
    }

    fn apart(a: &Errors, b: &Errors) -> f64 {
        assert_eq!(a.values().len(), b.values().len());
        a.values().iter().zip(b.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn where_the_world_is_does_not_matter(path in path(), other in path(), here in pose(), there in pose()) {
            let of_frames = [Step::FRAME, Step::new(Delta::Frames(3)).with_all_pairs()];
            for step in of_frames {
                let before = relative(&path, &other, Alignment::NONE, step).unwrap();
                let (reference, estimate) = (moved(&path, &here.into()), moved(&other, &there.into()));
                let after = relative(&reference, &estimate, Alignment::SE3, step).unwrap();
                for relation in Relation::ALL {
                    let difference = apart(&before.errors(relation).unwrap(), &after.errors(relation).unwrap());
                    // Rounding of coordinates up to about 30 m; the ratio divides by at least a decimetre or so.
                    prop_assert!(difference < 1e-9, "{relation:?}: {difference}");
                }
            }
        }

        #[test]
        fn a_scale_matters_unless_it_is_aligned(path in path(), by in similarity()) {
            let estimate = moved(&path, &by);
            let found = relative(&path, &estimate, Alignment::SIM3, Step::FRAME).unwrap();
            prop_assert!(found.translation.statistics().max < 1e-10);
            let found = relative(&path, &estimate, Alignment::SE3, Step::FRAME).unwrap();
            let ratio = found.errors(Relation::PointDistanceRatio).unwrap();
            let expected = (by.scale - 1.0).abs() * 100.0;
            prop_assert!(ratio.values().iter().all(|value| (value - expected).abs() < 1e-8));
        }

        #[test]
        fn a_path_moves_as_itself(path in path()) {
            let found = relative(&path, &path, Alignment::NONE, Step::FRAME).unwrap();
            for relation in Relation::ALL {
                // A path that stands still has no ratio; products whose sum is zero are added in some order.
                let most = found.errors(relation).map_or(0.0, |errors| errors.statistics().max);
                prop_assert!(most < 1e-13, "{relation:?}: {most}");
            }
        }
    }

    #[test]
    fn gaps_are_stepped_over_and_rest_has_no_ratio() {
        let path = |ids: &[i64]| ids.iter().map(|id| (FrameId(*id), Pose::identity())).collect::<Vec<_>>();
        let found = relative(&path(&[1, 2, 5, 9]), &path(&[9, 1, 5]), Alignment::SE3, Step::FRAME).unwrap();
        assert_eq!(found.pairs, [[FrameId(1), FrameId(5)], [FrameId(5), FrameId(9)]]);
        assert_eq!(found.ends, [1, 2]);
        let error = found.errors(Relation::PointDistanceRatio).unwrap_err();
        assert!(error.to_string().contains("stands still"), "{error}");
        assert!(relative(&path(&[1]), &path(&[1]), Alignment::NONE, Step::FRAME).is_err());
    }
}
