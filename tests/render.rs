//! `os simulate --render`: raw datasets beside a simulated sequence.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::fs;
use std::path::Path;

use assert_cmd::Command;

const RECIPE: &str = r#"
name = "one-box"
[camera]
fx = 40.0
fy = 40.0
cx = 23.5
cy = 17.5
width = 48
height = 36
[trajectory]
kind = "wave"
frames = 12
[[scene]]
kind = "box"
size_m = [4.0, 4.0, 2.0]
[points]
count = 20
[lines]
count = 4
min_length_m = 0.3
"#;

fn recipe(folder: &Path, text: &str) {
    fs::write(folder.join("one-box.toml"), text).unwrap();
}

fn os(folder: &Path, more: &[&str]) -> Command {
    let mut command = Command::cargo_bin("os").unwrap();
    command.current_dir(folder).args(["simulate", "one-box.toml"]).args(more);
    command
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_dataset_stands_beside_the_sequence_and_is_replaced_only_by_force() {
    let folder = tempfile::tempdir().unwrap();
    recipe(folder.path(), RECIPE);
    let arguments =
        ["-o", "a.mcap", "--render", "tartanair", "--render-to", "raw", "--render-frames", "2..11"];
    let more = ["--render-stride", "4"];
    let output = os(folder.path(), &arguments).args(more).assert().success();
    let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    assert!(text.contains("raw: pictures and depth maps of 3 frames, 48 x 36 px"), "{text}");
    assert_eq!(names(folder.path()), ["a.mcap", "one-box.toml", "raw"]);
    let raw = folder.path().join("raw");
    assert_eq!(names(&raw), ["calibration.txt", "depth_left", "image_left", "pose_left.txt"]);
    assert_eq!(names(&raw.join("image_left")), ["000000_left.png", "000001_left.png", "000002_left.png"]);

    // The sequence could be written, the dataset could not: neither is.
    let second = ["-o", "b.mcap", "--render", "tum", "--render-to", "raw"];
    let refused = os(folder.path(), &second).assert().code(1);
    let error = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
    assert!(error.contains("raw exists; --force replaces it"), "{error}");
    assert_eq!(names(folder.path()), ["a.mcap", "one-box.toml", "raw"]);

    os(folder.path(), &second).args(["--force", "--render-frames", "..1"]).assert().success();
    assert_eq!(names(&raw), ["calibration.txt", "depth", "depth.txt", "groundtruth.txt", "rgb", "rgb.txt"]);
    assert_eq!(names(folder.path()), ["a.mcap", "b.mcap", "one-box.toml", "raw"]);
}

#[test]
fn a_folder_with_other_things_is_not_replaced_even_by_force() {
    let folder = tempfile::tempdir().unwrap();
    recipe(folder.path(), RECIPE);
    let mine = folder.path().join("mine");
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("thesis.tex"), "years").unwrap();
    let refused =
        os(folder.path(), &["-o", "a", "--render", "tum", "--render-to", "mine", "--force"]).assert().code(1);
    let error = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
    assert!(error.contains("other things than a rendering"), "{error}");
    assert_eq!(fs::read_to_string(mine.join("thesis.tex")).unwrap(), "years");
    assert_eq!(names(folder.path()), ["mine", "one-box.toml"]);
}

#[test]
fn a_dataset_that_cannot_show_the_camera_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    recipe(folder.path(), RECIPE);
    let refused =
        os(folder.path(), &["-o", "a.mcap", "--render", "icl", "--render-to", "raw"]).assert().code(1);
    let error = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
    assert!(error.contains("camera.fy: expected a negative focal length"), "{error}");
    assert_eq!(names(folder.path()), ["one-box.toml"]);
}

#[test]
fn arguments_that_make_no_sense_are_misuse() {
    let folder = tempfile::tempdir().unwrap();
    recipe(folder.path(), RECIPE);
    for more in [
        ["--render", "tum"].as_slice(),
        &["--render-to", "raw"],
        &["--render-stride", "2"],
        &["--render", "kitti", "--render-to", "raw"],
        &["--render", "tum", "--render-to", "raw", "--render-frames", "5..5"],
        &["--render", "tum", "--render-to", "raw", "--render-frames", "5"],
        &["--render", "tum", "--render-to", "raw", "--render-stride", "0"],
    ] {
        os(folder.path(), &["-o", "a.mcap"]).args(more).assert().code(2);
    }
    assert_eq!(names(folder.path()), ["one-box.toml"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_rendering_leaves_nothing() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let folder = tempfile::tempdir().unwrap();
    // More than will ever be rendered.
    recipe(folder.path(), &RECIPE.replace("frames = 12", "frames = 3000"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_os"))
        .current_dir(folder.path())
        .args(["simulate", "one-box.toml", "-o", "a.mcap", "--render", "tum", "--render-to", "raw"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let partial = folder.path().join(format!(".raw.{}.partial", child.id()));
    let start = Instant::now();
    while !partial.join("rgb").exists() || names(&partial.join("rgb")).len() < 3 {
        assert!(child.try_wait().unwrap().is_none(), "ended by itself");
        assert!(start.elapsed() < Duration::from_secs(120), "renders nothing");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(names(folder.path()), ["one-box.toml"]);
}
