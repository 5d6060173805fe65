//! Which pose of the estimate belongs to which pose of the reference.

use std::cmp::Ordering;
use std::fmt::Display;

use super::reconstruction::listed;
use super::{Error, Similarity};
use crate::geometry::Pose;

/// Poses of a reference and an estimate that belong together, by ascending id.
///
/// An id is whatever tells poses apart: a [`crate::structure::FrameId`], or a stamp in nanoseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Matched<I> {
    /// What both poses are known by; the reference's where the two sides differ. Not empty.
    pub ids: Vec<I>,
    /// The reference's poses, `world_from_camera`.
    pub reference: Vec<Pose>,
    /// The estimate's poses, `world_from_camera`.
    pub estimate: Vec<Pose>,
    /// Poses of the reference that no pose of the estimate belongs to.
    pub missing: usize,
    /// Poses of the estimate that no pose of the reference belongs to.
    pub extra: usize,
}

impl<I: Copy + Ord + Display> Matched<I> {
    /// Poses with the same id; both lists may be in any order.
    ///
    /// # Errors
    /// [`Error::Twice`] for an id that comes twice in a list, [`Error::NotFinite`] for a pose with a number that is not
    /// finite, [`Error::NoMatch`] when no id is in both.
    pub fn by_id(reference: &[(I, Pose)], estimate: &[(I, Pose)]) -> Result<Self, Error> {
        let (left, right) = (sorted("reference", reference)?, sorted("estimate", estimate)?);
        let mut pairs = Vec::with_capacity(left.len().min(right.len()));
        let (mut i, mut j) = (0, 0);
        while let (Some(one), Some(other)) = (left.get(i), right.get(j)) {
            match one.0.cmp(&other.0) {
                Ordering::Less => i += 1,
                Ordering::Greater => j += 1,
                Ordering::Equal => {
                    pairs.push((i, j));
                    (i, j) = (i + 1, j + 1);
                }
            }
        }
        Self::new(&left, &right, &pairs)
    }

    fn new(left: &[(I, Pose)], right: &[(I, Pose)], pairs: &[(usize, usize)]) -> Result<Self, Error> {
        if pairs.is_empty() {
            return Err(Error::NoMatch { reference: left.len(), estimate: right.len() });
        }
        let used = |side: fn(&(usize, usize)) -> usize| {
            let mut places: Vec<usize> = pairs.iter().map(side).collect();
            places.sort_unstable();
            places.dedup();
            places.len()
        };
        Ok(Self {
            ids: pairs.iter().map(|(i, _)| left[*i].0).collect(),
            reference: pairs.iter().map(|(i, _)| left[*i].1).collect(),
            estimate: pairs.iter().map(|(_, j)| right[*j].1).collect(),
            missing: left.len() - used(|pair| pair.0),
            extra: right.len() - used(|pair| pair.1),
        })
    }
}

impl Matched<i64> {
    /// Poses whose stamps differ least, as evo associates them.
    ///
    /// To each pose of the shorter list (the estimate's when both are as long) belongs the pose of the longer one whose
    /// stamp is nearest, the earlier of two as near, if it is not farther than allowed. A pose of the longer list may
    /// belong to several.
    ///
    /// * `reference`, `estimate` — stamps (nanoseconds) and poses, in any order.
    /// * `most_apart_nanos` — the largest difference of two stamps that belong together; evo's default is 0.01 s.
    /// * `offset_nanos` — is added to the estimate's stamps first.
    ///
    /// # Errors
    /// Those of [`Matched::by_id`].
    pub fn by_stamp(
        reference: &[(i64, Pose)],
        estimate: &[(i64, Pose)],
        most_apart_nanos: i64,
        offset_nanos: i64,
    ) -> Result<Self, Error> {
        let (left, mut right) = (sorted("reference", reference)?, sorted("estimate", estimate)?);
        for (stamp, _) in &mut right {
            *stamp = stamp.saturating_add(offset_nanos);
        }
        let stamps = |side: &[(i64, Pose)]| side.iter().map(|(stamp, _)| *stamp).collect::<Vec<_>>();
        let most = i128::from(most_apart_nanos);
        let pairs: Vec<(usize, usize)> = if right.len() > left.len() {
            nearest(&stamps(&left), &stamps(&right), most).collect()
        } else {
            nearest(&stamps(&right), &stamps(&left), most).map(|(j, i)| (i, j)).collect()
        };
        Self::new(&left, &right, &pairs)
    }
}

impl<I> Matched<I> {
    /// The same poses, those of the estimate moved.
    #[must_use]
    pub fn moved(self, reference_from_estimate: &Similarity) -> Self {
        let estimate = self.estimate.iter().map(|pose| reference_from_estimate.pose(pose)).collect();
        Self { estimate, ..self }
    }

    /// How far along the reference's path each pose lies, metres: the sum of the distances between neighbours before it.
    #[must_use]
    pub fn path_m(&self) -> Vec<f64> {
        path_m(&self.reference)
    }
}

/// How far along a path each of its poses lies, metres.
pub(super) fn path_m(poses: &[Pose]) -> Vec<f64> {
    let mut path = 0.0;
    let steps = poses.windows(2).map(|step| (step[1].translation() - step[0].translation()).norm());
    std::iter::once(0.0)
        .chain(steps)
        .take(poses.len())
        .map(|step| {
            path += step;
            path
        })
        .collect()
}

/// Poses by ascending id, each id once, all numbers finite.
fn sorted<I: Copy + Ord + Display>(of: &'static str, poses: &[(I, Pose)]) -> Result<Vec<(I, Pose)>, Error> {
    listed(of, poses.to_vec(), |pose| {
        let ([x, y, z], [i, j, k, w]) = pose.components();
        [x, y, z, i, j, k, w]
    })
}

/// To each stamp of a list the nearest of another; both ascending.
fn nearest(few: &[i64], many: &[i64], most_apart: i128) -> impl Iterator<Item = (usize, usize)> {
    few.iter().enumerate().filter_map(move |(place, stamp)| {
        let apart = |index: usize| many.get(index).map(|other| i128::from(*other) - i128::from(*stamp));
        let after = many.partition_point(|other| other <= stamp);
        let before = after.checked_sub(1);
        let above = apart(after).map_or(i128::MAX, |difference| difference);
        let below = before.and_then(apart).map_or(i128::MAX, |difference| -difference);
        let best = if above < below { (after, above) } else { (before?, below) };
        (best.1 <= most_apart).then_some((place, best.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn stamped(stamps: &[i64]) -> Vec<(i64, Pose)> {
        stamps.iter().map(|stamp| (*stamp, Pose::identity())).collect()
    }

    #[test]
    fn what_is_in_one_list_alone_is_counted() {
        let found = Matched::by_id(&stamped(&[5, 1, 3]), &stamped(&[3, 7, 9, 5])).unwrap();
        assert_eq!((found.ids, found.missing, found.extra), (vec![3, 5], 1, 2));
    }

    #[test]
    fn the_nearest_stamp_within_reach_belongs_the_earlier_of_two() {
        let few = stamped(&[10, 20, 31, 99]);
        let many = stamped(&[8, 12, 19, 30, 50, 60]);
        let found = Matched::by_stamp(&few, &many, 3, 0).unwrap();
        assert_eq!((found.ids, found.missing, found.extra), (vec![10, 20, 31], 1, 3));
        // The reference is the longer list now: its stamps are the ids.
        let found = Matched::by_stamp(&many, &few, 3, 0).unwrap();
        assert_eq!(found.ids, [8, 19, 30]);
        let found = Matched::by_stamp(&few, &stamped(&[110, 120]), 0, -100).unwrap();
        assert_eq!(found.ids, [10, 20]);
    }

    #[test]
    fn lists_that_cannot_be_matched_are_refused() {
        let twice = Matched::by_id(&stamped(&[1, 2, 1]), &stamped(&[1]));
        assert!(matches!(twice, Err(Error::Twice { of: "reference", .. })));
        assert_eq!(
            Matched::by_stamp(&stamped(&[1]), &stamped(&[100, 200]), 10, 0),
            Err(Error::NoMatch { reference: 1, estimate: 2 })
        );
        assert!(matches!(Matched::by_id(&stamped(&[]), &stamped(&[])), Err(Error::NoMatch { .. })));
        for number in [f64::NAN, f64::INFINITY, 1e200] {
            let lost = Pose::new(nalgebra::UnitQuaternion::identity(), [0.0, number, 0.0].into());
            let found = Matched::by_id(&stamped(&[1]), &[(1, lost)]);
            assert!(matches!(found, Err(Error::NotFinite { of: "estimate", .. })), "{found:?}");
        }
    }

    proptest! {
        #[test]
        fn stamps_of_any_size_find_the_nearest(
            few in prop::collection::btree_set(any::<i64>(), 1..8),
            many in prop::collection::btree_set(any::<i64>(), 8..20),
        ) {
            let (few, many): (Vec<i64>, Vec<i64>) = (few.into_iter().collect(), many.into_iter().collect());
            let found: Vec<(usize, usize)> = nearest(&few, &many, i128::MAX).collect();
            prop_assert_eq!(found.len(), few.len());
            for (i, j) in found {
                let apart = |j: usize| (i128::from(many[j]) - i128::from(few[i])).abs();
                prop_assert!((0..many.len()).all(|other| apart(j) <= apart(other)));
            }
        }
    }
}
