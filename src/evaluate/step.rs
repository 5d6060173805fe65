//! Which pairs of poses relative errors are taken over.

use std::fmt;

use super::Error;
use super::association::path_m;
use crate::geometry::Pose;

/// The most poses among which all pairs of an angle are searched: their number grows with the square.
pub const LARGEST_ANGLE_SEARCH: usize = 20_000;

/// The most pairs of an angle that are compared.
const MOST_PAIRS: usize = 10_000_000;

/// How far the two poses of a pair are apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Delta {
    /// So many matched poses further on; at least 1.
    Frames(usize),
    /// So far along the path, metres.
    Metres(f64),
    /// So much turning, degrees in `[0, 180]`.
    Degrees(f64),
    /// So much turning, radians in `[0, π]`.
    Radians(f64),
}

impl fmt::Display for Delta {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frames(1) => write!(formatter, "1 frame"),
            Self::Frames(count) => write!(formatter, "{count} frames"),
            Self::Metres(distance) => write!(formatter, "{distance} m"),
            Self::Degrees(angle) => write!(formatter, "{angle} deg"),
            Self::Radians(angle) => write!(formatter, "{angle} rad"),
        }
    }
}

/// Which pairs of poses are compared, as evo chooses them.
///
/// *Consecutive* pairs follow each other without overlap: a pair ends at the first pose by which the distance since its
/// begin, along the path or summed over the turns, is `delta` or more; there the next one begins. *All pairs* begin at every
/// pose: with `Frames` at the pose so many further on; with `Metres` at the one whose distance along the path is nearest to
/// `delta`, if it is within the tolerance; with an angle at every later pose whose direct angle is within the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// How far the two poses of a pair are apart.
    pub delta: Delta,
    /// Whether pairs begin at every pose.
    pub all_pairs: bool,
    /// By what part of `delta` the distance may differ, with all pairs of metres or angles; evo's default is 0.1.
    pub tolerance: f64,
    /// Whether distances are those of the reference, not those of the estimate; evo's default is not.
    pub of_reference: bool,
}

impl Step {
    /// From each frame to the next.
    pub const FRAME: Self = Self::new(Delta::Frames(1));

    /// Consecutive pairs, with evo's defaults.
    #[must_use]
    pub const fn new(delta: Delta) -> Self {
        Self { delta, all_pairs: false, tolerance: 0.1, of_reference: false }
    }

    /// The same with all pairs.
    #[must_use]
    pub const fn with_all_pairs(self) -> Self {
        Self { all_pairs: true, ..self }
    }

    /// Places of the poses of each pair.
    ///
    /// # Errors
    /// [`Error::Delta`] for a distance that is none, [`Error::TooManyPoses`] for all pairs of an angle among more than
    /// [`LARGEST_ANGLE_SEARCH`] poses, [`Error::TooManyPairs`] for more than ten million of them, [`Error::NoPairs`] when there is none.
    pub fn pairs(&self, poses: &[Pose]) -> Result<Vec<[usize; 2]>, Error> {
        let pairs = match self.delta {
            Delta::Frames(0) => return Err(Error::Delta { expected: "at least 1 frame", found: 0.0 }),
            Delta::Frames(count) if self.all_pairs => {
                (count..poses.len()).map(|end| [end - count, end]).collect()
            }
            Delta::Frames(count) => {
                let begins: Vec<usize> = (0..poses.len()).step_by(count).collect();
                begins.windows(2).map(|pair| [pair[0], pair[1]]).collect()
            }
            Delta::Metres(distance) => {
                let distance = within(distance, f64::MAX, "a distance of 0 m or more")?;
                if self.all_pairs {
                    by_path(&path_m(poses), distance, distance * self.tolerance)
                } else {
                    consecutive(poses, distance, |before, here| {
                        (here.translation() - before.translation()).norm()
                    })
                }
            }
            Delta::Degrees(angle) => {
                let angle = within(angle, 180.0, "an angle from 0 to 180 deg")?;
                self.by_angle(poses, angle.to_radians(), MOST_PAIRS)?
            }
            Delta::Radians(angle) => {
                let angle = within(angle, std::f64::consts::PI, "an angle from 0 to pi rad")?;
                self.by_angle(poses, angle, MOST_PAIRS)?
            }
        };
        if pairs.is_empty() {
            return Err(Error::NoPairs { delta: self.delta.to_string(), poses: poses.len() });
        }
        Ok(pairs)
    }

    fn by_angle(&self, poses: &[Pose], angle: f64, most: usize) -> Result<Vec<[usize; 2]>, Error> {
        if !self.all_pairs {
            return Ok(consecutive(poses, angle, angle_between));
        }
        if poses.len() > LARGEST_ANGLE_SEARCH {
            return Err(Error::TooManyPoses { most: LARGEST_ANGLE_SEARCH, found: poses.len() });
        }
        let reach = angle * self.tolerance;
        let wanted = angle - reach..=angle + reach;
        let mut pairs = Vec::new();
        for (begin, pose) in poses.iter().enumerate() {
            let ends =
                (begin + 1..poses.len()).filter(|end| wanted.contains(&angle_between(pose, &poses[*end])));
            pairs.extend(ends.map(|end| [begin, end]));
            if pairs.len() > most {
                return Err(Error::TooManyPairs { delta: self.delta.to_string(), most });
            }
        }
        Ok(pairs)
    }
}

fn within(number: f64, most: f64, expected: &'static str) -> Result<f64, Error> {
    // Written so that NaN is refused.
    if (0.0..=most).contains(&number) { Ok(number) } else { Err(Error::Delta { expected, found: number }) }
}

fn angle_between(before: &Pose, here: &Pose) -> f64 {
    (before.inverse() * *here).rotation_angle()
}

/// Pairs that follow each other, each as long as it must be for the sum of its steps.
fn consecutive(poses: &[Pose], delta: f64, step: impl Fn(&Pose, &Pose) -> f64) -> Vec<[usize; 2]> {
    let (mut begin, mut sum) = (0, 0.0);
    let mut pairs = Vec::new();
    for (end, both) in (1..).zip(poses.windows(2)) {
        sum += step(&both[0], &both[1]);
        if sum >= delta {
            pairs.push([begin, end]);
            (begin, sum) = (end, 0.0);
        }
    }
    pairs
}

/// From every place of a path to the later one that is nearest to `distance` away, the first of several as near.
fn by_path(path: &[f64], distance: f64, tolerance: f64) -> Vec<[usize; 2]> {
    let off = |begin: usize, end: usize| ((path[end] - path[begin]) - distance).abs();
    (0..path.len().saturating_sub(1))
        .filter_map(|begin| {
            let far = path.partition_point(|place| place - path[begin] < distance).max(begin + 1);
            let after = (far < path.len()).then_some(far);
            // The first of those that lie as far as the last one before.
            let before = (far > begin + 1)
                .then(|| path.partition_point(|place| *place < path[far - 1]).max(begin + 1));
            let end = match (before, after) {
                (Some(before), Some(after)) if off(begin, after) < off(begin, before) => after,
                (Some(before), _) => before,
                (None, after) => after?,
            };
            (off(begin, end) <= tolerance).then_some([begin, end])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::strategies::pose;
    use super::*;
    use proptest::prelude::*;

    fn on_a_line(places: &[f64]) -> Vec<Pose> {
        places.iter().map(|x| Pose::from_components([*x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()).collect()
    }

    #[test]
    fn frames_follow_each_other_or_overlap() {
        let poses = on_a_line(&[0.0; 6]);
        let step = Step::new(Delta::Frames(2));
        assert_eq!(step.pairs(&poses).unwrap(), [[0, 2], [2, 4]]);
        assert_eq!(step.with_all_pairs().pairs(&poses).unwrap(), [[0, 2], [1, 3], [2, 4], [3, 5]]);
        assert_eq!(
            Step::new(Delta::Frames(6)).pairs(&poses).unwrap_err().to_string(),
            "expected pairs of poses 6 frames apart, found none among 6 poses"
        );
    }

    #[test]
    fn metres_are_summed_or_looked_for() {
        let poses = on_a_line(&[0.0, 0.6, 1.0, 1.0, 2.1, 5.0]);
        let step = Step::new(Delta::Metres(1.0));
        assert_eq!(step.pairs(&poses).unwrap(), [[0, 2], [2, 4], [4, 5]]);
        assert_eq!(step.with_all_pairs().pairs(&poses).unwrap(), [[0, 2]]);
        let wide = Step { tolerance: 0.7, ..step.with_all_pairs() };
        assert_eq!(wide.pairs(&poses).unwrap(), [[0, 2], [1, 4], [2, 4], [3, 4]]);
    }

    #[test]
    fn distances_that_are_none_are_refused() {
        for delta in [
            Delta::Frames(0),
            Delta::Metres(-1.0),
            Delta::Metres(f64::NAN),
            Delta::Metres(f64::INFINITY),
            Delta::Degrees(180.1),
            Delta::Radians(3.15),
        ] {
            let found = Step::new(delta).pairs(&on_a_line(&[0.0, 1.0]));
            assert!(matches!(found, Err(Error::Delta { .. })), "{delta}");
        }
        for delta in [Delta::Frames(usize::MAX), Delta::Metres(9.0), Delta::Degrees(90.0)] {
            for step in [Step::new(delta), Step::new(delta).with_all_pairs()] {
                for places in [&[][..], &[1.0][..], &[1.0, 2.0][..]] {
                    assert!(matches!(step.pairs(&on_a_line(places)), Err(Error::NoPairs { .. })), "{delta}");
                }
            }
        }
        let still = [Pose::identity(); 9];
        let step = Step::new(Delta::Degrees(0.0)).with_all_pairs();
        assert_eq!(step.by_angle(&still, 0.0, 36).map(|pairs| pairs.len()), Ok(36));
        assert!(matches!(step.by_angle(&still, 0.0, 35), Err(Error::TooManyPairs { most: 35, .. })));
        let many = vec![Pose::identity(); LARGEST_ANGLE_SEARCH + 1];
        let found = Step::new(Delta::Degrees(1.0)).with_all_pairs().pairs(&many);
        assert!(matches!(found, Err(Error::TooManyPoses { .. })));
    }

    proptest! {
        #[test]
        fn the_place_nearest_to_a_distance_is_the_one_a_search_of_all_finds(
            steps in prop::collection::vec(prop_oneof![Just(0.0), Just(0.5), 0.0..1.0_f64], 1..25),
            distance in prop_oneof![Just(0.0), Just(1.0), 0.0..4.0_f64],
        ) {
            let mut path = vec![0.0];
            for step in steps {
                path.push(path[path.len() - 1] + step);
            }
            let expected: Vec<[usize; 2]> = (0..path.len() - 1)
                .map(|begin| {
                    let off = |end: &usize| (path[*end] - path[begin] - distance).abs();
                    let best = (begin + 1..path.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
                    [begin, best]
                })
                .collect();
            prop_assert_eq!(by_path(&path, distance, f64::MAX), expected);
        }

        #[test]
        fn angles_of_all_pairs_are_within_reach(poses in prop::collection::vec(pose(), 2..12), angle in 10.0..170.0_f64) {
            let step = Step::new(Delta::Degrees(angle)).with_all_pairs();
            for [begin, end] in step.pairs(&poses).unwrap_or_default() {
                let found = angle_between(&poses[begin], &poses[end]).to_degrees();
                prop_assert!(begin < end && (found - angle).abs() <= 0.1 * angle + 1e-12);
            }
        }
    }
}
