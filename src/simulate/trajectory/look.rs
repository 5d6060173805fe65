//! Where a camera looks that follows a curve.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attitude::yaw_and_pitch;
use super::bounds::point;
use crate::simulate::Error;

/// Where the camera looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Look {
    /// Along the path.
    #[default]
    #[serde(rename = "forward")]
    Forward,
    /// At this point, metres.
    #[serde(rename = "target_m")]
    Target([f64; 3]),
}

/// Where the camera looks between waypoints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum WaypointLook {
    /// Along the path.
    #[default]
    #[serde(rename = "forward")]
    Forward,
    /// At this point, metres.
    #[serde(rename = "target_m")]
    Target([f64; 3]),
    /// As each waypoint's `yaw_deg` and `pitch_deg` say, and smoothly between them.
    #[serde(rename = "waypoint")]
    Waypoint,
}

impl Look {
    pub(super) fn check(&self) -> Result<(), Error> {
        match self {
            Self::Forward => Ok(()),
            Self::Target(target) => point("trajectory.look.target_m", *target),
        }
    }

    /// Yaw and pitch, radians, of a camera at a position that moves in a direction.
    ///
    /// * `before` — yaw and pitch of the frame before, kept where the direction has none.
    ///
    /// # Errors
    /// [`Error::Value`] for a camera in its own target.
    pub(super) fn angles(
        &self,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        before: (f64, f64),
    ) -> Result<(f64, f64), Error> {
        let direction = match self {
            Self::Forward => *velocity,
            Self::Target(target) => Vector3::from(*target) - position,
        };
        if direction.amax() < 1e-9 {
            return match self {
                Self::Forward => Ok(before),
                Self::Target(_) => {
                    Err(Error::value("trajectory.look.target_m", "a point beside the path", "one on it"))
                }
            };
        }
        let (yaw, pitch) = yaw_and_pitch(&direction);
        Ok((yaw.unwrap_or(before.0), pitch))
    }
}
