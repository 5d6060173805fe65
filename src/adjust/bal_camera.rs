//! A camera with intrinsics of its own, as Bundle Adjustment in the Large has them, and how a step moves it.

use super::parametrisation::{Parametrisation, PoseSpace, quaternion, translation};
use crate::geometry::Pose;
use nalgebra::{UnitQuaternion, Vector3, Vector6};

/// Numbers of a pose, before the intrinsics.
const POSE: usize = 16;

/// `camera_from_world` by the numbers of [`PoseSpace`], focal length f (px) and radial coefficients k1, k2: nine degrees of freedom.
///
/// Steps are `[rotation; translation; f; k1; k2]`: `R ← Exp(ω) R`, `t ← t + v`, and sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BalCameraSpace;

impl BalCameraSpace {
    /// The numbers of a camera.
    ///
    /// * `camera` — rotation vector of `R` (rad), `t`, f, k1, k2, as in a file of BAL.
    #[must_use]
    pub fn numbers_of(camera: &[f64; 9]) -> [f64; 19] {
        let [wx, wy, wz, tx, ty, tz, intrinsics @ ..] = camera;
        let turn = Pose::exp(&Vector6::new(*wx, *wy, *wz, 0.0, 0.0, 0.0)).rotation();
        let mut numbers = [0.0; 19];
        numbers[..POSE]
            .copy_from_slice(&PoseSpace::numbers_of(&Pose::new(turn, Vector3::new(*tx, *ty, *tz))));
        numbers[POSE..].copy_from_slice(intrinsics);
        numbers
    }

    /// The camera of the numbers: rotation vector of at most half a turn, translation, f, k1, k2.
    #[must_use]
    pub fn camera_of(numbers: &[f64]) -> [f64; 9] {
        let turn = Pose::new(UnitQuaternion::new_normalize(quaternion(numbers)), Vector3::zeros()).log();
        let mut camera = [0.0; 9];
        camera[..3].copy_from_slice(&turn.as_slice()[..3]);
        camera[3..6].copy_from_slice(translation(numbers).as_slice());
        camera[6..].copy_from_slice(intrinsics(numbers));
        camera
    }
}

/// f, k1 and k2 of a camera's numbers.
pub(super) fn intrinsics(numbers: &[f64]) -> &[f64] {
    &numbers[POSE..]
}

impl Parametrisation for BalCameraSpace {
    fn is_pose(&self) -> bool {
        true
    }
    fn numbers(&self) -> usize {
        POSE + 3
    }
    fn freedom(&self) -> usize {
        9
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let turn = Pose::exp(&Vector6::new(step[0], step[1], step[2], 0.0, 0.0, 0.0)).rotation();
        let turned = UnitQuaternion::new_normalize(turn.into_inner() * quaternion(numbers));
        let shifted = translation(numbers) + Vector3::new(step[3], step[4], step[5]);
        moved[..POSE].copy_from_slice(&PoseSpace::numbers_of(&Pose::new(turned, shifted)));
        for place in 0..3 {
            moved[POSE + place] = numbers[POSE + place] + step[6 + place];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_camera_comes_back_from_its_numbers(turn in prop::array::uniform3(-1.5..1.5), rest in prop::array::uniform6(-5.0..5.0)) {
            let mut camera = [0.0; 9];
            camera[..3].copy_from_slice(&turn);
            camera[3..].copy_from_slice(&rest);
            let found = BalCameraSpace::camera_of(&BalCameraSpace::numbers_of(&camera));
            // Rotations go through a quaternion.
            prop_assert!(camera.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?}");
        }

        #[test]
        fn a_step_turns_on_the_left_and_adds_to_the_rest(step in prop::array::uniform9(-0.5..0.5)) {
            let before = BalCameraSpace::numbers_of(&[0.3, -0.2, 0.1, 1.0, 2.0, 3.0, 500.0, -0.1, 0.01]);
            let mut after = [0.0; 19];
            BalCameraSpace.plus(&before, &step, &mut after);
            let turn = Pose::exp(&Vector6::new(step[0], step[1], step[2], 0.0, 0.0, 0.0));
            let expected = turn * Pose::new(PoseSpace::pose_of(&before).rotation(), Vector3::zeros());
            let found = Pose::new(PoseSpace::pose_of(&after).rotation(), Vector3::zeros());
            prop_assert!((found * expected.inverse()).log().norm() < 1e-14);
            for place in 0..3 {
                prop_assert_eq!(after[place], before[place] + step[3 + place]);
                prop_assert_eq!(after[POSE + place], before[POSE + place] + step[6 + place]);
            }
        }
    }
}
