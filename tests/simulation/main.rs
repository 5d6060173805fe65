//! The simulator: its recipes, the release that it repeats, and the command as a user meets it.

mod command;
mod mesh;
mod published;
mod recipes;

use std::path::Path;
use std::process::{Command, Output};

fn os(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).output().unwrap()
}

#[track_caller]
fn done(arguments: &[&str]) -> String {
    let output = os(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn refused(arguments: &[&str], code: i32) -> String {
    let output = os(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A small recipe with every kind of thing in it.
const SMALL: &str = r#"
name = "small"
seed = 3
rate_hz = 10.0
min_observations = 2

[camera]
preset = "icl-nuim"
width = 320
height = 240
cx = 159.5
cy = 119.5

[trajectory]
kind = "wave"
frames = 24
radius_m = 2.0
amplitude_m = 0.3
pitch_deg = -10.0

[[scene]]
kind = "room"
size_m = [8.0, 7.0, 3.0]

[[scene]]
kind = "box"
size_m = [0.6, 0.8, 0.7]
roll_pitch_yaw_deg = [10.0, 20.0, 30.0]

[[scene]]
kind = "staircase"
steps = 5
position_m = [-1.0, 1.5, -1.5]

[points]
density = "low"

[lines]
count = 25

[visibility]
depth_range_m = [0.2, 12.0]

[noise]
model = "kinect-disparity"
outlier_fraction = 0.05
missed_fraction = 0.1
"#;
