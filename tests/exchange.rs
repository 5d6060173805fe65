//! `os export`, `os import` and `os import-trajectory`, on real files where they are at hand.
//!
//! Graphs and problems of others are looked for in `../shared/data` beside the workspace, or where
//! `OPEN_STRUCTURE_DATA` says.
#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

mod shared_data;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use assert_cmd::Command;
use open_structure::exchange::{self, ImportNames, from_bal, from_g2o, read_bal, read_g2o, to_bal, to_g2o};
use open_structure::format;
use open_structure::geometry::Pose;
use open_structure::structure::{FactorGraph, FrameId, PoseRow};
use shared_data::shared;
use tempfile::TempDir;

fn os() -> Command {
    Command::cargo_bin("os").unwrap()
}

fn names() -> ImportNames {
    ImportNames { sequence: "s".to_owned(), graph: "g".to_owned() }
}

/// A simulated sequence with measurements of points and lines, with depth.
fn small(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("small");
    os().args(["simulate", "box1", "-o"]).arg(&path).assert().success();
    path
}

/// `½ Σ eᵀ Ω e` of a pose graph with `e = [t; 2 vec q]` of `Z⁻¹ Xi⁻¹ Xj`, from the words of the file.
fn cost_of_file(text: &str) -> (usize, f64) {
    use std::collections::BTreeMap;
    let pose = |words: &[f64]| {
        Pose::from_components([words[0], words[1], words[2]], [words[3], words[4], words[5], words[6]])
            .unwrap()
    };
    let mut vertices = BTreeMap::new();
    let (mut edges, mut cost) = (0, 0.0);
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers =
            |from: usize| words[from..].iter().map(|word| word.parse().unwrap()).collect::<Vec<f64>>();
        match words[0] {
            "VERTEX_SE3:QUAT" => drop(vertices.insert(words[1].to_owned(), pose(&numbers(2)))),
            "EDGE_SE3:QUAT" => {
                let numbers = numbers(3);
                let found = vertices[words[1]].inverse() * vertices[words[2]];
                let (t, [x, y, z, w]) = (pose(&numbers).inverse() * found).components();
                let twice = if w < 0.0 { -2.0 } else { 2.0 };
                let error = [t[0], t[1], t[2], twice * x, twice * y, twice * z];
                let mut places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
                for number in &numbers[7..] {
                    let (row, column) = places.next().unwrap();
                    let both = if row == column { 0.5 } else { 1.0 };
                    cost += both * number * error[row] * error[column];
                }
                edges += 1;
            }
            other => panic!("{other}"),
        }
    }
    (edges, cost)
}

#[test]
fn pose_graphs_of_others_become_sequences_and_come_back() {
    for (name, poses, edges, passes) in [
        ("sphere2500", 2500, 4949, true),
        ("parking-garage", 1661, 6275, true),
        ("smallGrid3D", 125, 297, true),
        ("intel", 1728, 2512, false),
    ] {
        let Some(path) = shared(&format!("pose-graphs/{name}.g2o")) else { return };
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join(name);
        os().arg("import").arg(&path).arg("-o").arg(&output).assert().success();
        os().arg("validate").arg(&output).assert().success();
        let sequence = format::read(&output).unwrap();
        assert_eq!((sequence.graph_poses.len(), sequence.graph_factors.len()), (poses, edges), "{name}");
        let again = folder.path().join("again.g2o");
        os().args(["export", "--to", "g2o"]).arg(&output).arg("-o").arg(&again).assert().success();
        let (original, again) = (fs::read_to_string(&path).unwrap(), fs::read_to_string(&again).unwrap());
        let (first, second) = (read_g2o(original.as_bytes()).unwrap(), read_g2o(again.as_bytes()).unwrap());
        let sorted = |graph: exchange::G2oGraph| {
            let mut elements = graph.elements;
            elements.sort_by_key(|element| {
                (element.kind, element.kind >= exchange::G2oKind::Fix, element.ids[0])
            });
            elements.retain(|element| element.kind < exchange::G2oKind::Fix);
            elements
        };
        if passes {
            assert_eq!(sorted(first), sorted(second), "{name}: poses keep their digits");
            let ((edges, before), (_, after)) = (cost_of_file(&original), cost_of_file(&again));
            assert_eq!(edges, second_edges(&again));
            // Information goes through two products of matrices.
            assert!((before - after).abs() < 1e-9 * before, "{name}: {before} {after}");
        } else {
            for (one, other) in sorted(first).iter().zip(&sorted(second)) {
                for (one, other) in one.numbers.iter().zip(&other.numbers) {
                    let turns = (one - other).abs() / std::f64::consts::TAU;
                    assert!((turns - turns.round()).abs() < 1e-15, "{name}: {one} {other}");
                }
            }
        }
    }
}

fn second_edges(text: &str) -> usize {
    text.lines().filter(|line| line.starts_with("EDGE")).count()
}

/// The cost of a pose graph by our registry's residual is, near a solution, that of the file: a graph is put at its own
/// measurements along a chain, so that all errors are small.
#[test]
fn information_of_a_real_graph_weighs_as_its_file_does() {
    let Some(path) = shared("pose-graphs/sphere2500.g2o") else { return };
    let graph = read_g2o(fs::read(&path).unwrap().as_slice()).unwrap();
    let imported = from_g2o(&graph, &names()).unwrap();
    let mut graph = FactorGraph::of(&imported.sequence, "g").unwrap();
    // Each measured pose moved by a micrometre and a microradian or so, so that the error of each edge is known.
    let (mut ours, mut moved) = (0.0, 0.0_f64);
    for factor in &mut graph.factors {
        let measured = PoseRow::from_numbers(factor.measurement.clone().try_into().unwrap()).pose().unwrap();
        let at = factor.factor_id as f64;
        let tangent = nalgebra::Vector6::from_fn(|place, _| 1e-6 * libm::sin(at + 2.0 * place as f64));
        let (from, to) = (factor.frame_id.unwrap(), factor.other_frame_id.unwrap());
        assert_ne!(from, to);
        let information = factor.information.as_ref().unwrap();
        let mut numbers = information.iter();
        for row in 0..6 {
            for column in row..6 {
                let twice = if row == column { 0.5 } else { 1.0 };
                ours += twice * numbers.next().unwrap() * tangent[row] * tangent[column];
            }
        }
        let found = Pose::exp(&tangent) * measured;
        moved = moved.max((found.inverse() * measured).rotation_angle());
        // Every edge gets vertices of its own, so that its error is the tangent alone.
        factor.frame_id = Some(FrameId(2 * factor.factor_id));
        factor.other_frame_id = Some(FrameId(2 * factor.factor_id + 1));
    }
    assert!(moved > 0.0);
    let mut apart = FactorGraph { poses: Vec::new(), ..graph.clone() };
    for factor in &graph.factors {
        let measured = PoseRow::from_numbers(factor.measurement.clone().try_into().unwrap()).pose().unwrap();
        let at = factor.factor_id as f64;
        let tangent = nalgebra::Vector6::from_fn(|place, _| 1e-6 * libm::sin(at + 2.0 * place as f64));
        for (frame, pose) in [
            (factor.frame_id.unwrap(), Pose::identity()),
            (factor.other_frame_id.unwrap(), Pose::exp(&tangent) * measured),
        ] {
            let pose = PoseRow::from(&pose);
            apart.poses.push(open_structure::structure::GraphPose::new("g".to_owned(), frame, false, pose));
        }
    }
    let (model, _) = to_g2o(&apart, exchange::G2oForm::Space).unwrap();
    let mut text = Vec::new();
    exchange::write_g2o(&mut text, &model).unwrap();
    let (edges, theirs) = cost_of_file(str::from_utf8(&text).unwrap());
    assert_eq!(edges, 4949);
    // Linear to the second order: a part in a million, and digits lost where poses of several metres are compared.
    assert!((ours - theirs).abs() < 1e-5 * theirs, "{ours} {theirs}");
}

#[test]
fn problems_of_bal_become_sequences_and_come_back() {
    for (name, counts) in
        [("problem-16-22106-pre", [16, 22106, 83718]), ("problem-49-7776-pre", [49, 7776, 31843])]
    {
        let Some(path) = shared(&format!("bal/{name}.txt")) else { return };
        let problem = read_bal(fs::read(&path).unwrap().as_slice()).unwrap();
        let found = [problem.cameras.len(), problem.points.len(), problem.observations.len()];
        assert_eq!(found, counts, "{name}");
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("bal.mcap");
        os().arg("import").arg(&path).arg("-o").arg(&output).assert().success();
        os().arg("validate").arg(&output).assert().success();
        let again = folder.path().join("again.txt");
        os().args(["export", "--to", "bal"]).arg(&output).arg("-o").arg(&again).assert().success();
        let found = read_bal(fs::read(&again).unwrap().as_slice()).unwrap();
        assert_eq!(found.points, problem.points);
        for (found, seen) in found.observations.iter().zip(&problem.observations) {
            assert_eq!((found.camera, found.point), (seen.camera, seen.point));
            let apart = (found.pixel[0] - seen.pixel[0]).abs() + (found.pixel[1] - seen.pixel[1]).abs();
            // Undistorted, moved to a corner of an image of a thousand pixels, and back.
            assert!(apart < 1e-9, "{name}: {apart} px");
        }
        let (before, after) = (problem.cost(), found.cost());
        assert!((before - after).abs() < 1e-9 * before, "{name}: {before} {after}");
        // And without a file between.
        let imported = from_bal(&problem, &names()).unwrap();
        assert!(imported.remarks.is_empty(), "{:?}", imported.remarks);
        let (direct, _) = to_bal(&FactorGraph::of(&imported.sequence, "g").unwrap()).unwrap();
        assert_eq!(direct, found);
    }
}

#[test]
fn another_program_enters_by_files() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = small(&folder);
    let csv = folder.path().join("csv");
    os().args(["export", "--to", "csv"]).arg(&sequence).arg("-o").arg(&csv).assert().success();
    let mut files: Vec<_> =
        fs::read_dir(&csv).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    let expected = [
        "cameras.json",
        "frames.csv",
        "line_measurements.csv",
        "point_measurements.csv",
        "structural_groups.csv",
    ];
    assert_eq!(files, expected, "no truth");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/out_of_process/constant_pose.py");
    let output = match Process::new("python3").arg(script).arg(&csv).output() {
        Err(_) => {
            eprintln!("SKIPPED: there is no python3 here");
            return;
        }
        Ok(output) => output,
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let path = folder.path().join("constant.txt");
    fs::write(&path, &output.stdout).unwrap();
    let with = folder.path().join("with");
    os().args(["import-trajectory", "--name", "constant-pose"])
        .arg(&sequence)
        .arg(&path)
        .arg("-o")
        .arg(&with)
        .assert()
        .success();
    let (before, after) = (format::read(&sequence).unwrap(), format::read(&with).unwrap());
    let rows: Vec<_> = after.trajectories.iter().filter(|row| row.estimate == "constant-pose").collect();
    assert_eq!(rows.len(), before.frames.len());
    assert!(rows.iter().all(|row| row.world_from_camera().translation == [0.0; 3]));
    assert_eq!(after.point_measurements, before.point_measurements);
    os().arg("validate").arg(&with).assert().success();
    // A name is taken once.
    os().args(["import-trajectory", "--name", "constant-pose"])
        .arg(&with)
        .arg(&path)
        .arg("-o")
        .arg(folder.path().join("twice"))
        .assert()
        .code(1);
    assert!(!folder.path().join("twice").exists());
}

#[test]
fn paths_come_back_to_their_frames_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = small(&folder);
    let before = format::read(&sequence).unwrap();
    for format_name in ["tum", "kitti", "euroc"] {
        let path = folder.path().join(format!("{format_name}.txt"));
        let with = folder.path().join(format_name);
        os().args(["export", "--estimate", "truth", "--to", format_name])
            .arg(&sequence)
            .arg("-o")
            .arg(&path)
            .assert()
            .success();
        os().args(["import-trajectory", "--name", "copy"])
            .arg(&sequence)
            .arg(&path)
            .arg("-o")
            .arg(&with)
            .assert()
            .success();
        let after = format::read(&with).unwrap();
        assert_eq!(after.trajectories.len(), before.frames.len(), "{format_name}");
        for (row, frame) in after.trajectories.iter().zip(&before.frames) {
            assert_eq!(row.frame_id, frame.frame_id);
            let (found, truth) = (row.world_from_camera(), frame.world_from_camera().unwrap());
            if format_name == "kitti" {
                let turn = found.pose().unwrap().inverse() * truth.pose().unwrap();
                assert!(turn.rotation_angle() < 1e-14, "a matrix and back");
                assert_eq!(found.translation, truth.translation);
            } else {
                assert_eq!(found, truth, "{format_name}");
            }
        }
    }
}

#[test]
fn a_model_of_the_truth_reprojects_by_its_own_conventions() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = small(&folder);
    for to in ["colmap", "bal", "g2o"] {
        let (model, back) = (folder.path().join(to), folder.path().join(format!("{to}-back")));
        os().args(["export", "--estimate", "truth", "--to", to])
            .arg(&sequence)
            .arg("-o")
            .arg(&model)
            .assert()
            // Depth and lines have no place in some.
            .code(3);
        os().args(["import", "--from", to]).arg(&model).arg("-o").arg(&back).assert().success();
        os().arg("validate").arg(&back).assert().success();
        let (original, found) = (format::read(&sequence).unwrap(), format::read(&back).unwrap());
        let graph = FactorGraph::of(&found, "initial").unwrap();
        assert_eq!(graph.factors.len(), original.point_measurements.len(), "{to}");
        let mut squares = 0.0;
        for factor in &graph.factors {
            let frame = factor.frame_id.unwrap();
            let camera =
                graph.cameras.iter().find(|row| row.camera_id == graph.camera_of_frame[&frame]).unwrap();
            let pose = graph.poses[graph.poses.binary_search_by_key(&frame, |row| row.frame_id).unwrap()]
                .world_from_camera()
                .pose()
                .unwrap();
            let id = factor.point_id.unwrap();
            let at = &graph.points[graph.points.binary_search_by_key(&id, |row| row.point_id).unwrap()];
            let seen = camera
                .projection()
                .project(pose.inverse() * nalgebra::Point3::new(at.x, at.y, at.z))
                .unwrap();
            squares += (seen.x - factor.measurement[0]).powi(2) + (seen.y - factor.measurement[1]).powi(2);
        }
        let sigma = (squares / (2.0 * graph.factors.len() as f64)).sqrt();
        // The noise of the simulation, 1 px, from tens of thousands of residuals.
        assert!((sigma - 1.0).abs() < 0.02, "{to}: {sigma} px");
    }
}

#[test]
fn nothing_is_overwritten_and_nothing_is_left_after_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = small(&folder);
    let output = folder.path().join("out");
    fs::create_dir(&output).unwrap();
    fs::write(output.join("precious.rs"), "x").unwrap();
    let export = |force: bool| {
        let mut command = os();
        command.args(["export", "--to", "csv"]).arg(&sequence).arg("-o").arg(&output);
        if force {
            command.arg("--force");
        }
        command.assert().code(1)
    };
    export(false);
    export(true);
    assert_eq!(fs::read_to_string(output.join("precious.rs")).unwrap(), "x");
    let bad = folder.path().join("bad.g2o");
    fs::write(&bad, "VERTEX_SE2 0 1 2 nan\n").unwrap();
    let assert = os().arg("import").arg(&bad).arg("-o").arg(folder.path().join("none")).assert().code(1);
    let message = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
    assert!(
        message.contains("line 1: expected number 3 of 3 of VERTEX_SE2, a finite number, found nan"),
        "{message}"
    );
    // A relation that is no file of ours is not guessed.
    let other = folder.path().join("other.txt");
    fs::write(&other, "hello\n").unwrap();
    os().arg("import").arg(&other).arg("-o").arg(folder.path().join("none")).assert().code(1);
    let left: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.contains("partial") || name == "none")
        .collect();
    assert!(left.is_empty(), "{left:?}");
}
