//! Which way a camera is turned: yaw, pitch and roll.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// Rotations of the camera against the direction that its path asks for, radians.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mount {
    yaw: f64,
    pitch: f64,
    roll: f64,
}

impl Mount {
    pub(super) fn from_degrees(yaw: f64, pitch: f64, roll: f64) -> Self {
        Self { yaw: yaw.to_radians(), pitch: pitch.to_radians(), roll: roll.to_radians() }
    }

    /// The camera's rotation where its path asks for this yaw and pitch, radians.
    pub(super) fn rotation(&self, yaw: f64, pitch: f64) -> UnitQuaternion<f64> {
        attitude(yaw + self.yaw, pitch + self.pitch, self.roll)
    }
}

/// The rotation `world_from_camera` of a camera: `Rz(yaw) Rx(pitch − π/2) Rz(roll)`, radians.
pub(super) fn attitude(yaw: f64, pitch: f64, roll: f64) -> UnitQuaternion<f64> {
    let half = |angle: f64| (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    let (sz, cz) = half(yaw);
    let (sx, cx) = half(pitch - FRAC_PI_2);
    let (sr, cr) = half(roll);
    let turned = Quaternion::new(cz, 0.0, 0.0, sz) * Quaternion::new(cx, sx, 0.0, 0.0);
    UnitQuaternion::new_normalize(turned * Quaternion::new(cr, 0.0, 0.0, sr))
}

/// Yaw and pitch, radians, of a direction; of a vertical one, which has no yaw, only the pitch.
pub(super) fn yaw_and_pitch(direction: &Vector3<f64>) -> (Option<f64>, f64) {
    let level = (direction.x * direction.x + direction.y * direction.y).sqrt();
    let yaw = (level > 1e-9 * direction.z.abs()).then(|| libm::atan2(-direction.x, direction.y));
    (yaw, libm::atan2(direction.z, level))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_camera_looks_where_it_is_told(x in -5.0..5.0_f64, y in -5.0..5.0_f64, z in -5.0..5.0_f64) {
            let direction = Vector3::new(x, y, z);
            prop_assume!(direction.norm() > 0.1);
            let (yaw, pitch) = yaw_and_pitch(&direction);
            let rotation = attitude(yaw.unwrap_or(0.0), pitch, 0.0);
            // Rounding, of unit vectors.
            prop_assert!((rotation * Vector3::z() - direction.normalize()).norm() < 1e-14);
            // Level: its x axis is horizontal, and its y axis never points up.
            prop_assert!((rotation * Vector3::x()).z.abs() < 1e-15);
            prop_assert!((rotation * Vector3::y()).z < 1e-15);
        }
    }

    #[test]
    fn yaw_turns_left_pitch_up_and_roll_clockwise() {
        let near = |found: Vector3<f64>, expected: [f64; 3]| {
            assert!((found - Vector3::from(expected)).norm() < 1e-15, "{found}");
        };
        let level = attitude(0.0, 0.0, 0.0);
        near(level * Vector3::z(), [0.0, 1.0, 0.0]);
        near(level * Vector3::x(), [1.0, 0.0, 0.0]);
        near(level * Vector3::y(), [0.0, 0.0, -1.0]);
        near(attitude(FRAC_PI_2, 0.0, 0.0) * Vector3::z(), [-1.0, 0.0, 0.0]);
        near(attitude(0.0, FRAC_PI_2, 0.0) * Vector3::z(), [0.0, 0.0, 1.0]);
        near(attitude(0.0, 0.0, FRAC_PI_2) * Vector3::x(), [0.0, 0.0, -1.0]);
        assert_eq!(yaw_and_pitch(&Vector3::z()), (None, FRAC_PI_2));
    }
}
