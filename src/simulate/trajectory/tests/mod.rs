//! Trajectories as recipes have them: read from TOML, walked, and held against what they promise.

mod bounds;
mod curves;
mod formulas;
mod published;
mod recipes;

use super::*;

const FOLDER: &str = "";

/// A trajectory from a recipe's text.
fn trajectory(text: &str) -> Trajectory {
    toml::from_str(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// Its poses at 30 Hz.
fn walk(text: &str) -> Vec<TimedPose> {
    trajectory(text).poses(30.0, 1, FilePath::new(FOLDER)).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// Why it has no poses.
fn refusal(text: &str) -> Error {
    trajectory(text).poses(30.0, 1, FilePath::new(FOLDER)).expect_err(text)
}

/// Rotation between two poses, radians.
fn turn(a: &Pose, b: &Pose) -> f64 {
    (a.inverse() * *b).rotation_angle()
}

/// Distance between two poses, metres.
fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.translation() - b.translation()).norm()
}

/// Pairs of consecutive poses.
fn pairs(poses: &[TimedPose]) -> impl Iterator<Item = (Pose, Pose)> {
    poses.windows(2).map(|pair| (pair[0].world_from_camera, pair[1].world_from_camera))
}
