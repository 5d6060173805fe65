//! What `os-convert tum` does to the files around it.

use crate::wall::Wall;
use assert_cmd::cargo::cargo_bin;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

fn os_convert(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(cargo_bin("os-convert")).arg("tum").args(arguments).current_dir(folder).output().unwrap()
}

fn names(folder: &Path) -> BTreeSet<String> {
    folder.read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn what_is_read_is_never_replaced() {
    let wall = Wall::new();
    let raw = wall.place().join("raw");
    let before = names(&raw);
    let here = wall.place().to_str().unwrap();
    for output in ["raw", "raw/", here, "raw/rgb", "raw/rgb.txt"] {
        let found = os_convert(wall.place(), &["raw", "-o", output, "--force"]);
        let told = String::from_utf8_lossy(&found.stderr).into_owned();
        assert!(found.status.code() == Some(2) && told.contains("the input"), "{output}: {told}");
        assert_eq!(names(&raw), before, "{output}");
    }
    // A sequence in the folder is none of the dataset.
    for arguments in [["raw", "-o", "raw/out", "--force"]; 2] {
        let found = os_convert(wall.place(), &arguments);
        assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    }
}

#[test]
fn what_was_left_out_is_told_without_the_folder_it_lay_in() {
    let wall = Wall::new();
    let depth = wall.place().join("raw/depth");
    let damaged = names(&depth).into_iter().nth(3).unwrap();
    fs::write(depth.join(&damaged), "no picture").unwrap();
    let manifests = ["raw", "moved"].map(|input| {
        if input == "moved" {
            fs::rename(wall.place().join("raw"), wall.place().join("moved")).unwrap();
        }
        let output = format!("of-{input}");
        let found = os_convert(wall.place(), &[input, "-o", &output, "--keep-going", "--name", "x"]);
        assert_eq!(found.status.code(), Some(3), "{}", String::from_utf8_lossy(&found.stderr));
        fs::read_to_string(wall.place().join(output).join("sequence.json")).unwrap()
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
    let wall = Wall::new();
    // Long enough that every interruption comes before the end.
    wall.repeat(50);
    let mut interrupted = 0;
    for wait in (0..12).map(|step| 40 + 20 * step) {
        let mut child = Command::new(cargo_bin("os-convert"))
            .args(["tum", "raw", "-o", "out", "--max-features", "20000"])
            .current_dir(wall.place())
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
            fs::remove_dir_all(wall.place().join("out")).unwrap();
        }
        assert_eq!(names(wall.place()), BTreeSet::from(["raw".to_owned()]));
    }
    assert!(interrupted > 0);
}
