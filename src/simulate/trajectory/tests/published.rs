//! The paths of the first release, where its files are at hand.
//!
//! They are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.

use std::io::Read;
use std::path::{Path as FilePath, PathBuf};

use super::*;
use crate::geometry::Pose;

/// The simulated sequences, and what a recipe says of them.
const SEQUENCES: [(&str, &str); 6] = [
    ("box1", "kind = 'wave'\nframes = 447"),
    ("box2", "kind = 'wave'\nframes = 856"),
    ("corridor1", "kind = 'corridor'\nframes = 412"),
    ("corridor2", "kind = 'corridor'\nframes = 845"),
    ("sphere1", "kind = 'sphere'\nframes = 856"),
    ("sphere2", "kind = 'sphere'\nframes = 100"),
];

fn sequence(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    [data.join("open-structure"), data]
        .into_iter()
        .map(|folder| folder.join(name).join("observation.zip"))
        .find(|path| path.is_file())
}

/// The numbers of each line of the sequence's ground truth.
fn published(archive: &FilePath) -> Vec<[f64; 7]> {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(archive).unwrap()).unwrap();
    let name = archive
        .file_names()
        .map(|name| name.unwrap().into_owned())
        .find(|name| name.ends_with("camera_poses.txt"))
        .unwrap();
    let mut text = String::new();
    archive.by_name(&name).unwrap().read_to_string(&mut text).unwrap();
    let numbers = |line: &str| -> Vec<f64> {
        line.split_ascii_whitespace().skip(1).map(|number| number.parse().unwrap()).collect()
    };
    text.lines().map(|line| numbers(line).try_into().unwrap()).collect()
}

/// Half a unit in the sixth digit of a number, to which the release rounds; and rounding of ours.
fn half_a_digit(number: f64) -> f64 {
    if number == 0.0 { 1e-12 } else { 0.5 * 10_f64.powf(number.abs().log10().floor() - 5.0) + 1e-12 }
}

#[test]
fn the_published_paths_are_ours_rounded_to_six_digits() {
    let mut seen = 0;
    for (name, recipe) in SEQUENCES {
        let Some(path) = sequence(name) else {
            eprintln!("SKIPPED: the published path of {name} is not here (see OPEN_STRUCTURE_DATA)");
            continue;
        };
        seen += 1;
        let (published, ours) = (published(&path), walk(recipe));
        assert_eq!(published.len(), ours.len(), "{name}");
        let (mut farthest, mut most_turned) = (0.0_f64, 0.0_f64);
        for (n, (published, ours)) in published.iter().zip(&ours).enumerate() {
            let ours = ours.world_from_camera;
            let [t @ .., x, y, z, w] = *published;
            let their_pose = Pose::from_components(t, [x, y, z, w]).unwrap();
            let apart = their_pose.translation() - ours.translation();
            farthest = farthest.max(apart.amax());
            most_turned = most_turned.max(turn(&their_pose, &ours).to_degrees());
            // A quaternion and its opposite are the same rotation.
            let (_, q) = ours.components();
            let same = q.iter().zip([x, y, z, w]).map(|(a, b)| a * b).sum::<f64>() > 0.0;
            let q = if same { q } else { q.map(|c| -c) };
            let our_numbers = ours.translation().iter().copied().chain(q).collect::<Vec<_>>();
            for (ours, published) in our_numbers.into_iter().zip(*published) {
                let digit = half_a_digit(published);
                assert!((ours - published).abs() <= digit, "{name} {n}: {ours} {published}");
            }
        }
        println!("{name}: {farthest:.2e} m, {most_turned:.2e} degrees at most");
        // Half a unit in the sixth digit of up to 9.99999 m; of four numbers up to 1 it is at most 1.15e-4 degrees.
        assert!(farthest < 5e-6 + 1e-12, "{name}: {farthest} m");
        assert!(most_turned < 1.15e-4, "{name}: {most_turned} degrees");
    }
    if seen == 0 {
        eprintln!("SKIPPED: no published path is here");
    }
}
