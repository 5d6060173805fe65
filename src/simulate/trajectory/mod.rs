//! Paths of a camera.
//!
//! The world's z axis points up. A camera that is level and has the yaw 0 looks along +y, with +x to its right; yaw
//! turns it to the left (counter-clockwise seen from above), pitch upwards, roll clockwise in its own view.

mod arc_length;
mod attitude;
mod bounds;
mod control_points;
mod corridor;
mod cubic_spline;
mod figure_eight;
mod file;
mod look;
mod path;
mod random_spline;
mod sphere;
#[cfg(test)]
mod tests;
mod wave;
mod waypoints;

use std::path::Path as FilePath;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;
use crate::geometry::Pose;
use bounds::within;

pub use bounds::MOST_FRAMES;
pub use corridor::Corridor;
pub use figure_eight::{FigureEight, Lemniscate};
pub use file::File;
pub use look::{Look, WaypointLook};
pub use random_spline::RandomSpline;
pub use sphere::Sphere;
pub use wave::Wave;
pub use waypoints::{Waypoint, Waypoints};

/// The path of the camera.
///
/// Kinds with both `frames` and `motion` take one of them: the number of frames, or the grade of rotation between
/// frames that the number is chosen for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Trajectory {
    /// A circle that rises and falls; box1 and box2.
    Wave(Wave),
    /// A spiral on a sphere; sphere1 and sphere2.
    Sphere(Sphere),
    /// Straight legs and quarter turns; corridor1 and corridor2.
    Corridor(Corridor),
    /// A figure of eight.
    FigureEight(FigureEight),
    /// A smooth random path with bounds on speed and turn rate.
    Random(RandomSpline),
    /// A spline through given positions.
    Waypoints(Waypoints),
    /// A trajectory file.
    File(File),
}

/// A pose and when the camera had it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedPose {
    /// When, nanoseconds.
    pub stamp_nanos: i64,
    /// The pose of the camera, metres.
    pub world_from_camera: Pose,
}

impl Trajectory {
    /// The poses, one for each frame.
    ///
    /// * `rate_hz` — frames a second; the first frame has the stamp 0. A file with stamps keeps its own.
    /// * `seed` — for the random path.
    /// * `folder` — where relative names of files begin.
    ///
    /// # Errors
    /// [`Error::Value`] with a place such as `trajectory.radius_m` for a parameter that makes no path;
    /// [`Error::Io`] and [`Error::Content`] for a file.
    pub fn poses(&self, rate_hz: f64, seed: u64, folder: &FilePath) -> Result<Vec<TimedPose>, Error> {
        within("rate_hz", rate_hz, 0.01, 1e6)?;
        let poses = match self {
            Self::Wave(wave) => path::poses(wave)?,
            Self::Sphere(sphere) => path::poses(sphere)?,
            Self::Corridor(corridor) => path::poses(corridor)?,
            Self::FigureEight(eight) => path::poses(eight)?,
            Self::Waypoints(waypoints) => path::poses(waypoints)?,
            Self::Random(spline) => spline.poses(rate_hz, seed)?,
            Self::File(file) => return file.poses(rate_hz, folder),
        };
        Ok((0..)
            .zip(poses)
            .map(|(n, pose)| TimedPose { stamp_nanos: stamp_nanos(n, rate_hz), world_from_camera: pose })
            .collect())
    }
}

/// When frame `n` is taken: `n / rate`, rounded to the nanosecond.
#[expect(clippy::cast_possible_truncation, reason = "at most 1e7 frames at 0.01 Hz are 1e18 ns")]
fn stamp_nanos(n: usize, rate_hz: f64) -> i64 {
    (n as f64 * 1e9 / rate_hz).round() as i64
}
