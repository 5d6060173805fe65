//! Straight legs and quarter turns, as through a corridor round a block.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

use super::attitude::Mount;
use super::bounds::{camera_angles, count, length, point};
use super::path::Path;
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::MotionGrade;

/// A round through a rectangular corridor, counter-clockwise: straight legs, and quarter circles at the corners.
///
/// Each of `pieces` legs and corners by turns has `P = ⌊N/pieces⌋` frames, and of its way frame `n` has gone
/// `s = (n mod P)/P`. The first leg goes along +y at `x = half_x + corner_radius`. The camera looks ahead:
/// `R = Rz(yaw of the path + yaw) Rx(pitch − π/2) Rz(roll)`. The `N − pieces·P` frames that are left over are dropped:
/// with 412 frames it is corridor1 of the first release (408 remain), with 845 corridor2 (840 remain).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Corridor {
    /// Number of frames, of which up to `pieces` − 1 are dropped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Grade of rotation (that of the corners), instead of `frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionGrade>,
    /// Centre of the round, metres.
    pub centre_m: [f64; 3],
    /// Half the length of the legs along x and along y, metres.
    pub half_leg_m: [f64; 2],
    /// Radius of the corners, metres.
    pub corner_radius_m: f64,
    /// How many legs and corners are walked; 8 is one round.
    pub pieces: u64,
    /// Turn of the camera to the left of its way, degrees.
    pub yaw_deg: f64,
    /// Turn of the camera upwards, degrees.
    pub pitch_deg: f64,
    /// Turn of the camera about its viewing direction, degrees.
    pub roll_deg: f64,
}

impl Default for Corridor {
    fn default() -> Self {
        Self {
            frames: None,
            motion: None,
            centre_m: [0.0; 3],
            half_leg_m: [6.0; 2],
            corner_radius_m: 3.0,
            pieces: 8,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
        }
    }
}

impl Path for Corridor {
    fn asked(&self) -> (Option<u64>, Option<MotionGrade>) {
        (self.frames, self.motion)
    }

    fn check(&self) -> Result<(), Error> {
        point("trajectory.centre_m", self.centre_m)?;
        self.half_leg_m.into_iter().try_for_each(|half| length("trajectory.half_leg_m", half))?;
        length("trajectory.corner_radius_m", self.corner_radius_m)?;
        count("trajectory.pieces", self.pieces, 1, 1_000_000)?;
        camera_angles(self.yaw_deg, self.pitch_deg, self.roll_deg)
    }

    fn fewest(&self) -> usize {
        usize::try_from(self.pieces).unwrap_or(usize::MAX)
    }

    fn walk(&self, frames: usize) -> Result<Vec<Pose>, Error> {
        let mount = Mount::from_degrees(self.yaw_deg, self.pitch_deg, self.roll_deg);
        let pieces = self.fewest();
        let frames_a_piece = frames / pieces;
        let pose = |n: usize| {
            let (piece, done) = (n / frames_a_piece, (n % frames_a_piece) as f64 / frames_a_piece as f64);
            let (offset, yaw) = self.place(piece % 8, done);
            Pose::new(mount.rotation(yaw, 0.0), Vector3::from(self.centre_m) + offset)
        };
        Ok((0..pieces * frames_a_piece).map(pose).collect())
    }
}

impl Corridor {
    /// Where the camera is from the centre, metres, and its yaw, radians, when this much of one of the 8 pieces is done.
    fn place(&self, piece: usize, done: f64) -> (Vector3<f64>, f64) {
        let [half_x, half_y] = self.half_leg_m;
        let radius = self.corner_radius_m;
        let side = piece / 2;
        // The corner at which a leg ends and about which a quarter circle goes.
        let corner = [(half_x, half_y), (-half_x, half_y), (-half_x, -half_y), (half_x, -half_y)][side];
        let start = side as f64 * FRAC_PI_2;
        if piece.is_multiple_of(2) {
            let (ahead, out) = [
                ((0.0, 1.0), (1.0, 0.0)),
                ((-1.0, 0.0), (0.0, 1.0)),
                ((0.0, -1.0), (-1.0, 0.0)),
                ((1.0, 0.0), (0.0, -1.0)),
            ][side];
            let back = 2.0 * if side.is_multiple_of(2) { half_y } else { half_x } * (1.0 - done);
            let offset = Vector3::new(
                corner.0 + radius * out.0 - back * ahead.0,
                corner.1 + radius * out.1 - back * ahead.1,
                0.0,
            );
            return (offset, start);
        }
        let turned = start + done * FRAC_PI_2;
        let offset =
            Vector3::new(corner.0 + radius * libm::cos(turned), corner.1 + radius * libm::sin(turned), 0.0);
        (offset, turned)
    }
}
