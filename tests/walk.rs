//! The whole way: a recipe, measurements, tracking, a graph, adjustment, figures.
//!
//! Without noise it ends at zero, and the estimates are the same when the truth is taken out of the file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use open_structure::evaluate::{Alignment, absolute};
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::Pose;
use open_structure::structure::{
    Estimate, FrameId, LineObservation, PointObservation, Sequence, StructuralGroup, registry,
};

fn os(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_os")).current_dir(folder).args(arguments).output().unwrap();
    let words =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code(), words)
}

#[track_caller]
fn done(folder: &Path, arguments: &[&str]) -> String {
    let (code, words) = os(folder, arguments);
    assert_eq!(code, Some(0), "os {}: {words}", arguments.join(" "));
    words
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("walk.toml"), recipe()).unwrap();
        done(folder.path(), &["simulate", "walk.toml", "-o", "walk"]);
        Self(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn read(&self, name: &str) -> Sequence {
        format::read(self.path().join(name)).unwrap()
    }
}

/// The recipe of box1 with fewer frames.
fn recipe() -> String {
    let text =
        fs::read_to_string(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml")).unwrap();
    let text = text.split("[expected]").next().unwrap().to_owned();
    assert!(text.contains("frames = 447"));
    text.replace("frames = 447", "frames = 90").replace("count = 130", "count = 200")
}

fn poses(estimate: &Estimate) -> Vec<(FrameId, Pose)> {
    let pose = |row: &open_structure::structure::TrajectoryPose| row.world_from_camera().pose().unwrap();
    estimate.trajectory.iter().map(|row| (row.frame_id, pose(row))).collect()
}

fn truth(sequence: &Sequence) -> Vec<(FrameId, Pose)> {
    let pose = |frame: &open_structure::structure::Frame| frame.world_from_camera().unwrap().pose().unwrap();
    sequence.frames.iter().map(|frame| (frame.frame_id, pose(frame))).collect()
}

/// Everything that a method makes of a sequence, by the name of the estimate.
const WAY: &[(&str, &[&str])] = &[
    ("frame-to-frame", &["track", "--method", "frame-to-frame"]),
    ("map-to-frame", &["track", "--method", "map-to-frame"]),
    ("frame-to-frame-classic", &["track", "--method", "frame-to-frame", "--classic"]),
    ("map-to-frame-classic", &["track", "--method", "map-to-frame", "--classic"]),
    ("", &["graph", "--estimate", "map-to-frame", "--name", "tracked"]),
    ("point-ba", &["adjust", "--graph", "tracked", "--method", "point"]),
    ("point-line-ba", &["adjust", "--graph", "tracked", "--method", "point-line"]),
    ("structural-ba", &["adjust", "--graph", "tracked", "--method", "structural"]),
    ("", &["graph", "--estimate", "frame-to-frame", "--kind", "pose-graph", "--name", "loops"]),
    ("pose-graph", &["adjust", "--graph", "loops", "--method", "pose-graph"]),
];

/// Walks the whole way from a sequence; each step adds to the one before.
fn walk(folder: &Path, from: &str, first_pose: Option<&str>) -> String {
    let mut last = from.to_owned();
    for (step, (_, arguments)) in WAY.iter().enumerate() {
        let next = format!("{from}-{step}");
        let mut all = vec![arguments[0], &last, "-o", &next];
        all.extend(&arguments[1..]);
        if let Some(pose) = first_pose.filter(|_| arguments[0] == "track") {
            all.extend(["--first-pose", pose]);
        }
        done(folder, &all);
        last = next;
    }
    last
}

#[test]
fn without_noise_every_method_ends_at_zero() {
    let folder = Folder::new();
    done(folder.path(), &["measure", "walk", "-o", "exact", "--noise", "none"]);
    let last = walk(folder.path(), "exact", None);
    done(folder.path(), &["validate", &last]);
    let sequence = folder.read(&last);
    let truth = truth(&sequence);
    for (name, _) in WAY.iter().filter(|(name, _)| !name.is_empty()) {
        let estimate = Estimate::of(&sequence, name).unwrap();
        let found = absolute(&truth, &poses(&estimate), Alignment::NONE).unwrap();
        assert_eq!(estimate.trajectory.len(), sequence.frames.len(), "{name}");
        // Metres and radians: rounding alone.
        assert!(found.translation.rmse() < 1e-9, "{name}: {:e} m", found.translation.rmse());
        assert!(found.rotation.rmse() < 1e-9, "{name}: {:e} rad", found.rotation.rmse());
        let point = |id| sequence.point_landmarks.iter().find(|row| row.point_id == id).unwrap();
        for row in &estimate.points {
            let at = point(row.point_id);
            let away = (row.x - at.x).abs().max((row.y - at.y).abs()).max((row.z - at.z).abs());
            assert!(away < 1e-8, "{name}, {}: {away:e} m", row.point_id);
        }
    }
    let said = done(folder.path(), &["evaluate", &last, "--json"]);
    assert!(said.contains("structural-ba"), "{said}");
}

#[test]
fn estimates_do_not_change_when_the_truth_is_taken_out() {
    let folder = Folder::new();
    done(folder.path(), &["measure", "walk", "-o", "noisy", "--noise", "first-release", "--seed", "3"]);
    let mut blind = folder.read("noisy");
    let first =
        blind.frames[0].world_from_camera().unwrap().numbers().map(|number| number.to_string()).join(",");
    for frame in &mut blind.frames {
        *frame =
            open_structure::structure::Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    blind.point_landmarks.clear();
    blind.line_landmarks.clear();
    blind.point_observations = Vec::<PointObservation>::new();
    blind.line_observations = Vec::<LineObservation>::new();
    blind.point_correspondences.clear();
    blind.line_correspondences.clear();
    blind.frame_statistics.clear();
    blind.structural_groups =
        blind.structural_groups.iter().map(StructuralGroup::without_direction).collect();
    blind.manifest.tables.clear();
    format::write(&folder.path().join("blind"), &blind, WriteOptions::default()).unwrap();

    let with = folder.read(&walk(folder.path(), "noisy", None));
    let without = folder.read(&walk(folder.path(), "blind", Some(&first)));
    assert!(without.frames.iter().all(|frame| frame.world_from_camera().is_none()));
    for (name, _) in WAY.iter().filter(|(name, _)| !name.is_empty()) {
        assert_eq!(Estimate::of(&with, name), Estimate::of(&without, name), "{name}");
    }
    assert_eq!(with.graph_factors, without.graph_factors);
    assert_eq!(with.graph_poses, without.graph_poses);
    assert!(with.tracking.iter().all(|row| row.state != registry::LOST));
}

#[test]
fn noise_is_what_estimates_differ_by_and_each_step_of_the_way_comes_closer() {
    let folder = Folder::new();
    done(folder.path(), &["measure", "walk", "-o", "noisy", "--noise", "first-release", "--seed", "5"]);
    let sequence = folder.read(&walk(folder.path(), "noisy", None));
    let truth = truth(&sequence);
    let error = |name: &str| {
        let estimate = Estimate::of(&sequence, name).unwrap();
        absolute(&truth, &poses(&estimate), Alignment::SE3).unwrap().translation.rmse()
    };
    // A map is better than the frame before, covariances are better than averages, all together better than one at a time.
    assert!(
        error("map-to-frame") < error("frame-to-frame"),
        "{} {}",
        error("map-to-frame"),
        error("frame-to-frame")
    );
    assert!(error("frame-to-frame") < error("frame-to-frame-classic"));
    assert!(error("structural-ba") < error("map-to-frame-classic"));
    assert!(error("structural-ba") < 0.05, "{} m", error("structural-ba"));
}

#[test]
fn a_start_that_nothing_joins_to_the_rest_is_placed_in_hindsight() {
    // The first frames of this sphere share no landmark; later ones see what the first one saw.
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["simulate", "sphere2", "-o", "sphere"]);
    done(at, &["measure", "sphere", "--noise", "none", "-o", "measured"]);
    done(at, &["track", "measured", "-o", "tracked"]);
    done(at, &["graph", "tracked", "-o", "graph"]);
    done(at, &["adjust", "graph", "--method", "structural", "-o", "adjusted"]);
    let sequence = format::read(at.join("adjusted").as_path()).unwrap();
    let truth = truth(&sequence);
    for name in ["map-to-frame", "structural-ba"] {
        let estimate = Estimate::of(&sequence, name).unwrap();
        let found = absolute(&truth, &poses(&estimate), Alignment::NONE).unwrap();
        // Metres; without alignment: the first true pose holds, though the map was not begun there.
        assert!(found.translation.rmse() < 1e-9, "{name}: {:e} m", found.translation.rmse());
        assert_eq!(found.ids.len(), 100, "{name}");
    }
}

#[test]
fn what_is_dear_to_somebody_is_not_replaced() {
    let folder = Folder::new();
    let at = folder.path();
    done(at, &["measure", "walk", "--noise", "first-release", "-o", "measured"]);
    let track = |output: &str| os(at, &["track", "measured", "-o", output, "--force"]);
    fs::create_dir_all(at.join("dear/walk")).unwrap();
    fs::write(at.join("dear/thesis.txt"), "years").unwrap();
    fs::write(at.join("letter"), "love").unwrap();
    fs::create_dir(at.join("folder.mcap")).unwrap();
    for (output, found) in [
        ("dear", "`"),
        ("letter", "found a file"),
        ("folder.mcap", "found a folder"),
        ("/dev/null", "found a device"),
        ("measured/inner", "lies in the input"),
    ] {
        let (code, words) = track(output);
        assert_eq!(code, Some(1), "{output}: {words}");
        assert!(words.contains(output) && words.contains(found), "{output}: {words}");
    }
    assert_eq!(fs::read_to_string(at.join("dear/thesis.txt")).unwrap(), "years");
    assert_eq!(fs::read_to_string(at.join("letter")).unwrap(), "love");
    // What may be replaced: a sequence, and an empty folder.
    fs::create_dir(at.join("empty")).unwrap();
    done(at, &["track", "measured", "-o", "empty", "--force"]);
    done(at, &["track", "measured", "-o", "empty", "--force"]);
    let (code, words) = os(at, &["evaluate", "empty", "--per-frame", "empty/frames.parquet", "--force"]);
    assert_eq!(code, Some(1), "{words}");
    assert!(words.contains("lies in one"), "{words}");
    done(at, &["validate", "empty"]);
}

#[test]
fn values_out_of_range_are_misuse() {
    let folder = tempfile::tempdir().unwrap();
    for (command, option, value) in [
        ("adjust", "--threads", "0"),
        ("adjust", "--threads", "100000"),
        ("adjust", "--min-views", "0"),
        ("adjust", "--tolerance", "nan"),
        ("adjust", "--sigma-px", "0"),
        ("adjust", "--soft", "0"),
        ("benchmark", "--threads", "100000"),
        ("graph", "--min-views", "0"),
    ] {
        let (code, words) = os(folder.path(), &[command, "none", "-o", "out", option, value]);
        assert_eq!(code, Some(2), "{command} {option}: {words}");
        assert!(words.contains(option) && words.contains("expected"), "{words}");
    }
}

#[test]
fn the_solver_says_how_it_goes_about_it_and_does_as_it_is_told() {
    let folder = Folder::new();
    let at = folder.path();
    done(at, &["measure", "walk", "--noise", "first-release", "-o", "measured"]);
    done(at, &["track", "measured", "-o", "tracked"]);
    done(at, &["graph", "tracked", "-o", "graph"]);
    let mut costs = Vec::new();
    for (eliminate, factorise) in [("landmarks", "dense"), ("poses", "sparse"), ("nothing", "sparse")] {
        let given = ["--eliminate", eliminate, "--factorise", factorise, "--explain", "--json"];
        let adjust = ["adjust", "graph", "--method", "point", "-o", "adjusted", "--force"];
        let words = done(at, &[&adjust[..], &given].concat());
        assert!(words.contains(&format!("-> eliminate {eliminate}")), "{words}");
        assert!(words.contains(factorise), "{words}");
        let cost = words.split("\"final_cost\": ").nth(1).unwrap().split(',').next().unwrap();
        costs.push(cost.parse::<f64>().unwrap());
    }
    // The same minimum, to where steps end.
    assert!(costs.iter().all(|cost| (cost / costs[0] - 1.0).abs() < 1e-7), "{costs:?}");
}

#[test]
fn what_estimators_cannot_use_is_refused() {
    let folder = Folder::new();
    let at = folder.path();
    done(at, &["measure", "walk", "--noise", "first-release", "-o", "measured"]);
    let refused = |arguments: &[&str], expected: &str| {
        let (code, words) = os(at, arguments);
        assert_eq!(code, Some(1), "{words}");
        assert!(words.contains(expected), "{words}");
    };
    refused(&["track", "measured", "-o", "x", "--baseline", "0.1"], "--sensor stereo");
    refused(&["track", "measured", "-o", "x", "--name", "truth"], "stands for the true poses");
    done(at, &["track", "measured", "-o", "tracked"]);
    refused(&["adjust", "tracked", "-o", "x"], "`os graph` makes one");
    refused(&["graph", "tracked", "-o", "x", "--kind", "pose-graph", "--key-frames"], "--kind reprojection");
    refused(&["graph", "tracked", "-o", "x", "--min-views", "9999"], "would be empty");
    done(at, &["graph", "tracked", "-o", "graph"]);
    refused(&["adjust", "graph", "-o", "x", "--method", "point", "--no-groups"], "--method structural");
    let manifest = at.join("measured/sequence.json");
    let text = fs::read_to_string(&manifest).unwrap();
    assert!(text.contains("\"pinhole\""));
    fs::write(&manifest, text.replace("\"pinhole\"", "\"fisheye\"")).unwrap();
    refused(&["track", "measured", "-o", "x"], "found `fisheye`");
    assert!(!at.join("x").exists());
}
