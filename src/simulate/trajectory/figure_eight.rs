//! A figure of eight.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

use super::arc_length::{ArcLength, Curve};
use super::attitude::Mount;
use super::bounds::{camera_angles, coordinate, count, length, point};
use super::look::Look;
use super::path::Path;
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::MotionGrade;

/// Cells in which a lemniscate is measured; its length is then exact to 1e-12 of itself.
const CELLS: usize = 1024;

/// A horizontal figure of eight along x, with its crossing in the centre.
///
/// Gerono's lemniscate `(a cos t, a sin t cos t, h sin t)` or Bernoulli's
/// `(a cos t, a sin t cos t)/(1 + sin² t), h sin t`, with `a` the half width and `h` the rise. It begins at +x and goes
/// along +y; the path closes without a frame twice. The rise takes the two ways apart where they cross.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FigureEight {
    /// Number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Grade of rotation, instead of `frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionGrade>,
    /// Which curve.
    pub shape: Lemniscate,
    /// The crossing, metres.
    pub centre_m: [f64; 3],
    /// From the crossing to either end, metres.
    pub half_width_m: f64,
    /// How far one way passes the crossing above the centre, and the other below, metres.
    pub rise_m: f64,
    /// Times round the figure.
    pub laps: u64,
    /// Whether the speed is constant; otherwise `t` grows evenly.
    pub constant_speed: bool,
    /// Where the camera looks: `"forward"`, or `{ target_m = [x, y, z] }`.
    pub look: Look,
    /// Turn of the camera to the left, degrees.
    pub yaw_deg: f64,
    /// Turn of the camera upwards, degrees.
    pub pitch_deg: f64,
    /// Turn of the camera about its viewing direction, degrees.
    pub roll_deg: f64,
}

/// Curves in the shape of an eight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lemniscate {
    /// `x⁴ = a² (x² − y²)`, half as wide as long.
    #[default]
    Gerono,
    /// `(x² + y²)² = a² (x² − y²)`, slimmer.
    Bernoulli,
}

impl Default for FigureEight {
    fn default() -> Self {
        Self {
            frames: None,
            motion: None,
            shape: Lemniscate::Gerono,
            centre_m: [0.0; 3],
            half_width_m: 4.0,
            rise_m: 0.0,
            laps: 1,
            constant_speed: true,
            look: Look::Forward,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
        }
    }
}

impl Path for FigureEight {
    fn asked(&self) -> (Option<u64>, Option<MotionGrade>) {
        (self.frames, self.motion)
    }

    fn check(&self) -> Result<(), Error> {
        point("trajectory.centre_m", self.centre_m)?;
        length("trajectory.half_width_m", self.half_width_m)?;
        coordinate("trajectory.rise_m", self.rise_m)?;
        count("trajectory.laps", self.laps, 1, 1_000_000)?;
        self.look.check()?;
        camera_angles(self.yaw_deg, self.pitch_deg, self.roll_deg)
    }

    fn fewest(&self) -> usize {
        1
    }

    fn walk(&self, frames: usize) -> Result<Vec<Pose>, Error> {
        let mount = Mount::from_degrees(self.yaw_deg, self.pitch_deg, self.roll_deg);
        let lengths = ArcLength::new(self, CELLS);
        let mut angles = (0.0, 0.0);
        (0..frames)
            .map(|n| {
                // Whole numbers keep the laps alike to the last bit.
                let laps = u128::from(self.laps);
                let within_lap = (n as u128 * laps) % frames as u128;
                let lap = within_lap as f64 / frames as f64;
                let t = if self.constant_speed { lengths.parameter(lap) } else { lap };
                let (position, velocity) = self.at(t);
                angles = self.look.angles(&position, &velocity, angles)?;
                Ok(Pose::new(mount.rotation(angles.0, angles.1), position))
            })
            .collect()
    }
}

impl Curve for FigureEight {
    fn at(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (sine, cosine) = (libm::sin(TAU * t), libm::cos(TAU * t));
        let (x, y, dx, dy) = match self.shape {
            Lemniscate::Gerono => (cosine, sine * cosine, -sine, cosine * cosine - sine * sine),
            Lemniscate::Bernoulli => {
                let below = 1.0 + sine * sine;
                let change = 2.0 * sine * cosine;
                (
                    cosine / below,
                    sine * cosine / below,
                    (-sine * below - cosine * change) / (below * below),
                    ((cosine * cosine - sine * sine) * below - sine * cosine * change) / (below * below),
                )
            }
        };
        let offset = Vector3::new(self.half_width_m * x, self.half_width_m * y, self.rise_m * sine);
        let velocity = Vector3::new(self.half_width_m * dx, self.half_width_m * dy, self.rise_m * cosine);
        (Vector3::from(self.centre_m) + offset, velocity * TAU)
    }
}
