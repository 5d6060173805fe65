//! How fast a camera turns, as a word.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Below this rotation between two frames, radians, a camera goes straight: 0.01 degrees.
const STILL_RAD: f64 = 0.01 / 180.0 * std::f64::consts::PI;

/// How fast a camera turns from frame to frame.
///
/// The paper speaks of "sharp/medium/slow rotational movements" without numbers; here a grade is a range of the
/// typical rotation between consecutive frames, [`typical_rotation`]:
///
/// | grade | range | a path made for it |
/// |---|---|---|
/// | slow | under 1° | 0.5° |
/// | medium | 1° to under 5° | 2° |
/// | sharp | 5° and more | 10° |
///
/// At 30 frames a second the limits are 30°/s and 150°/s. Of the paper's simulated sequences box2 (0.42°), box1
/// (0.81°) and corridor2 (0.86°) are slow, corridor1 (1.76°) is medium, sphere1 (8.0°) and sphere2 (23.5°) are sharp.
///
/// # Source
/// Open-Structure (Li et al. 2024), section III, qualitatively; the numbers are ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionGrade {
    /// Under 1 degree between frames.
    Slow,
    /// From 1 degree to under 5 degrees between frames.
    Medium,
    /// 5 degrees or more between frames.
    Sharp,
}

impl MotionGrade {
    /// Rotation between frames, radians, of a path made to have this grade.
    #[must_use]
    pub const fn rotation_rad(self) -> f64 {
        match self {
            Self::Slow => 0.5_f64.to_radians(),
            Self::Medium => 2_f64.to_radians(),
            Self::Sharp => 10_f64.to_radians(),
        }
    }

    /// The grade's name, as recipes have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slow => "slow",
            Self::Medium => "medium",
            Self::Sharp => "sharp",
        }
    }
}

/// The grade of a [`typical_rotation`] between consecutive frames, radians.
#[must_use]
pub fn grade_of(typical_rotation_rad: f64) -> MotionGrade {
    // Paths are made of rounded numbers; one made to turn by exactly 5 degrees is sharp.
    let degrees = typical_rotation_rad.to_degrees() + 1e-9;
    if degrees < 1.0 {
        MotionGrade::Slow
    } else if degrees < 5.0 {
        MotionGrade::Medium
    } else {
        MotionGrade::Sharp
    }
}

/// The median of the rotations between consecutive frames, radians, over the pairs that turn by 0.01 degrees or more.
///
/// The others are left out, for a path that goes straight half of the time, as a corridor's, would have the median 0
/// however sharp its corners are. `None` when no pair turns. Numbers that are not finite are left out too.
#[must_use]
pub fn typical_rotation(rotations_rad: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut turning: Vec<f64> =
        rotations_rad.into_iter().filter(|angle| angle.is_finite() && *angle >= STILL_RAD).collect();
    turning.sort_unstable_by(f64::total_cmp);
    let upper = *turning.get(turning.len() / 2)?;
    let lower = turning[(turning.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_made_for_a_grade_has_it() {
        for grade in [MotionGrade::Slow, MotionGrade::Medium, MotionGrade::Sharp] {
            assert_eq!(grade_of(grade.rotation_rad()), grade);
            assert_eq!(serde_json::to_value(grade).unwrap(), grade.name());
        }
    }

    #[test]
    fn the_limits_belong_to_the_faster_grade() {
        let at = |degrees: f64| grade_of(degrees.to_radians());
        assert_eq!([0.0, 0.99, 1.0].map(at), [MotionGrade::Slow, MotionGrade::Slow, MotionGrade::Medium]);
        assert_eq!([4.99, 5.0, 180.0].map(at), [MotionGrade::Medium, MotionGrade::Sharp, MotionGrade::Sharp]);
    }

    #[test]
    fn straight_stretches_do_not_count() {
        assert_eq!(typical_rotation([0.0, 0.0, 0.0, 0.1, 0.3, f64::NAN]), Some(0.2));
        assert_eq!(typical_rotation([0.3, 0.1, 0.2]), Some(0.2));
        assert_eq!(typical_rotation([0.0, 1e-5]), None);
        assert_eq!(typical_rotation([]), None);
    }
}
