//! A spiral from pole to pole of a sphere.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use super::attitude::Mount;
use super::bounds::{camera_angles, length, point, within};
use super::path::Path;
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::MotionGrade;

/// A spiral on a sphere from its lower to its upper pole, looking level and along the circles of latitude.
///
/// `φ = acos(−1 + (2n + 1)/N)`, `θ = √(Nπ) φ`, `t = centre + radius (cos θ sin φ, sin θ sin φ, cos φ)`,
/// `R = Rz(θ + yaw) Rx(pitch − π/2) Rz(roll)` for frame `n` of `N`. `φ` falls from π to 0, so `θ` falls too, and the
/// camera looks the way it goes. In the first release it is upside down (its y axis points up), hence the `roll_deg`
/// of 180. With 856 frames it is sphere1 of the first release, with 100 sphere2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Sphere {
    /// Number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Grade of rotation, instead of `frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionGrade>,
    /// Centre of the sphere, metres.
    pub centre_m: [f64; 3],
    /// Radius of the sphere, metres.
    pub radius_m: f64,
    /// Turns of the spiral from pole to pole; without it `√(Nπ)/2`, which spreads the frames evenly over the sphere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turns: Option<f64>,
    /// Turn of the camera to the left of the direction in which `θ` rises, degrees; 180 looks the way it goes.
    pub yaw_deg: f64,
    /// Turn of the camera upwards, degrees.
    pub pitch_deg: f64,
    /// Turn of the camera about its viewing direction, degrees; 180 is upside down.
    pub roll_deg: f64,
}

impl Default for Sphere {
    fn default() -> Self {
        Self {
            frames: None,
            motion: None,
            centre_m: [0.0; 3],
            radius_m: 2.0,
            turns: None,
            yaw_deg: 180.0,
            pitch_deg: 0.0,
            roll_deg: 180.0,
        }
    }
}

impl Path for Sphere {
    fn asked(&self) -> (Option<u64>, Option<MotionGrade>) {
        (self.frames, self.motion)
    }

    fn check(&self) -> Result<(), Error> {
        point("trajectory.centre_m", self.centre_m)?;
        length("trajectory.radius_m", self.radius_m)?;
        self.turns.map_or(Ok(()), |turns| within("trajectory.turns", turns, -10_000.0, 10_000.0))?;
        camera_angles(self.yaw_deg, self.pitch_deg, self.roll_deg)
    }

    fn fewest(&self) -> usize {
        1
    }

    fn walk(&self, frames: usize) -> Result<Vec<Pose>, Error> {
        let mount = Mount::from_degrees(self.yaw_deg, self.pitch_deg, self.roll_deg);
        let count = frames as f64;
        let winding = self.turns.map_or_else(|| (count * PI).sqrt(), |turns| 2.0 * turns);
        let pose = |n: usize| {
            let phi = libm::acos(-1.0 + (2 * n + 1) as f64 / count);
            let theta = winding * phi;
            let around = libm::sin(phi);
            let offset = Vector3::new(libm::cos(theta) * around, libm::sin(theta) * around, libm::cos(phi));
            let centre = Vector3::from(self.centre_m) + offset * self.radius_m;
            Pose::new(mount.rotation(theta, 0.0), centre)
        };
        Ok((0..frames).map(pose).collect())
    }
}
