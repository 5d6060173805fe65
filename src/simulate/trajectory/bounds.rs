//! Which parameters make sense.

use crate::simulate::Error;

/// The most frames of a trajectory.
pub const MOST_FRAMES: usize = 10_000_000;

/// The longest length of a scene, metres.
pub(super) const LONGEST_M: f64 = 1e6;

/// A number in a range; not NaN.
pub(super) fn within(place: &str, value: f64, low: f64, high: f64) -> Result<(), Error> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(Error::value(place, format!("a number from {low} to {high}"), value))
}

/// A length that is not zero, from a micrometre to [`LONGEST_M`].
pub(super) fn length(place: &str, value: f64) -> Result<(), Error> {
    within(place, value, 1e-6, LONGEST_M)
}

/// A coordinate or a length of either sign.
pub(super) fn coordinate(place: &str, value: f64) -> Result<(), Error> {
    within(place, value, -LONGEST_M, LONGEST_M)
}

/// A point.
pub(super) fn point(place: &str, [x, y, z]: [f64; 3]) -> Result<(), Error> {
    [x, y, z].into_iter().try_for_each(|value| coordinate(place, value))
}

/// An angle, degrees, of up to ten turns.
pub(super) fn angle(place: &str, value: f64) -> Result<(), Error> {
    within(place, value, -3600.0, 3600.0)
}

/// The angles by which a camera is turned on its path, degrees.
pub(super) fn camera_angles(yaw: f64, pitch: f64, roll: f64) -> Result<(), Error> {
    angle("trajectory.yaw_deg", yaw)?;
    angle("trajectory.pitch_deg", pitch)?;
    angle("trajectory.roll_deg", roll)
}

/// A whole number from `low` to `high`.
pub(super) fn count(place: &str, value: u64, low: u64, high: u64) -> Result<(), Error> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Error::value(place, format!("a whole number from {low} to {high}"), value))
}
