//! The accuracy of the published estimates, as it was measured with evo.

use std::io::Read;
use std::path::{Path, PathBuf};

use open_structure::evaluate::{Alignment, Step, absolute, relative};
use open_structure::geometry::Pose;
use open_structure::structure::FrameId;

use super::data;

fn archive(sequence: &str, name: &str) -> Option<PathBuf> {
    let data = data();
    [data.join("open-structure"), data]
        .into_iter()
        .map(|folder| folder.join(sequence).join(name))
        .find(|path| path.is_file())
}

/// The poses of the first of some members that an archive has: `id tx ty tz qx qy qz qw`.
fn poses(archive: &Path, wanted: &[&str]) -> Vec<(FrameId, Pose)> {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(archive).unwrap()).unwrap();
    let names: Vec<String> = archive.file_names().map(|name| name.unwrap().into_owned()).collect();
    let name = wanted.iter().find_map(|wanted| names.iter().find(|name| name.ends_with(wanted))).unwrap();
    let mut text = String::new();
    archive.by_name(name).unwrap().read_to_string(&mut text).unwrap();
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split_ascii_whitespace().map(|number| number.parse().unwrap()).collect();
        let [id, x, y, z, quaternion @ ..] = numbers.as_slice() else { panic!("{line}") };
        #[expect(clippy::cast_possible_truncation, reason = "ids of frames")]
        let id = FrameId(*id as i64);
        (id, Pose::from_components([*x, *y, *z], quaternion.try_into().unwrap()).unwrap())
    };
    text.lines().filter(|line| !line.trim().is_empty()).map(row).collect()
}

/// Two decimals, as the figures are printed.
fn printed(number: f64) -> String {
    format!("{number:.2}")
}

/// Estimate, its files; APE of translation after SE(3) alignment, rmse and median, cm; RPE of rotation over a frame, degrees.
type Row = (&'static [&'static str], [&'static str; 4]);

const VO: &[&str] = &["estimated_vo.txt", "Frame-to-Frame.txt"];
const MAP: &[&str] = &["estimated_localmap.txt", "Map-to-Frame.txt"];
const POINT: &[&str] = &["Point_BA.txt", "Point-BA.txt"];
const LINE: &[&str] = &["PointLine_BA.txt", "PointLine-BA.txt"];

#[test]
fn published_estimates_are_as_accurate_as_evo_says() {
    let box1: [Row; 4] = [
        (VO, ["7.69", "5.56", "0.18", "0.14"]),
        (MAP, ["2.04", "1.60", "0.18", "0.13"]),
        (POINT, ["1.79", "1.43", "0.16", "0.12"]),
        (LINE, ["1.84", "1.59", "0.15", "0.11"]),
    ];
    let corridor1: [Row; 4] = [
        (VO, ["216.48", "148.94", "1.09", "0.14"]),
        (MAP, ["10.58", "5.93", "1.09", "0.14"]),
        (POINT, ["5.56", "4.45", "0.31", "0.10"]),
        (LINE, ["4.16", "3.22", "0.26", "0.09"]),
    ];
    for (sequence, rows, point_ba_sim3_cm) in [("box1", box1, "1.57"), ("corridor1", corridor1, "2.66")] {
        let archives = archive(sequence, "observation.zip").zip(archive(sequence, "baseline.zip"));
        let Some((observation, baseline)) = archives else {
            println!("SKIPPED: the published {sequence} is not here (see OPEN_STRUCTURE_DATA)");
            continue;
        };
        let truth = poses(&observation, &["camera_poses.txt"]);
        for (files, expected) in rows {
            let estimate = poses(&baseline, files);
            let ape = absolute(&truth, &estimate, Alignment::SE3).unwrap().translation.statistics();
            let rpe = relative(&truth, &estimate, Alignment::SE3, Step::FRAME).unwrap().rotation.statistics();
            let found =
                [100.0 * ape.rmse, 100.0 * ape.median, rpe.rmse.to_degrees(), rpe.median.to_degrees()];
            assert_eq!(found.map(printed), expected, "{sequence} {}", files[0]);
        }
        let similar = absolute(&truth, &poses(&baseline, POINT), Alignment::SIM3).unwrap();
        assert_eq!(printed(100.0 * similar.translation.rmse()), point_ba_sim3_cm, "{sequence}");
    }
}
