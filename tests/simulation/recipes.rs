//! Every recipe that travels with the program: what it makes, and that it is conformant.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use open_structure::datasets;
use open_structure::format;
use open_structure::geometry::PinholeCamera;
use open_structure::simulate::{self, Recipe};
use open_structure::structure::{FrameStatistics, PointObservation};
use open_structure::validate::{self, Options};

use super::{SMALL, done, os, text};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn every_recipe_in_the_folder_travels_with_the_program() {
    let found: BTreeSet<String> = fs::read_dir(root().join("sequences"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    let known: BTreeSet<String> =
        simulate::names().into_iter().chain(datasets::names()).map(str::to_owned).collect();
    assert_eq!(found, known);
    for name in ["box1", "box2", "corridor1", "corridor2", "sphere1", "sphere2"] {
        assert_eq!(simulate::named(name).unwrap().name, name);
    }
}

/// With `UPDATE_SPEC=1` the recipes are told what they make.
#[test]
fn every_recipe_makes_what_it_says_and_is_conformant() {
    let folder = tempfile::tempdir().unwrap();
    let update = std::env::var_os("UPDATE_SPEC").is_some();
    for name in simulate::names() {
        let output = folder.path().join(name);
        // The file, for the program has the text that it was built with.
        let path = root().join("sequences").join(format!("{name}.toml"));
        let run = os(&["simulate", text(&path), "-o", text(&output), "--print-expected"]);
        let stdout = String::from_utf8(run.stdout).unwrap();
        if update {
            let recipe = fs::read_to_string(&path).unwrap();
            let recipe = recipe.split("\n[expected]").next().unwrap().trim_end();
            let table = stdout.split("\n[expected]").nth(1).unwrap().trim_end();
            fs::write(&path, format!("{recipe}\n\n[expected]{table}\n")).unwrap();
        } else {
            let stderr = String::from_utf8(run.stderr).unwrap();
            assert_eq!(run.status.code(), Some(0), "{name}: {stderr}");
            assert!(Recipe::from_toml(&fs::read_to_string(&path).unwrap()).unwrap().expected.is_some());
        }

        let report = validate::validate(&output, &Options::default()).unwrap();
        assert!(report.conformant && report.findings.is_empty(), "{name}: {report:?}");
        let reader = format::open(&output).unwrap();
        let statistics = reader.table::<FrameStatistics>().unwrap();
        assert_eq!(statistics.len(), reader.frame_list().unwrap().len());
        assert!(statistics.iter().all(|frame| frame.covered_cells.is_some()));
        done(&["stats", text(&output)]);
    }
}

#[test]
fn the_same_seed_makes_the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let recipe = folder.path().join("small.toml");
    fs::write(&recipe, SMALL).unwrap();
    let make = |threads: &str, seed: &str| {
        let output = folder.path().join(format!("{threads}-{seed}.mcap"));
        let status = std::process::Command::new(env!("CARGO_BIN_EXE_os"))
            .args(["simulate", text(&recipe), "-o", text(&output), "--seed", seed])
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .unwrap()
            .status;
        assert!(status.success());
        fs::read(output).unwrap()
    };
    let one = make("1", "3");
    assert!(one == make("3", "3") && one == make("5", "3"));
    assert!(one != make("1", "4"));
}

#[test]
fn a_sequence_is_made_again_from_the_recipe_in_its_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let [recipe, first, json, second] =
        ["small.toml", "first.mcap", "again.json", "second.mcap"].map(|name| folder.path().join(name));
    fs::write(&recipe, SMALL).unwrap();
    done(&["simulate", text(&recipe), "-o", text(&first)]);
    let manifest = format::open(&first).unwrap().manifest().clone();
    fs::write(&json, &manifest.generator.parameters["recipe"]).unwrap();
    done(&["simulate", text(&json), "-o", text(&second)]);
    assert!(fs::read(&first).unwrap() == fs::read(&second).unwrap());
}

#[test]
fn a_recipe_with_everything_in_it_is_conformant_and_keeps_its_promises() {
    let recipe = Recipe::from_toml(SMALL).unwrap();
    let simulation = simulate::simulate(&recipe, Path::new(""), &|_, _, _| {}).unwrap();
    let camera = recipe.camera.pinhole("camera").unwrap();
    assert!(camera.fy < 0.0);
    let mut seen = vec![[0_u32; 2]; 10_000];
    let mut per_frame = Vec::new();
    for bundle in simulation.bundles() {
        per_frame.push(bundle.point_observations.len());
        for row in &bundle.point_observations {
            seen[usize::try_from(row.point_id.0).unwrap()][0] += 1;
            assert_projects(&camera, row, &simulation);
        }
        for row in &bundle.line_observations {
            seen[usize::try_from(row.line_id.0).unwrap()][1] += 1;
            let length = (row.end_u - row.start_u).hypot(row.end_v - row.start_v);
            // Pixels; the part was measured before it was projected again.
            assert!(length > 5.0 - 1e-6, "{row:?}");
        }
        // A tenth is missed.
        assert!(bundle.point_measurements.len() <= bundle.point_observations.len());
    }
    per_frame.sort_unstable();
    // "low" means 20 points in the median frame; the pilot of 512 points knows it to a few percent.
    let median = per_frame[per_frame.len() / 2];
    assert!((14..=27).contains(&median), "{median}");
    let points = simulation.point_landmarks().len();
    assert!(
        seen[..points].iter().all(|seen| seen[0] >= 2) && simulation.line_landmarks().unwrap().len() == 25
    );
    assert!(seen[..25].iter().all(|seen| seen[1] >= 2));

    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["small.toml", "small"].map(|name| folder.path().join(name));
    fs::write(&path, SMALL).unwrap();
    done(&["simulate", text(&path), "-o", text(&output)]);
    done(&["validate", "--deny", "warnings", text(&output)]);
}

fn assert_projects(camera: &PinholeCamera, row: &PointObservation, simulation: &simulate::Simulation) {
    let frame = &simulation.frames()[usize::try_from(row.frame_id.0).unwrap()];
    let pose = frame.world_from_camera().unwrap().pose().unwrap();
    let landmark = &simulation.point_landmarks()[usize::try_from(row.point_id.0).unwrap()];
    let in_camera = pose.inverse() * landmark.position();
    let pixel = camera.project(in_camera).unwrap();
    // Pixels and metres: the same sum in another order.
    assert!((pixel.x - row.u).abs() < 1e-9 && (pixel.y - row.v).abs() < 1e-9);
    assert!((in_camera.z - row.depth.unwrap()).abs() < 1e-12);
    assert!(camera.contains(pixel, 1e-9));
}

#[test]
fn the_schema_of_recipes_is_that_of_the_code_and_holds_every_recipe() {
    static WRITING: Mutex<()> = Mutex::new(());
    let _one = WRITING.lock();
    let path = root().join("sequences/recipe.schema.json");
    let text = Recipe::json_schema();
    if std::env::var_os("UPDATE_SPEC").is_some() {
        fs::write(&path, &text).unwrap();
    }
    assert!(fs::read_to_string(&path).unwrap() == text, "{}: `make spec` writes it", path.display());
    let validator = jsonschema::validator_for(&serde_json::from_str(&text).unwrap()).unwrap();
    let mut recipes = vec![SMALL.to_owned()];
    for name in simulate::names() {
        recipes.push(fs::read_to_string(root().join("sequences").join(format!("{name}.toml"))).unwrap());
    }
    for recipe in recipes {
        let value: serde_json::Value = toml::from_str(&recipe).unwrap();
        assert!(validator.is_valid(&value), "{:?}", validator.iter_errors(&value).collect::<Vec<_>>());
        let resolved = serde_json::to_value(Recipe::from_toml(&recipe).unwrap()).unwrap();
        assert!(validator.is_valid(&resolved), "{:?}", validator.iter_errors(&resolved).collect::<Vec<_>>());
    }
    let wrong =
        serde_json::json!({"name": "x", "trajectory": {"kind": "wave", "frames": 3}, "scene": [], "sead": 1});
    assert!(!validator.is_valid(&wrong));
}

#[test]
fn the_recipe_of_the_readme_is_conformant() {
    let readme = fs::read_to_string(root().join("sequences/README.md")).unwrap();
    let recipe = readme.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["stairs.toml", "stairs"].map(|name| folder.path().join(name));
    fs::write(&path, recipe).unwrap();
    done(&["simulate", text(&path), "-o", text(&output)]);
    done(&["validate", "--deny", "warnings", text(&output)]);
}

/// With `UPDATE_SPEC=1` the picture is drawn anew.
#[test]
fn the_picture_of_box1_is_what_the_program_draws() {
    let folder = tempfile::tempdir().unwrap();
    let [sequence, picture] = ["box1", "box1.svg"].map(|name| folder.path().join(name));
    done(&["simulate", "box1", "-o", text(&sequence)]);
    done(&["plot", text(&sequence), "-o", text(&picture)]);
    let (drawn, path) = (fs::read_to_string(&picture).unwrap(), root().join("sequences/box1.svg"));
    if std::env::var_os("UPDATE_SPEC").is_some() {
        fs::write(&path, &drawn).unwrap();
    }
    assert!(fs::read_to_string(path).unwrap() == drawn, "`make spec` draws it");
}
