//! A circle that rises and falls, looking at the scene in its middle.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

use super::attitude::Mount;
use super::bounds::{camera_angles, coordinate, count, length, point};
use super::path::Path;
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::MotionGrade;

/// A circle that rises and falls as a wave, looking inwards and down.
///
/// `θ = 2π n turns/N`, `w = 2π n/⌊N/waves⌋`, `t = centre + (radius cos θ, radius sin θ, amplitude cos w)`,
/// `R = Rz(θ + π/2 + yaw) Rx(pitch − π/2) Rz(roll)` for frame `n` of `N`. With 447 frames it is box1 of the first
/// release, with 856 box2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Wave {
    /// Number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Grade of rotation, instead of `frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionGrade>,
    /// Centre of the circle, metres.
    pub centre_m: [f64; 3],
    /// Radius of the circle, metres.
    pub radius_m: f64,
    /// Half the height of the wave, metres; 0 for a level circle.
    pub amplitude_m: f64,
    /// Waves on the whole path. The period is a whole number of frames, so there may be a part of one more.
    pub waves: u64,
    /// Times round the circle; negative is clockwise seen from above.
    pub turns: f64,
    /// Turn of the camera to the left of the direction to the centre's axis, degrees.
    pub yaw_deg: f64,
    /// Turn of the camera upwards, degrees; negative looks down.
    pub pitch_deg: f64,
    /// Turn of the camera about its viewing direction, degrees.
    pub roll_deg: f64,
}

impl Default for Wave {
    fn default() -> Self {
        Self {
            frames: None,
            motion: None,
            centre_m: [0.0; 3],
            radius_m: 9.0,
            amplitude_m: 1.5,
            waves: 10,
            turns: 1.0,
            yaw_deg: 0.0,
            pitch_deg: -30.0,
            roll_deg: 0.0,
        }
    }
}

impl Path for Wave {
    fn asked(&self) -> (Option<u64>, Option<MotionGrade>) {
        (self.frames, self.motion)
    }

    fn check(&self) -> Result<(), Error> {
        point("trajectory.centre_m", self.centre_m)?;
        length("trajectory.radius_m", self.radius_m)?;
        coordinate("trajectory.amplitude_m", self.amplitude_m)?;
        count("trajectory.waves", self.waves, 1, 1_000_000)?;
        super::bounds::within("trajectory.turns", self.turns, -10_000.0, 10_000.0)?;
        camera_angles(self.yaw_deg, self.pitch_deg, self.roll_deg)
    }

    fn fewest(&self) -> usize {
        usize::try_from(self.waves).unwrap_or(usize::MAX)
    }

    fn walk(&self, frames: usize) -> Result<Vec<Pose>, Error> {
        let mount = Mount::from_degrees(self.yaw_deg, self.pitch_deg, self.roll_deg);
        let period = (frames / self.fewest()) as f64;
        let pose = |n: usize| {
            let theta = TAU * self.turns * n as f64 / frames as f64;
            let wave = TAU * n as f64 / period;
            let offset = Vector3::new(
                self.radius_m * libm::cos(theta),
                self.radius_m * libm::sin(theta),
                self.amplitude_m * libm::cos(wave),
            );
            Pose::new(mount.rotation(theta + FRAC_PI_2, 0.0), Vector3::from(self.centre_m) + offset)
        };
        Ok((0..frames).map(pose).collect())
    }
}
