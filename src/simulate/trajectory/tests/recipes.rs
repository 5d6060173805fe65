//! Trajectories as text, their schema, their files, and their bits.

use super::*;
use sha2::{Digest, Sha256};

/// One of each kind, with as little said as may be.
const KINDS: [&str; 7] = [
    "kind = 'wave'\nframes = 60",
    "kind = 'sphere'\nframes = 60",
    "kind = 'corridor'\nframes = 60",
    "kind = 'figure-eight'\nframes = 60",
    "kind = 'random'\nframes = 60",
    "kind = 'waypoints'\nframes = 60\nwaypoints = [{position_m = [0, 0, 0]}, {position_m = [1, 0, 0]}, {position_m = [1, 2, 0.5]}]",
    "kind = 'file'\nfile = 'poses.txt'",
];

fn json(text: &str) -> serde_json::Value {
    toml::from_str(text).unwrap()
}

#[test]
fn keys_that_are_unknown_are_refused_by_reader_and_schema() {
    let schema = serde_json::to_value(schemars::schema_for!(Trajectory)).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    for text in KINDS {
        assert!(validator.is_valid(&json(text)), "{text}");
        // What is written again reads the same and has the same schema.
        let read = trajectory(text);
        let written = serde_json::to_value(&read).unwrap();
        assert!(validator.is_valid(&written), "{written}");
        assert_eq!(serde_json::from_value::<Trajectory>(written).unwrap(), read);
        let more = format!("radious_m = 3\n{text}");
        let error = toml::from_str::<Trajectory>(&more).unwrap_err();
        assert!(error.to_string().contains("radious_m"), "{error}");
        assert!(!validator.is_valid(&json(&more)), "{text}");
    }
    for wrong in ["frames = 60", "kind = 'spiral'\nframes = 60", "kind = 'file'"] {
        assert!(toml::from_str::<Trajectory>(wrong).is_err(), "{wrong}");
        assert!(!validator.is_valid(&json(wrong)), "{wrong}");
    }
    let nested = "kind = 'waypoints'\nframes = 60\nwaypoints = [{position_m = [0, 0, 0], yaw = 3}]";
    assert!(toml::from_str::<Trajectory>(nested).is_err());
}

#[test]
fn every_parameter_has_its_sentence_in_the_schema() {
    let schema = serde_json::to_value(schemars::schema_for!(Trajectory)).unwrap();
    let mut silent = Vec::new();
    for kind in schema["oneOf"].as_array().unwrap() {
        for (name, property) in kind["properties"].as_object().unwrap() {
            if name != "kind" && property["description"].as_str().is_none_or(str::is_empty) {
                silent.push(format!("{}: {name}", kind["properties"]["kind"]));
            }
        }
    }
    assert!(silent.is_empty(), "{silent:?}");
}

#[test]
fn a_file_gives_its_poses_and_its_stamps() {
    let folder = tempfile::tempdir().unwrap();
    let poses = |recipe: &str| trajectory(recipe).poses(10.0, 0, folder.path());
    std::fs::write(folder.path().join("tum.txt"), "# stamp\n5.5 1 2 3 0 0 0 1\r\n5.7 4 5 6 1 0 0 0").unwrap();
    std::fs::write(folder.path().join("kitti.txt"), "1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 4 0 -1 0 5 0 0 -1 6\n")
        .unwrap();
    let tum = poses("kind = 'file'\nfile = 'tum.txt'").unwrap();
    let kitti = poses("kind = 'file'\nfile = 'kitti.txt'\nformat = 'kitti'").unwrap();
    assert_eq!(tum.iter().map(|pose| pose.stamp_nanos).collect::<Vec<_>>(), [5_500_000_000, 5_700_000_000]);
    assert_eq!(kitti.iter().map(|pose| pose.stamp_nanos).collect::<Vec<_>>(), [0, 100_000_000]);
    let file = |pose: &TimedPose| pose.world_from_camera.components();
    assert_eq!(file(&tum[1]), ([4.0, 5.0, 6.0], [1.0, 0.0, 0.0, 0.0]));
    assert_eq!(kitti.iter().map(file).collect::<Vec<_>>(), tum.iter().map(file).collect::<Vec<_>>());
    // The file's world half a turn about z; the camera 1 m along the body's x axis.
    let placed = poses(
        "kind = 'file'\nfile = 'tum.txt'\nworld_from_file = [0, 0, 9, 0, 0, 1, 0]\nbody_from_camera = [1, 0, 0, 0, 0, 0, 1]",
    );
    assert_eq!(placed.unwrap()[0].world_from_camera.translation(), nalgebra::Vector3::new(-2.0, -2.0, 12.0));
    let refused = |recipe: &str| poses(recipe).unwrap_err();
    std::fs::write(folder.path().join("bad.txt"), "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n").unwrap();
    let error = refused("kind = 'file'\nfile = 'bad.txt'");
    assert!(
        matches!(&error, Error::Content { path, line: Some(2), .. } if path.ends_with("bad.txt")),
        "{error}"
    );
    assert!(matches!(refused("kind = 'file'\nfile = 'none.txt'"), Error::Io { .. }));
    assert!(matches!(refused("kind = 'file'\nfile = '.'"), Error::Content { line: None, .. }));
    let error = refused("kind = 'file'\nfile = 'tum.txt'\nworld_from_file = [0, 0, 9, 0, 0, 0, 0]");
    assert!(
        matches!(&error, Error::Geometry { place, .. } if place == "trajectory.world_from_file"),
        "{error}"
    );
    let large = std::fs::File::create(folder.path().join("large.txt")).unwrap();
    large.set_len(crate::structure::LARGEST_TRAJECTORY_FILE_BYTES + 1).unwrap();
    assert!(refused("kind = 'file'\nfile = 'large.txt'").to_string().contains("at most 536870912 bytes"));
}

#[test]
fn the_bits_of_the_paths_never_change() {
    let mut hasher = Sha256::new();
    for kind in &KINDS[..6] {
        for pose in walk(kind) {
            let (translation, rotation) = pose.world_from_camera.components();
            hasher.update(pose.stamp_nanos.to_le_bytes());
            for number in translation.into_iter().chain(rotation) {
                hasher.update(number.to_le_bytes());
            }
        }
    }
    // Simulated sequences rest on these; optimised or not, on any machine.
    assert_eq!(crate::structure::hex(&hasher.finalize()), GOLDEN);
}

const GOLDEN: &str = "da07611bd8cbb4e8cc61a3b37ded140d8a367a69a0fc11751404aa914cd8a360";
