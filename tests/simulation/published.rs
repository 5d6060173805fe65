//! What the first release sees of its own landmarks, seen again.
//!
//! Its files are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.

use std::collections::BTreeSet;
use std::io::Read;
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use open_structure::geometry::{Pose, Segment};
use open_structure::simulate::visibility::{Occluders, View, Visibility, VisibilityModel};
use open_structure::simulate::{CameraRecipe, Survey};

fn archive(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    [data.join("open-structure"), data]
        .into_iter()
        .map(|folder| folder.join(name).join("observation.zip"))
        .find(|path| path.is_file())
}

fn member(archive: &Path, wanted: &str) -> String {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(archive).unwrap()).unwrap();
    let name = archive
        .file_names()
        .map(|name| name.unwrap().into_owned())
        .find(|name| name.ends_with(wanted))
        .unwrap_or_else(|| panic!("{wanted}"));
    let mut text = String::new();
    archive.by_name(&name).unwrap().read_to_string(&mut text).unwrap();
    text
}

/// Ids and the numbers behind them, ascending by id.
fn rows<const N: usize>(text: &str) -> Vec<(i64, [f64; N])> {
    let mut rows: Vec<(i64, [f64; N])> = text
        .lines()
        .filter(|line| !line.trim().is_empty())
        .map(|line| {
            let (id, rest) = line.trim().split_once(' ').unwrap();
            let numbers: Vec<f64> =
                rest.split_ascii_whitespace().map(|number| number.parse().unwrap()).collect();
            (id.parse().unwrap(), numbers[..N].try_into().unwrap())
        })
        .collect();
    rows.sort_by_key(|row| row.0);
    rows
}

/// Pairs of frame and landmark of a tag's lines.
fn seen(association: &str, tag: &str) -> BTreeSet<(i64, i64)> {
    association
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix(tag)?.strip_prefix(':'))
        .map(|rest| {
            let mut words = rest.split_ascii_whitespace();
            let mut id = || words.next().unwrap().parse::<i64>().unwrap();
            let landmark = id();
            (id(), landmark)
        })
        .collect()
}

#[test]
fn with_its_landmarks_and_poses_the_frustum_sees_exactly_what_the_release_saw() {
    // Point and line observations that the release has.
    for (name, point_count, line_count) in [("box1", 36_012, 5669), ("corridor1", 27_264, 1566)] {
        let Some(archive) = archive(name) else {
            eprintln!("SKIPPED: the published {name} is not here (see OPEN_STRUCTURE_DATA)");
            continue;
        };
        let poses = rows::<7>(&member(&archive, "camera_poses.txt"));
        let points = rows::<3>(&member(&archive, "point_landmarks.txt"));
        let lines = rows::<6>(&member(&archive, "structline_landmarks.txt"));
        let association = member(&archive, "association.txt");

        let camera = CameraRecipe::default().pinhole("camera").unwrap();
        let visibility = Visibility { model: VisibilityModel::Frustum, ..Visibility::default() };
        let views = poses
            .iter()
            .map(|(_, [t @ .., x, y, z, w])| {
                let pose = Pose::from_components(*t, [*x, *y, *z, *w]).unwrap();
                View::new(camera, &pose, visibility.bounds())
            })
            .collect();
        let nothing = Occluders::new(&open_structure::simulate::scene::Scene::default());
        let survey = Survey::new(views, nothing, visibility);
        let places: Vec<Point3<f64>> = points.iter().map(|(_, place)| Point3::from(*place)).collect();
        let segments: Vec<Segment> = lines
            .iter()
            .map(|(_, [a, b, c, d, e, f])| Segment {
                start: Point3::new(*a, *b, *c),
                end: Point3::new(*d, *e, *f),
            })
            .collect();

        let frames = || poses.iter().map(|(frame, _)| *frame);
        let ours: BTreeSet<(i64, i64)> = frames()
            .zip(survey.points(&places, &|| {}))
            .flat_map(|(frame, seen)| seen.into_iter().map(move |place| (frame, place)))
            .map(|(frame, place)| (frame, points[place as usize].0))
            .collect();
        let theirs = seen(&association, "MappointFrameAsso");
        assert_eq!(theirs.len(), point_count, "{name}");
        assert_eq!(ours.symmetric_difference(&theirs).count(), 0, "{name}: points");

        let ours: BTreeSet<(i64, i64)> = frames()
            .zip(survey.lines(&segments, &|| {}))
            .flat_map(|(frame, seen)| seen.into_iter().map(move |line| (frame, line.line)))
            .map(|(frame, line)| (frame, lines[line as usize].0))
            .collect();
        let theirs = seen(&association, "MaplineFrameAsso");
        assert_eq!(theirs.len(), line_count, "{name}");
        assert_eq!(ours.symmetric_difference(&theirs).count(), 0, "{name}: lines");
    }
}
