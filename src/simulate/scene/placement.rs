//! Where an object stands.

use nalgebra::{Point3, UnitQuaternion, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::simulate::Error;

/// A place and a turn in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Placement {
    /// Where the object's origin goes, `world`, metres.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m", "x-space" = "world"))]
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw, degrees: the object is turned about x, then y, then z of the world.
    #[serde(default)]
    #[schemars(extend("x-unit" = "deg"))]
    pub roll_pitch_yaw_deg: [f64; 3],
}

impl Placement {
    /// The transform `world_from_object`.
    #[must_use]
    pub fn world_from_object(&self) -> Pose {
        let about = |axis: Vector3<f64>, degrees: f64| {
            let turn = axis * degrees.to_radians();
            Pose::exp(&Vector6::new(turn.x, turn.y, turn.z, 0.0, 0.0, 0.0)).rotation()
        };
        let [roll, pitch, yaw] = self.roll_pitch_yaw_deg;
        let rotation: UnitQuaternion<f64> =
            about(Vector3::z(), yaw) * about(Vector3::y(), pitch) * about(Vector3::x(), roll);
        Pose::new(rotation, self.position_m.into())
    }

    /// Looks at the numbers.
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_numbers(&format!("{place}.position_m"), &self.position_m, -1e6, 1e6, "m")?;
        check_numbers(
            &format!("{place}.roll_pitch_yaw_deg"),
            &self.roll_pitch_yaw_deg,
            -3600.0,
            3600.0,
            "deg",
        )
    }
}

/// Corners in the object's own space, taken to the world.
pub(super) fn placed<const N: usize>(world_from_object: &Pose, corners: [[f64; 3]; N]) -> [Point3<f64>; N] {
    corners.map(|corner| *world_from_object * Point3::from(corner))
}

/// Holds numbers to a range.
pub(crate) fn check_numbers(
    place: &str,
    numbers: &[f64],
    low: f64,
    high: f64,
    unit: &str,
) -> Result<(), Error> {
    match numbers.iter().find(|number| !(low..=high).contains(*number)) {
        Some(found) => Err(Error::value(place, format!("{low} to {high} {unit}"), found)),
        None => Ok(()),
    }
}
