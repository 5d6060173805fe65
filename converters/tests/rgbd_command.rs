//! What `os-convert tum` does to the files around it.
#![expect(clippy::unwrap_used, reason = "tests")]

use assert_cmd::cargo::cargo_bin;
use open_structure::simulate::render::{Layout, RenderOptions, render};
use open_structure::simulate::{Recipe, simulate};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;

const ROOM: &str = r#"
name = "room"
seed = 5
[camera]
fx = 133.8
fy = 134.8
cx = 79.6
cy = 61.0
width = 160
height = 120
[trajectory]
kind = "waypoints"
frames = 8
look = { target_m = [0.6, 2.2, 0.8] }
waypoints = [{ position_m = [-1.2, -2.5, 1.5] }, { position_m = [-0.6, -2.7, 1.6] }]
[[scene]]
kind = "room"
size_m = [7.0, 8.0, 3.0]
position_m = [0.0, 0.0, 1.5]
[[scene]]
kind = "box"
size_m = [0.8, 2.0, 2.0]
position_m = [1.6, 1.0, 1.0]
[points]
count = 20
[lines]
count = 10
min_length_m = 0.5
"#;

/// A folder with the dataset `raw` in it.
fn rendered() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let simulation = simulate(&Recipe::from_toml(ROOM).unwrap(), Path::new(""), &|_, _, _| {}).unwrap();
    let raw = folder.path().join("raw");
    fs::create_dir(&raw).unwrap();
    render(&simulation, &RenderOptions::new(Layout::Tum), &raw, &|_, _| {}).unwrap();
    folder
}

fn os_convert(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(cargo_bin("os-convert")).arg("tum").args(arguments).current_dir(folder).output().unwrap()
}

fn names(folder: &Path) -> BTreeSet<String> {
    folder.read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn what_is_read_is_never_replaced() {
    let folder = rendered();
    let raw = folder.path().join("raw");
    let before = names(&raw);
    let here = folder.path().to_str().unwrap();
    for output in ["raw", "raw/", here, "raw/rgb", "raw/rgb.txt"] {
        let found = os_convert(folder.path(), &["raw", "-o", output, "--force"]);
        let told = String::from_utf8_lossy(&found.stderr).into_owned();
        assert!(found.status.code() == Some(1) && told.contains("the input"), "{output}: {told}");
        assert_eq!(names(&raw), before, "{output}");
    }
    // A sequence in the folder is none of the dataset.
    for arguments in [["raw", "-o", "raw/out", "--force"]; 2] {
        let found = os_convert(folder.path(), &arguments);
        assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    }
}

#[test]
fn what_was_left_out_is_told_without_the_folder_it_lay_in() {
    let folder = rendered();
    let depth = folder.path().join("raw/depth");
    let damaged = names(&depth).into_iter().nth(3).unwrap();
    fs::write(depth.join(&damaged), "no picture").unwrap();
    let manifests = ["raw", "moved"].map(|input| {
        if input == "moved" {
            fs::rename(folder.path().join("raw"), folder.path().join("moved")).unwrap();
        }
        let output = format!("of-{input}");
        let found = os_convert(folder.path(), &[input, "-o", &output, "--keep-going", "--name", "x"]);
        assert_eq!(found.status.code(), Some(3), "{}", String::from_utf8_lossy(&found.stderr));
        fs::read_to_string(folder.path().join(output).join("sequence.json")).unwrap()
    });
    assert!(manifests[0].contains(&damaged) && !manifests[0].contains("raw/"), "{}", manifests[0]);
    let excluded = |text: &str| {
        let manifest: serde_json::Value = serde_json::from_str(text).unwrap();
        manifest["excluded"].clone()
    };
    assert_eq!(excluded(&manifests[0]), excluded(&manifests[1]));
}

#[test]
fn an_error_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    let found = os_convert(folder.path(), &["nowhere", "-o", "out"]);
    let told = String::from_utf8(found.stderr).unwrap();
    assert_eq!(told.matches("os error").count(), 1, "{told}");
}

#[test]
fn an_interrupted_conversion_ends_at_once_without_a_crash() {
    let folder = rendered();
    let mut interrupted = 0;
    for wait in (0..12).map(|step| 40 + 20 * step) {
        let mut child = Command::new(cargo_bin("os-convert"))
            .args(["tum", "raw", "-o", "out", "--max-features", "20000"])
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(wait));
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let status = child.wait().unwrap();
        // Before the handler is there, the signal itself ends the program; after the end, nothing does.
        let by_signal = std::os::unix::process::ExitStatusExt::signal(&status);
        assert!(matches!(status.code(), Some(0 | 130)) || by_signal == Some(2), "{status:?} after {wait} ms");
        interrupted += usize::from(status.code() == Some(130));
        if status.success() {
            fs::remove_dir_all(folder.path().join("out")).unwrap();
        }
        assert_eq!(names(folder.path()), BTreeSet::from(["raw".to_owned()]));
    }
    assert!(interrupted > 0);
}
