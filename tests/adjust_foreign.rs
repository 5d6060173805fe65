//! `os adjust` of graphs of g2o and problems of Bundle Adjustment in the Large, on real files where they are at hand.
//!
//! Real files are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.
#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

mod shared_data;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{DMatrix, Matrix2, Matrix3, Quaternion, UnitQuaternion};
use open_structure::adjust::{Method, Options, Summary, adjust};
use open_structure::exchange::{G2oGraph, G2oKind, ImportNames, from_g2o, read_bal, read_g2o};
use open_structure::format;
use open_structure::structure::{Estimate, FactorGraph};
use serde_json::Value;
use shared_data::shared;
use tempfile::TempDir;

/// Four poses in a row with a loop closure that disagrees, in space: weights differ by axis.
const SPACE: &str = "\
VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1
VERTEX_SE3:QUAT 1 1 0.1 0 0 0 0.1 0.99498743710662
VERTEX_SE3:QUAT 2 2 0 0.1 0 0.1 0 0.99498743710662
VERTEX_SE3:QUAT 7 3 0 0 0.1 0 0 0.99498743710662
EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 4 0 0 0 0 0 4 0 0 0 0 9 0 0 0 50 1 0 60 0 70
EDGE_SE3:QUAT 1 2 1 0 0 0 0 0 1 4 0 0 0 0 0 4 0 0 0 0 9 0 0 0 50 1 0 60 0 70
EDGE_SE3:QUAT 2 7 1 0 0 0 0 0 1 4 0 0 0 0 0 4 0 0 0 0 9 0 0 0 50 1 0 60 0 70
EDGE_SE3:QUAT 0 7 2.9 0.1 0 0 0 0.1 0.99498743710662 4 0 0 0 0 0 4 0 0 0 0 9 0 0 0 50 1 0 60 0 70
";

/// The same in the plane.
const PLANE: &str = "\
VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1 0.1 0.2
VERTEX_SE2 2 2 0 3.2
VERTEX_SE2 7 3 0 -0.1
EDGE_SE2 0 1 1 0 0 4 1 0 9 2 50
EDGE_SE2 1 2 1 0 3.1 4 1 0 9 2 50
EDGE_SE2 2 7 -1 0 3.1 4 1 0 9 2 50
EDGE_SE2 0 7 2.9 0.1 0.2 4 1 0 9 2 50
";

fn os() -> Command {
    Command::cargo_bin("os").unwrap()
}

fn written(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    path
}

/// Runs `os adjust INPUT -o OUTPUT …`, expects an exit code, gives stdout and stderr.
fn adjusted(input: &Path, output: &Path, more: &[&str], code: i32) -> (String, String) {
    let assert = os().arg("adjust").arg(input).arg("-o").arg(output).args(more).assert().code(code);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&assert.get_output().stdout), text(&assert.get_output().stderr))
}

/// Cameras around a few points, whose pixels are off by a few parts in a hundred: a problem of BAL.
fn bal() -> String {
    let points: Vec<[f64; 3]> = (0..12)
        .map(|at| {
            let at = f64::from(at);
            [(1.3 * at).sin(), (2.1 * at).cos(), 0.5 * (0.7 * at).sin()]
        })
        .collect();
    let cameras: Vec<[f64; 9]> =
        (0..4).map(|at| [0.0, 0.2 * f64::from(at), 0.01, 0.0, 0.1, -4.0, 500.0, 0.0, 0.0]).collect();
    let mut text = format!("{} {} {}\n", cameras.len(), points.len(), cameras.len() * points.len());
    for (camera, [_, turn, ..]) in cameras.iter().enumerate() {
        for (point, [x, y, z]) in points.iter().enumerate() {
            let (sine, cosine) = turn.sin_cos();
            let (x, y, z) = (cosine * x + sine * z, y + 0.1, cosine * z - sine * x - 4.0);
            let off = 0.3 * (f64::from(u32::try_from(7 * camera + 3 * point).unwrap())).sin();
            text += &format!("{camera} {point} {} {}\n", -495.0 * x / z + off, -495.0 * y / z - off);
        }
    }
    cameras.iter().flatten().chain(points.iter().flatten()).for_each(|number| text += &format!("{number}\n"));
    text
}

#[test]
fn a_graph_of_g2o_comes_back_with_its_vertices_moved_and_its_edges_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("space.g2o", SPACE), ("plane.g2o", PLANE)] {
        let input = written(&folder, name, text);
        let output = folder.path().join(format!("adjusted-{name}"));
        let (told, _) = adjusted(&input, &output, &["--json"], 0);
        let told: Value = serde_json::from_str(&told).unwrap();
        let [before, after] = ["initial_cost", "final_cost"].map(|key| told[key].as_f64().unwrap());
        assert!(told["converged"].as_bool().unwrap() && after < 0.5 * before, "{told}");
        assert_eq!(told["held"], serde_json::json!([0]), "{told}");
        let read = |path: &Path| read_g2o(fs::read(path).unwrap().as_slice()).unwrap();
        let (first, second) = (read(&input), read(&output));
        let edges = |graph: &G2oGraph| graph.elements[4..].to_vec();
        assert_eq!(edges(&first), edges(&second), "{name}");
        assert_eq!(first.elements[0], second.elements[0], "the first vertex is held");
        assert_ne!(first.elements[1], second.elements[1]);
        // Where it ended is where the next adjustment begins.
        let again: Value = serde_json::from_str(
            &adjusted(&output, &folder.path().join("x.g2o"), &["--json", "--force"], 0).0,
        )
        .unwrap();
        let begun = again["initial_cost"].as_f64().unwrap();
        assert!((begun - after).abs() < 1e-12 * after, "{name}: {begun} {after}");
    }
}

#[test]
fn a_graph_of_g2o_becomes_a_sequence_with_the_graph_and_the_estimate() {
    let folder = tempfile::tempdir().unwrap();
    let input = written(&folder, "plane.g2o", PLANE);
    for output in ["a.mcap", "folder"].map(|name| folder.path().join(name)) {
        let (told, plan) = adjusted(&input, &output, &["--explain", "--covariance", "--name", "mine"], 0);
        assert!(told.contains("mine from graph `initial`") && plan.contains("-> eliminate"), "{told}{plan}");
        os().arg("validate").arg(&output).assert().success();
        let sequence = format::read(&output).unwrap();
        let estimate = Estimate::of(&sequence, "mine").unwrap();
        assert_eq!((estimate.trajectory.len(), sequence.graph_factors.len()), (4, 4));
        assert!(estimate.trajectory.iter().all(|row| row.covariance.is_some()));
        assert!(!estimate.iterations.is_empty());
        let file = &sequence.manifest.source.files[0];
        assert_eq!((file.name.as_str(), file.bytes), ("plane.g2o", PLANE.len() as u64));
    }
}

#[test]
fn a_problem_of_bal_is_adjusted_by_its_own_camera() {
    let folder = tempfile::tempdir().unwrap();
    let input = written(&folder, "problem.txt", &bal());
    let output = folder.path().join("adjusted.txt");
    let (told, _) = adjusted(&input, &output, &["--json", "--threads", "2"], 0);
    let told: Value = serde_json::from_str(&told).unwrap();
    let [before, after] = ["initial_cost", "final_cost"].map(|key| told[key].as_f64().unwrap());
    let read = |path: &Path| read_bal(fs::read(path).unwrap().as_slice()).unwrap();
    let (first, second) = (read(&input), read(&output));
    // The costs of the files by the formulas of the page, and those that were told.
    assert!((first.cost() - before).abs() < 1e-9 * before, "{before} {}", first.cost());
    assert!(
        (second.cost() - after).abs() < 1e-9 * after && after < 0.1 * before,
        "{after} {}",
        second.cost()
    );
    assert_eq!(first.observations, second.observations);
    assert!(
        second.cameras.iter().zip(&first.cameras).all(|(a, b)| a.focal != b.focal && a.radial != b.radial)
    );
    assert_eq!(told["unknowns"], 4 * 9 + 12 * 3);

    let (_, wrong) = adjusted(&input, &output, &[], 1);
    assert!(wrong.contains("exists"), "{wrong}");
    let (told, _) =
        adjusted(&input, &output, &["--force", "--loss", "huber:0.1", "--max-iterations", "1"], 3);
    assert!(told.contains("not converged") && told.contains("1 step"), "{told}");

    let sequence = folder.path().join("sequence");
    let (told, _) = adjusted(&input, &sequence, &[], 0);
    assert!(told.contains("bal from graph `initial`"), "{told}");
    os().arg("validate").arg(&sequence).assert().success();
    let found = format::read(&sequence).unwrap();
    let estimate = Estimate::of(&found, "bal").unwrap();
    assert_eq!((estimate.trajectory.len(), estimate.points.len()), (4, 12));
    for (camera, adjusted) in found.manifest.cameras.iter().zip(&second.cameras) {
        assert!((camera.fx - adjusted.focal).abs() < 1e-6 * adjusted.focal, "{camera:?}");
    }
    // A graph at the estimate costs what was told: distortion is undone at the adjusted intrinsics.
    let graph = FactorGraph::of(&found, "initial").unwrap();
    assert_eq!(graph.factors.len(), 48);
}

#[test]
fn what_is_wrong_is_told_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let whole = bal();
    let cut = written(&folder, "cut.txt", &whole[..whole.len() / 2]);
    let problem = written(&folder, "problem.txt", &whole);
    let graph = written(&folder, "space.g2o", SPACE);
    let torn = written(&folder, "torn.g2o", &SPACE[..SPACE.len() - 20]);
    let words = written(&folder, "words.txt", "hello world\n");
    let packed = folder.path().join("problem.txt.bz2");
    fs::write(&packed, b"BZh91AY&SY").unwrap();
    let colmap = folder.path().join("no-sequence");
    fs::create_dir(&colmap).unwrap();
    let out = |name: &str| folder.path().join(format!("out{name}"));
    let cases: [(&Path, PathBuf, &[&str], &str); 14] = [
        (&cut, out(".txt"), &[], "cut.txt"),
        (&torn, out(".g2o"), &[], "line 8: expected number"),
        (&words, out(".txt"), &[], "a graph of g2o"),
        (&words, out(".txt"), &["--from", "bal"], "line 1: expected the number of cameras"),
        (&packed, out(".txt"), &[], "is compressed; unpack it first: bunzip2"),
        (&colmap, out(".txt"), &["--from", "bal"], "expected a problem of BAL, found a folder"),
        (&problem, out(".g2o"), &[], "a problem of BAL becomes NAME.txt, NAME.mcap or a folder"),
        (&graph, out(".txt"), &[], "a graph of g2o becomes NAME.g2o, NAME.mcap or a folder"),
        (&problem, out(".txt"), &["--method", "point"], "--method does not go with a problem of BAL"),
        (&problem, out(".txt"), &["--fix", "0"], "--fix does not go with a problem of BAL"),
        (&problem, out(".txt"), &["--name", "mine"], "--name goes with an output that is a sequence"),
        (&graph, out(".g2o"), &["--graph", "initial"], "--graph goes with a sequence"),
        (&graph, out(".g2o"), &["--replace"], "--replace goes with a sequence"),
        (&graph, out(".g2o"), &["--soft"], "--soft goes with --method structural"),
    ];
    for (input, output, more, expected) in cases {
        let (_, wrong) = adjusted(input, &output, more, 1);
        assert!(wrong.contains(expected), "{}: expected {expected}, found {wrong}", input.display());
        assert!(!output.exists(), "{}", output.display());
    }
    let left: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.contains("out") || name.contains("partial"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    // The name does not matter where the format is said.
    let unnamed = written(&folder, "graph.dat", SPACE);
    adjusted(&unnamed, &out(".g2o"), &["--from", "g2o"], 0);
}

/// A pose graph adjusted by its own information.
fn summary(graph: &G2oGraph) -> Summary {
    let names = ImportNames { sequence: "s".to_owned(), graph: "g".to_owned() };
    let imported = from_g2o(graph, &names).unwrap();
    let graph = FactorGraph::of(&imported.sequence, "g").unwrap();
    adjust(&graph, &Options::of(Method::PoseGraph)).unwrap().summary
}

/// The graph with the weights that Ceres' pose-graph examples give it.
///
/// They whiten `[T.t − Z.t; 2 vec(Z.q T.q⁻¹)]`, and `[T.t − Z.t; θ]` in the plane, by the factor `L` of `Ω = L Lᵀ`, where `Lᵀ` would do it:
/// the weight is `LᵀL`. The error here is `[t; 2 vec q]` of `Z⁻¹ T`: the first is `Z.R t`, the second `−Z.R` times ours.
fn as_the_examples_of_ceres(mut graph: G2oGraph) -> G2oGraph {
    for element in &mut graph.elements {
        let (size, turn) = match (element.kind, element.numbers.as_slice()) {
            (G2oKind::EdgeSe2, [_, _, angle, ..]) => {
                let (sine, cosine) = angle.sin_cos();
                let rotation = Matrix2::new(cosine, -sine, sine, cosine);
                let mut turn = DMatrix::identity(3, 3);
                turn.view_mut((0, 0), (2, 2)).copy_from(&rotation);
                (3, turn)
            }
            (G2oKind::EdgeSe3, [_, _, _, x, y, z, w, ..]) => {
                let rotation = UnitQuaternion::new_normalize(Quaternion::new(*w, *x, *y, *z));
                let rotation: Matrix3<f64> = rotation.to_rotation_matrix().into_inner();
                let mut turn = DMatrix::zeros(6, 6);
                turn.view_mut((0, 0), (3, 3)).copy_from(&rotation);
                turn.view_mut((3, 3), (3, 3)).copy_from(&-rotation);
                (6, turn)
            }
            _ => continue,
        };
        let upper: Vec<(usize, usize)> =
            (0..size).flat_map(|row| (row..size).map(move |column| (row, column))).collect();
        let weights = element.numbers.len() - upper.len();
        let mut information = DMatrix::zeros(size, size);
        for ((row, column), number) in upper.iter().zip(&element.numbers[weights..]) {
            information[(*row, *column)] = *number;
            information[(*column, *row)] = *number;
        }
        let factor = information.cholesky().unwrap().l();
        let weighed = turn.transpose() * factor.transpose() * factor * turn;
        for (place, number) in upper.into_iter().zip(&mut element.numbers[weights..]) {
            *number = weighed[place];
        }
    }
    graph
}

/// Costs by the information of the files, from an independent implementation (NumPy, Gauss-Newton with differences); and before and
/// after Ceres' pose-graph examples, which weigh otherwise.
#[test]
fn real_pose_graphs_reach_the_costs_of_other_solvers() {
    for (name, least, ceres_before, ceres_after) in [
        ("sphere2500", 6.756_078_487e2, 1.292_357e6, 6.757_562e2),
        ("parking-garage", 6.341_921_918e-1, 8.362_723e3, 6.341_883e-1),
        ("smallGrid3D", 5.126_990_278e2, 6.027_990e4, 5.126_991e2),
        ("intel", 2.250_234_791e1, 2.799_889e2, 2.293_880e1),
    ] {
        let Some(path) = shared(&format!("pose-graphs/{name}.g2o")) else { return };
        let graph = read_g2o(fs::read(&path).unwrap().as_slice()).unwrap();
        let own = summary(&graph);
        assert!(own.ending.has_converged());
        // The solver stops at steps that lower the cost by a part in 1e9.
        assert!((own.final_cost - least).abs() < 1e-8 * least, "{name}: {} {least}", own.final_cost);
        let theirs = summary(&as_the_examples_of_ceres(graph));
        // Costs are known to seven digits.
        assert!(
            (theirs.initial_cost - ceres_before).abs() < 5e-7 * ceres_before,
            "{name}: {}",
            theirs.initial_cost
        );
        assert!(
            theirs.final_cost < ceres_after * (1.0 + 5e-7),
            "{name}: {} {ceres_after}",
            theirs.final_cost
        );
        assert!(
            theirs.final_cost > ceres_after * (1.0 - 5e-6),
            "{name}: {} {ceres_after}",
            theirs.final_cost
        );
    }
}

/// Costs before and after by Ceres, with its `bundle_adjuster`'s camera.
#[test]
fn real_problems_of_bal_reach_the_costs_of_other_solvers() {
    for (name, before, after) in [
        ("problem-49-7776-pre", 8.509_125e5, 1.334_424e4),
        ("problem-16-22106-pre", 4.185_660e6, 1.803_390e4),
    ] {
        let Some(path) = shared(&format!("bal/{name}.txt")) else { return };
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("adjusted.txt");
        let told: Value = serde_json::from_str(&adjusted(&path, &output, &["--json"], 0).0).unwrap();
        let [initial, last] = ["initial_cost", "final_cost"].map(|key| told[key].as_f64().unwrap());
        assert!((initial - before).abs() < 5e-7 * before, "{name}: {initial} {before}");
        assert!((last - after).abs() < 5e-7 * after || last < after, "{name}: {last} {after}");
        let problem = read_bal(fs::read(&output).unwrap().as_slice()).unwrap();
        assert!((problem.cost() - last).abs() < 1e-9 * last, "{name}: {} {last}", problem.cost());
    }
}
