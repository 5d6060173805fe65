//! A small text release, made here, goes all the way: both archives, both encodings, every decision.
#![expect(clippy::unwrap_used, clippy::float_cmp, clippy::format_push_string, reason = "tests")]

mod scene;

use nalgebra::Point3;
use open_structure::format;
use open_structure::structure::{Sequence, registry};
use scene::{Noise, Release, Scene};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Runs `os-convert open-structure` and gives exit code, stdout and stderr.
fn os_convert(arguments: &[&str], threads: usize) -> (i32, String, String) {
    let output = assert_cmd::Command::cargo_bin("os-convert")
        .unwrap()
        .arg("open-structure")
        .args(arguments)
        .env("RAYON_NUM_THREADS", threads.to_string())
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Writes a release into `folder/name` and converts it; gives the sequence and the exit code.
fn converted(release: &Release, name: &str) -> (Sequence, i32) {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join(name);
    release.write_archives(&place);
    let outputs = ["x.mcap", "x"].map(|output| folder.path().join(output));
    let mut found = Vec::new();
    for output in &outputs {
        let (code, out, err) = os_convert(&[place.to_str().unwrap(), "-o", output.to_str().unwrap()], 2);
        assert!(code == 0 || code == 3, "{code} {out} {err}");
        found.push((format::read(output).unwrap(), code));
    }
    assert_eq!(found[0], found[1], "both encodings hold the same");
    found.swap_remove(0)
}

/// Median distance of point rows from the images of the sequence's landmarks, pixels.
fn median_px(sequence: &Sequence, rows: impl Iterator<Item = (i64, i64, f64, f64)>) -> f64 {
    let camera = sequence.manifest.cameras[0].projection();
    let poses: BTreeMap<i64, _> = sequence
        .frames
        .iter()
        .filter_map(|frame| Some((frame.frame_id.0, frame.world_from_camera()?.pose().unwrap().inverse())))
        .collect();
    let points: BTreeMap<i64, Point3<f64>> =
        sequence.point_landmarks.iter().map(|point| (point.point_id.0, point.position())).collect();
    let mut distances: Vec<f64> = rows
        .map(|(frame, point, u, v)| {
            let image = camera.project(poses[&frame] * points[&point]).unwrap();
            (image.x - u).hypot(image.y - v)
        })
        .collect();
    distances.sort_by(f64::total_cmp);
    distances[distances.len() / 2]
}

#[test]
fn a_noise_free_association_becomes_observations_and_the_graph_measurements() {
    let scene = Scene::new();
    let release = scene.release(Noise::None, Noise::FirstRelease { seed: 7 });
    let (sequence, code) = converted(&release, "box9");
    assert_eq!(code, 0, "{:?}", sequence.manifest.excluded);
    let rows = scene.rows();
    assert_eq!(sequence.frames.len(), scene.frames.len());
    assert_eq!(sequence.point_landmarks.len(), scene.points.len());
    assert_eq!(sequence.line_landmarks.len(), scene.lines.len());
    assert_eq!(sequence.point_observations.len(), rows.points.len());
    assert_eq!(sequence.line_observations.len(), rows.lines.len());
    assert_eq!(sequence.point_measurements.len(), rows.points.len());
    assert_eq!(sequence.line_measurements.len(), rows.lines.len());
    assert_eq!(sequence.graph_factors.len(), rows.points.len() + rows.lines.len());
    assert_eq!(sequence.graph_poses.iter().filter(|pose| pose.fixed).count(), 1);
    assert!(sequence.graph_poses[0].fixed);
    assert_eq!(sequence.frame_statistics.len(), sequence.frames.len());

    let manifest = &sequence.manifest;
    assert_eq!(manifest.generator.parameters["camera.family"], "simulated");
    assert_eq!(manifest.generator.parameters["camera.chosen_by"], "data");
    let noise = manifest.noise.as_ref().unwrap();
    assert_eq!((noise.model.as_str(), noise.parameters["sigma_px"]), (registry::NOISE_FIRST_RELEASE, 1.0));
    assert_eq!(noise.parameters["sigma_depth_m"], 0.05);
    assert_eq!(manifest.source.files.len(), 2);

    let observed =
        sequence.point_observations.iter().map(|row| (row.frame_id.0, row.point_id.0, row.u, row.v));
    // Six digits of a pixel below 1000.
    assert!(median_px(&sequence, observed) < 1e-3);
    let measured =
        sequence.point_measurements.iter().map(|row| (row.frame_id.0, row.point_id.0, row.u, row.v));
    // The median length of two unit Gaussians is √(2 ln 2) = 1.18; some 4000 rows.
    assert!((median_px(&sequence, measured) - 1.177).abs() < 0.1);
}

#[test]
fn depths_and_unrefined_lines_are_recovered() {
    let scene = Scene::new();
    let (sequence, _) = converted(&scene.release(Noise::None, Noise::FirstRelease { seed: 3 }), "box9");
    let recovered: BTreeMap<&str, u64> =
        sequence.manifest.recovered.iter().map(|recovery| (recovery.table.as_str(), recovery.rows)).collect();
    let points = sequence.point_observations.len() as u64;
    assert_eq!(
        recovered,
        BTreeMap::from([("map_lines", scene.lines.len() as u64), ("point_observations", points)])
    );
    for row in &sequence.point_observations {
        let truth = scene.depth_of_point(row.frame_id.0, row.point_id.0);
        // Landmarks and poses have six decimals.
        assert!((row.depth.unwrap() - truth).abs() < 1e-5);
    }
    let published: BTreeMap<i64, _> =
        sequence.line_landmarks.iter().map(|line| (line.line_id.0, line.segment())).collect();
    for line in sequence.map_lines.iter().filter(|line| line.estimate == "unrefined") {
        let found = line.segment();
        let truth = scene.lines[&line.line_id.0].unrefined;
        let (on_truth, covers) = (truth.plucker().unwrap(), found.length() / truth.length());
        // Pixels of six digits at 4 m: micrometres, times the number of views' share; 0.1 mm is generous.
        assert!(
            on_truth.distance_to_point(found.start) < 1e-4 && on_truth.distance_to_point(found.end) < 1e-4
        );
        assert!((covers - 1.0).abs() < 1e-3, "{covers}");
        // The published line was turned by degrees, and keeps its direction's sign in the recovered one.
        let angle = published[&line.line_id.0].plucker().unwrap().angle_to(&found.plucker().unwrap());
        assert!(angle > 0.005, "{angle}");
        assert!(published[&line.line_id.0].direction().unwrap().dot(&found.direction().unwrap()) > 0.0);
    }
    for group in &sequence.structural_groups {
        let direction = group.direction().unwrap();
        for line in &group.line_ids {
            let angle = published[&line.0].direction().unwrap().cross(&direction).norm();
            assert!(angle < 1e-5, "{angle}");
        }
    }
}

#[test]
fn a_noisy_association_becomes_measurements_once() {
    let scene = Scene::new();
    let noise = Noise::FirstRelease { seed: 11 };
    let (sequence, _) = converted(&scene.release(noise, noise), "nostructure_texture_far");
    let rows = scene.rows();
    assert!(sequence.point_observations.is_empty() && sequence.line_observations.is_empty());
    assert_eq!(sequence.point_measurements.len(), rows.points.len());
    assert_eq!(sequence.line_measurements.len(), rows.lines.len());
    // Lines turned by up to 3 degrees are found turned under noise, too, and the fit goes through the noise.
    let unrefined: Vec<_> = sequence.map_lines.iter().filter(|line| line.estimate == "unrefined").collect();
    assert_eq!(unrefined.len(), scene.lines.len());
    for line in unrefined {
        let truth = scene.lines[&line.line_id.0].unrefined;
        let midpoint = truth.plucker().unwrap().distance_to_point(line.segment().midpoint());
        let angle = truth.plucker().unwrap().angle_to(&line.segment().plucker().unwrap());
        // A pixel at 4 m is 7 mm; over a parallax of 0.4 and some thirty views an end is known to 1 cm along the view, and the
        // line is 0.3 m long on either side: 0.04 rad. Twice that.
        assert!(midpoint < 0.03 && angle < 0.08, "{midpoint} m, {angle} rad");
    }
    // The family comes from the data: six decimals are not TUM's.
    assert_eq!(sequence.manifest.generator.parameters["camera.family"], "simulated");
}

#[test]
fn other_rows_of_a_noisy_graph_stay_in_its_factors() {
    let scene = Scene::new();
    let release = scene.release(Noise::FirstRelease { seed: 1 }, Noise::FirstRelease { seed: 2 });
    let (sequence, _) = converted(&release, "sphere9");
    assert!(sequence.point_observations.is_empty());
    let factor = &sequence.graph_factors[0];
    let row = sequence
        .point_measurements
        .iter()
        .find(|row| Some(row.frame_id) == factor.frame_id && Some(row.point_id) == factor.point_id)
        .unwrap();
    assert_ne!(factor.measurement, [row.u, row.v]);
    let notes: Vec<_> =
        sequence.manifest.generator.parameters.iter().filter(|(key, _)| key.starts_with("note")).collect();
    assert!(notes.iter().any(|(_, note)| note.contains("the graph has other ones")), "{notes:?}");
}

#[test]
fn a_noise_free_graph_is_measured_without_noise() {
    let scene = Scene::new();
    let (sequence, _) = converted(&scene.release(Noise::None, Noise::None), "hospital9");
    assert_eq!(sequence.point_observations.len(), sequence.point_measurements.len());
    let noise = sequence.manifest.noise.unwrap();
    assert_eq!((noise.model.as_str(), noise.parameters.len()), (registry::NOISE_NONE, 0));
}

#[test]
fn lines_that_were_never_published_are_recovered() {
    let scene = Scene::new();
    let mut release = scene.release(Noise::None, Noise::FirstRelease { seed: 5 });
    release.observation.remove("structline_landmarks.txt");
    let (sequence, _) = converted(&release, "carwelding9");
    assert_eq!(sequence.line_landmarks.len(), scene.lines.len());
    for line in &sequence.line_landmarks {
        let truth = scene.lines[&line.line_id.0].unrefined;
        assert!(truth.plucker().unwrap().distance_to_line(&line.plucker()) < 1e-4);
        assert!(truth.plucker().unwrap().angle_to(&line.plucker()) < 1e-4);
    }
    let recovery =
        &sequence.manifest.recovered.iter().find(|recovery| recovery.table == "line_landmarks").unwrap();
    assert_eq!(recovery.ids, scene.lines.keys().copied().collect::<Vec<_>>());
    assert!(
        sequence.map_lines.is_empty(),
        "there is no published line that these would be the unrefined ones of"
    );
}

#[test]
fn a_sequence_may_be_a_graph_alone() {
    let scene = Scene::new();
    let mut release = scene.release(Noise::None, Noise::FirstRelease { seed: 9 });
    release.observation.clear();
    let (sequence, _) = converted(&release, "livingroom9");
    assert_eq!(sequence.frames.len(), scene.frames.len());
    assert!(sequence.frames.iter().all(|frame| frame.world_from_camera().is_some()));
    assert!(sequence.point_landmarks.is_empty() && sequence.line_landmarks.is_empty());
    assert!(sequence.point_observations.is_empty() && !sequence.point_measurements.is_empty());
    assert!(sequence.structural_groups.iter().all(|group| group.direction().is_none()));
    assert_eq!(sequence.manifest.noise.unwrap().parameters["sigma_px"], 1.0);
}

#[test]
fn what_cannot_be_used_is_counted_with_file_and_line() {
    let scene = Scene::new();
    let mut release = scene.release(Noise::None, Noise::FirstRelease { seed: 5 });
    let association = release.observation.get_mut("association.txt").unwrap();
    let first = association.lines().count() as u64 + 1;
    let (point, frame) = (scene.points.keys().next().unwrap(), scene.frames.keys().next().unwrap());
    association.push_str("MappointFrameAsso: 1 2 x 4\n");
    association.push_str(&format!("MappointFrameAsso: {point} {frame} 1 2\n"));
    association.push_str("MappointFrameAsso: -4 0 1 2\n");
    association.push_str("MappointFrameAsso: 100000 5000 100.5 200.25\n");
    association.push_str(&format!("MaplineFrameAsso: 900 {frame} 10 20 -1 30 40 2\n"));
    release.observation.get_mut("structline_landmarks.txt").unwrap().push_str("901 1 2 3 1 2 3\n");
    let (sequence, code) = converted(&release, "box9");
    assert_eq!(code, 3);
    let excluded: Vec<(&str, &str, u64, Option<u64>)> = sequence
        .manifest
        .excluded
        .iter()
        .map(|e| (e.file.rsplit('/').next().unwrap(), e.reason.as_str(), e.count, e.first_line))
        .collect();
    let expected = [
        ("association.txt", "depth is not positive; the row is kept without it", 1, Some(first + 4)),
        ("association.txt", "frame or landmark id is negative or too large", 1, Some(first + 2)),
        ("association.txt", "landmark comes again in the frame; the first row is kept", 1, Some(first + 1)),
        (
            "association.txt",
            "line cannot be fitted to its rows: fewer than two views or no parallax (lines 900)",
            1,
            None,
        ),
        ("association.txt", "malformed-number: not a number", 1, Some(first)),
        ("association.txt", "point without landmark cannot be triangulated", 1, None),
        ("structline_landmarks.txt", "line landmark has no length", 1, Some(scene.lines.len() as u64 + 1)),
    ];
    assert_eq!(excluded, expected);
    // A row of a frame that nothing else names is kept, and its frame with it, without a pose.
    let frame = sequence.frames.last().unwrap();
    assert_eq!(
        (frame.frame_id.0, frame.stamp_nanos, frame.world_from_camera()),
        (5000, 166_666_666_667, None)
    );
    let row = sequence.point_observations.last().unwrap();
    assert_eq!((row.frame_id.0, row.point_id.0, row.u, row.depth), (5000, 100_000, 100.5, None));
    let line = sequence.line_observations.iter().find(|row| row.line_id.0 == 900).unwrap();
    assert_eq!((line.start_depth, line.end_depth), (None, Some(2.0)));
}

/// Every file below a folder with its bytes.
fn bytes_below(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(next) = waiting.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn several_sequences_give_the_same_bytes_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::new();
    let dataset = folder.path().join("dataset");
    for seed in 1..4 {
        scene
            .release(Noise::None, Noise::FirstRelease { seed })
            .write_archives(&dataset.join(format!("box{seed}")));
    }
    let dataset = dataset.to_str().unwrap();
    let output = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();

    let (code, table, _) = os_convert(&[dataset, "-o", &output("one")], 1);
    assert_eq!(code, 0, "{table}");
    assert!(["box1", "box2", "box3"].iter().all(|name| table.contains(name)), "{table}");
    os_convert(&[dataset, "-o", &output("two")], 2);
    let one = bytes_below(Path::new(&output("one")));
    assert_eq!(one, bytes_below(Path::new(&output("two"))));
    assert!(one.contains_key(Path::new("box2/point_measurements.parquet")));

    let (code, report, _) = os_convert(&[dataset, "-o", &output("mcap"), "--format", "mcap", "--json"], 2);
    assert_eq!(code, 0);
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["sequences"][2]["sequence"], "box3");
    assert_eq!(format::read(output("mcap") + "/box3.mcap").unwrap().frames.len(), scene.frames.len());

    // One MCAP file cannot hold three sequences; a folder that is a sequence cannot hold others.
    let (code, _, told) = os_convert(&[dataset, "-o", &output("all.mcap")], 2);
    assert!(code == 2 && told.contains("--format mcap"), "{code} {told}");
    let (code, _, told) = os_convert(&[dataset, "-o", &output("one/box1")], 2);
    assert!(code == 2 && told.contains("is a sequence"), "{code} {told}");
    // Nothing is replaced unasked.
    let (code, _, told) = os_convert(&[dataset, "-o", &output("one"), "--keep-going"], 2);
    assert!(code == 1 && told.matches("exists already").count() == 3, "{code} {told}");
    let (code, _, _) = os_convert(&[dataset, "-o", &output("one"), "--force"], 2);
    assert_eq!(code, 0);
    assert_eq!(one, bytes_below(Path::new(&output("one"))));
}

#[test]
fn a_broken_archive_fails_alone_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = folder.path().join("dataset");
    Scene::new().release(Noise::None, Noise::None).write_archives(&dataset.join("a"));
    fs::create_dir_all(dataset.join("b")).unwrap();
    fs::write(dataset.join("b/observation.zip"), b"PK\x03\x04 cut off").unwrap();
    let out = folder.path().join("out");
    // What an interrupted run may have left.
    fs::create_dir_all(out.join(".a.1.partial")).unwrap();
    let (code, table, told) =
        os_convert(&[dataset.to_str().unwrap(), "-o", out.to_str().unwrap(), "--keep-going"], 2);
    assert_eq!(code, 1, "{told}");
    assert!(told.contains("error: b:") && table.contains('a'), "{table} {told}");
    assert!(out.join("a/sequence.json").is_file() && !out.join("b").exists());
}

#[test]
fn a_camera_of_no_family_can_be_given() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::with_camera([700.0, 710.0, 400.0, 300.0]);
    let place = folder.path().join("mine");
    scene.release(Noise::None, Noise::None).write_archives(&place);
    let (place, out) = (place.to_str().unwrap(), folder.path().join("out"));
    let (code, table, _) = os_convert(&[place, "-o", out.to_str().unwrap()], 2);
    assert!(code == 3 && table.contains("no known camera fits"), "{code} {table}");
    let camera = "700,710,400,300,800,600";
    let (code, table, told) =
        os_convert(&[place, "-o", out.to_str().unwrap(), "--force", "--camera", camera], 2);
    assert_eq!(code, 0, "{table} {told}");
    let sequence = format::read(&out).unwrap();
    assert_eq!((sequence.manifest.cameras[0].fx, sequence.manifest.cameras[0].width), (700.0, 800));
    assert_eq!(sequence.manifest.generator.parameters["option.camera"], camera);
}
