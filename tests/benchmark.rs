//! `os benchmark` as a user meets it: cells, tables, going on, and what it refuses.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use open_structure::format::{self, WriteOptions, read_results};
use open_structure::structure::{Estimate, Frame, ResultValues, TrajectoryPose};
use serde_json::Value;

fn os(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).current_dir(folder).args(arguments).output().unwrap()
}

#[track_caller]
fn ended(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = os(folder, arguments);
    let words =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "os {}: {words}", arguments.join(" "));
    words
}

/// A folder with the recipe of box1, cut short.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let recipe = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml");
    let text = fs::read_to_string(recipe).unwrap();
    let text = text.split("[expected]").next().unwrap();
    let text = text.replace("frames = 447", "frames = 90").replace("name = \"box1\"", "name = \"short\"");
    fs::write(folder.path().join("short.toml"), text).unwrap();
    folder
}

const SHORT: [&str; 3] = ["benchmark", "short.toml", "-o"];

/// Cells without their times, by file name.
fn cells(folder: &Path) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for file in fs::read_dir(folder.join("cells/short")).unwrap() {
        let path = file.unwrap().path();
        let mut cell: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        cell.as_object_mut().unwrap().remove("seconds").unwrap();
        found.push((path.file_name().unwrap().to_string_lossy().into_owned(), cell));
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

#[test]
fn a_benchmark_gives_tables_and_goes_on_where_it_was_cut_off() {
    let folder = folder();
    let at = folder.path();
    let methods = ["--methods", "map-to-frame-classic,point-ba,map-to-frame,structural-ba"];
    let all = |output: &'static str, threads: &'static str| {
        [&SHORT[..], &[output, "--seeds", "2", "--threads", threads], &methods].concat()
    };
    let words = ended(at, &all("one", "1"), 0);
    assert!(words.contains("| short |") && words.contains("structural-ba"), "{words}");
    ended(at, &all("two", "2"), 0);
    let first = cells(&at.join("one"));
    assert_eq!(first.len(), 8);
    assert_eq!(first, cells(&at.join("two")), "figures depend on threads");

    let summary = read_results(&at.join("one/summary.parquet")).unwrap();
    assert_eq!(summary.rows(), 4);
    let column = |name: &str| {
        let column = summary.columns.iter().find(|column| column.name == name).unwrap();
        let ResultValues::Number(values) = &column.values else { panic!("{name}") };
        values.iter().map(|value| value.unwrap()).collect::<Vec<f64>>()
    };
    // No unbiased estimate is better than the bound, but by chance of two seeds; the last uses all that was measured.
    let over = column("over_bound");
    assert!(over.iter().all(|ratio| *ratio > 0.5), "{over:?}");
    assert!(over[3] < 2.0 && over[3] < over[0], "{over:?}");
    let curves = read_results(&at.join("one/curves.parquet")).unwrap();
    assert!(curves.rows() > 4);
    let page = fs::read_to_string(at.join("one/report.html")).unwrap();
    for part in ["<html lang=\"en\">", "Convergence on short", "<svg", "structural-ba"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("http://") || !page.contains("<script"), "the page needs something else");

    // One cell lost, one changed: the lost one is made again, the other is taken as it is.
    let lost = at.join("one/cells/short/structural-ba.1.json");
    let kept = at.join("one/cells/short/map-to-frame.0.json");
    fs::remove_file(&lost).unwrap();
    let before = fs::metadata(&kept).unwrap().modified().unwrap();
    ended(at, &all("one", "1"), 0);
    assert_eq!(cells(&at.join("one")), first);
    assert_eq!(
        fs::metadata(&kept).unwrap().modified().unwrap(),
        before,
        "a cell that was done was made again"
    );
}

#[test]
fn other_noise_does_not_get_into_the_same_folder() {
    let folder = folder();
    let at = folder.path();
    let few = ["--seeds", "1", "--methods", "map-to-frame-classic", "--no-bound"];
    let run = |more: &[&'static str]| [&SHORT[..], &["results"], &few, more].concat();
    ended(at, &run(&[]), 0);
    let words = ended(at, &run(&["--set", "sigma_px=2"]), 1);
    assert!(words.contains("other noise") && words.contains("--force"), "{words}");
    ended(at, &run(&["--set", "sigma_px=2", "--force"]), 0);
    fs::create_dir(at.join("mine")).unwrap();
    fs::write(at.join("mine/thesis.tex"), "all of it").unwrap();
    for force in [&[][..], &["--force"]] {
        let arguments = [&SHORT[..], &["mine"], &few, force].concat();
        let words = ended(at, &arguments, 1);
        assert!(words.contains("something else"), "{words}");
    }
    assert!(at.join("mine/thesis.tex").exists());
    fs::write(at.join("results/cells/short/map-to-frame-classic.0.json"), "{").unwrap();
    let words = ended(at, &run(&["--set", "sigma_px=2"]), 1);
    assert!(words.contains("map-to-frame-classic.0.json"), "{words}");
}

#[test]
fn what_cannot_be_benchmarked_is_named() {
    let folder = folder();
    let at = folder.path();
    ended(at, &["simulate", "short.toml", "-o", "short"], 0);
    let few = ["--seeds", "1", "--methods", "map-to-frame-classic", "--no-bound"];
    let words = ended(at, &[&["benchmark", "short", "short.toml", "-o", "twice"], &few[..]].concat(), 1);
    assert!(words.contains("two sequences are called `short`"), "{words}");
    let words = ended(at, &[&["benchmark", "nowhere", "-o", "none"], &few[..]].concat(), 1);
    assert!(words.contains("nowhere"), "{words}");
    let mut blind = format::read(at.join("short")).unwrap();
    blind.manifest.name = "blind".to_owned();
    for frame in &mut blind.frames {
        *frame = Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    blind.frame_statistics.clear();
    blind.manifest.tables.clear();
    format::write(&at.join("blind"), &blind, WriteOptions::default()).unwrap();
    let words = ended(at, &[&["benchmark", "short", "blind", "-o", "some"], &few[..]].concat(), 3);
    assert!(words.contains("blind: left out: no true poses"), "{words}");
    ended(at, &["benchmark", "short", "-o", "x", "--seeds", "0"], 2);
    ended(at, &["benchmark", "short", "-o", "x", "--methods", "magic"], 2);
}

#[test]
fn a_foreign_estimate_stands_beside_the_methods() {
    let folder = folder();
    let at = folder.path();
    ended(at, &["simulate", "short.toml", "-o", "short"], 0);
    let mut sequence = format::read(at.join("short")).unwrap();
    let name = "magic".to_owned();
    let trajectory = sequence
        .frames
        .iter()
        .map(|frame| TrajectoryPose::new(name.clone(), frame.frame_id, frame.world_from_camera().unwrap()));
    let estimate = Estimate { trajectory: trajectory.collect(), name, ..Estimate::default() };
    estimate.put(&mut sequence);
    sequence.manifest.tables.clear();
    format::write(&at.join("with"), &sequence, WriteOptions::default()).unwrap();
    let few =
        ["--seeds", "3", "--methods", "map-to-frame-classic", "--no-bound", "--estimates", "magic,none"];
    let words = ended(at, &[&["benchmark", "with", "-o", "results", "--json"], &few[..]].concat(), 3);
    let json: Value = serde_json::from_str(&words[..words.rfind(']').unwrap() + 1]).unwrap();
    let row =
        |method: &str| json.as_array().unwrap().iter().find(|row| row["method"] == method).unwrap().clone();
    assert!(row("magic")["ape_rmse_cm"].as_f64().unwrap() < 1e-9);
    assert_eq!(row("magic")["seeds"], 1);
    assert_eq!(row("none")["failed"], 1);
    assert_eq!(row("map-to-frame-classic")["seeds"], 3);
}

#[test]
fn methods_get_the_very_measurements_that_estimates_were_made_of() {
    let folder = folder();
    let at = folder.path();
    ended(at, &["simulate", "short.toml", "-o", "short"], 0);
    ended(at, &["measure", "short", "-o", "noisy", "--noise", "kinect-disparity", "--seeds", "3..4"], 0);
    for seed in ["3", "4"] {
        let (noisy, tracked) = (format!("noisy-{seed}"), format!("tracked-{seed}"));
        let found = os(at, &["track", &noisy, "-o", &tracked, "--name", "theirs"]);
        assert!(matches!(found.status.code(), Some(0 | 3)), "{found:?}");
    }
    let of = ["tracked-3", "tracked-4", "--estimates", "theirs", "--methods", "map-to-frame", "--no-bound"];
    let run = |more: &[&str]| {
        let output = os(at, &[&["benchmark"], &of[..], &["--seeds", "1", "--json"], more].concat());
        assert!(output.status.success(), "{output:?}");
        let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
        let found = |sequence: &str, method: &str, column: &str| {
            let of = |row: &&Value| row["sequence"] == sequence && row["method"] == method;
            rows.as_array().unwrap().iter().find(of).unwrap()[column].as_f64()
        };
        // Two sequences of one name are told apart by those of their folders.
        let error = |sequence: &str, method: &str| found(sequence, method, "ape_rmse_cm").unwrap();
        assert_eq!(found("tracked-3", "theirs", "seconds"), None, "an estimate took its time elsewhere");
        let pairs = ["tracked-3", "tracked-4"]
            .map(|sequence| (error(sequence, "theirs"), error(sequence, "map-to-frame")));
        (pairs, String::from_utf8(output.stderr).unwrap())
    };
    let (pairs, words) = run(&["-o", "same", "--as-measured"]);
    assert!(pairs.iter().all(|(theirs, ours)| (theirs - ours).abs() < 1e-6 * ours), "{pairs:?}");
    assert!(pairs[0] != pairs[1] && !words.contains("warning"), "{words}");
    let (drawn, words) = run(&["-o", "drawn"]);
    assert!(drawn.iter().all(|(theirs, ours)| (theirs - ours).abs() > 1e-3 * ours), "{drawn:?}");
    assert!(words.contains("tracked-3: its estimates were made of its own measurements"), "{words}");
    ended(at, &[&["benchmark"], &of[..], &["-o", "drawn", "--as-measured"]].concat(), 1);
    ended(
        at,
        &[&["benchmark"], &of[..], &["-o", "x", "--as-measured", "--noise", "first-release"]].concat(),
        2,
    );
}

#[test]
fn a_sequence_that_has_changed_is_run_anew() {
    let folder = folder();
    let at = folder.path();
    ended(at, &["simulate", "short.toml", "-o", "one"], 0);
    let run = [
        "benchmark",
        "one",
        "-o",
        "results",
        "--seeds",
        "1",
        "--methods",
        "map-to-frame",
        "--estimates",
        "mine",
    ];
    let with_estimate = |shift: f64| {
        let mut sequence = format::read(at.join("one")).unwrap();
        let rows = sequence.frames.iter().map(|frame| {
            let mut pose = frame.world_from_camera().unwrap();
            pose.translation[0] += if frame.frame_id.0 % 2 == 0 { shift } else { 0.0 };
            TrajectoryPose::new("mine".to_owned(), frame.frame_id, pose)
        });
        sequence.trajectories = rows.collect();
        format::write(&at.join("one"), &sequence, WriteOptions { force: true, ..WriteOptions::default() })
            .unwrap();
    };
    let error = |method: &str| -> f64 {
        let file = at.join(format!("results/cells/short/{method}.0.json"));
        let cell: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
        cell["outcome"]["estimated"]["ape_rmse_m"].as_f64().unwrap()
    };
    with_estimate(0.1);
    ended(at, &run, 0);
    let (mine, tracked) = (error("mine"), error("map-to-frame"));
    with_estimate(0.4);
    let words = ended(at, &run, 0);
    assert!(words.contains("made anew") && error("mine") > 3.0 * mine, "{words}");
    assert_eq!(error("map-to-frame"), tracked, "the measurements are the same");
    // The same again: nothing is made anew.
    assert!(!ended(at, &run, 0).contains("made anew"));
    ended(at, &["simulate", "short.toml", "--seed", "9", "-o", "one", "--force"], 0);
    with_estimate(0.4);
    assert!(ended(at, &run, 0).contains("made anew"));
    assert_ne!(error("map-to-frame"), tracked);
}
