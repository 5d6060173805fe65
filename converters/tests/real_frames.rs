//! Sequences made of real frames: against what was published for the same frames, and against their own depth maps.
//!
//! They are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says. Figures are printed, so
//! that `cargo test --test real_frames -- --nocapture` gives those of the README.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use nalgebra::{Point3, Vector3};
use open_structure::format::{self, WriteOptions};
use open_structure::geometry::Segment;
use open_structure::structure::{FrameId, LineId, PointId, Sequence, registry};
use open_structure::validate;
use open_structure_converters::associate::Rims;
use open_structure_converters::detect::Detector;
use open_structure_converters::generate::{Generated, Options, generate};
use open_structure_converters::release;
use open_structure_converters::rgbd::{self, OpenOptions, RawSequence};
use open_structure_converters::text_release::{Limits, discover, read};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Frames of `hospital` that are here.
const FRAMES: i64 = 60;

fn data(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let found = data.join(name);
    if found.is_dir() {
        return Some(found);
    }
    println!("SKIPPED: {name} is not here; set OPEN_STRUCTURE_DATA to convert it");
    None
}

fn made(raw: &RawSequence) -> Generated {
    generate(raw, "real", &Options::default(), 2, false, &|_, _, _| ()).unwrap()
}

/// Writes, validates without a finding, and reads back.
fn written(generated: &Generated) -> Sequence {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("real.mcap");
    generated.write(&path, WriteOptions::default(), &|_, _, _| ()).unwrap();
    let report = validate::validate(&path, &validate::Options::default()).unwrap();
    assert_eq!(report.worst(), None, "{report:?}");
    format::read(&path).unwrap()
}

/// Part of some things that have a neighbour among others.
fn share<T, U>(some: &[T], others: &[U], near: impl Fn(&T, &U) -> bool) -> f64 {
    let found = some.iter().filter(|one| others.iter().any(|other| near(one, other)));
    found.count() as f64 / some.len() as f64
}

/// Whether two segments lie on one line: at 1 degree, the middle of the one within 3 cm of the other's line, and overlapping.
fn one_line(one: &Segment, other: &Segment) -> bool {
    let (Some(a), Some(b)) = (one.direction(), other.direction()) else { return false };
    let cosine = libm::cos(1.0_f64.to_radians());
    let aside = (one.midpoint() - other.start).cross(&b).norm();
    let [s, t] = [one.start, one.end].map(|end| (end - other.start).dot(&b));
    a.dot(&b).abs() >= cosine && aside <= 0.03 && s.max(t) >= 0.0 && s.min(t) <= other.length()
}

/// Points and lines that are published as seen in the frames that are here.
fn published(release: PathBuf) -> (Vec<Point3<f64>>, Vec<Segment>) {
    let limits = Limits::default();
    let text = read(&discover(&[release], &limits).unwrap().sequences[0], &limits).unwrap();
    let published = release::convert(&text, &release::Options::default()).unwrap().sequence;
    let here = |frame: FrameId| frame.0 < FRAMES;
    let rows = published.point_observations.iter().filter(|row| here(row.frame_id));
    let points: BTreeSet<PointId> = rows.map(|row| row.point_id).collect();
    let rows = published.line_observations.iter().filter(|row| here(row.frame_id));
    let lines: BTreeSet<LineId> = rows.map(|row| row.line_id).collect();
    let points = published.point_landmarks.iter().filter(|row| points.contains(&row.point_id));
    let lines = published.line_landmarks.iter().filter(|row| lines.contains(&row.line_id));
    (points.map(|row| row.position()).collect(), lines.map(|row| row.segment()).collect())
}

#[test]
fn hospital_has_the_landmarks_that_were_published_for_it() {
    let folders = data("rgbd/tartanair_hospital_60").zip(data("open-structure/hospital"));
    let Some((frames, release)) = folders else { return };
    let raw = rgbd::tartanair::open(&frames, &OpenOptions::default()).unwrap();
    let (points, lines) = published(release);
    assert_eq!((points.len(), lines.len()), (62, 39));
    // Least shares of published points and lines that are found, and of ours that are published: somewhat under what was found
    // when this was written, 87, 92, 13 and 38 %. The release has few points and left most short lines away, so the other way
    // round little can be known. Segments on rims are lines of the release's, too: without them fewer are found.
    for (detector, rims, floors) in [
        (Detector::Fld, Rims::Nearer, [0.82, 0.85, 0.10, 0.30]),
        (Detector::Lsd, Rims::Nearer, [0.78, 0.80, 0.10, 0.25]),
        (Detector::Ed, Rims::Nearer, [0.78, 0.75, 0.10, 0.25]),
        (Detector::Fld, Rims::Reject, [0.78, 0.75, 0.10, 0.30]),
    ] {
        let mut options = Options::default();
        options.segments.detector = detector;
        options.lines.rims = rims;
        let ours = written(&generate(&raw, "real", &options, 2, false, &|_, _, _| ()).unwrap());
        let our_points: Vec<Point3<f64>> = ours.point_landmarks.iter().map(|row| row.position()).collect();
        let our_lines: Vec<Segment> = ours.line_landmarks.iter().map(|row| row.segment()).collect();
        let close = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm() <= 0.02;
        let shares = [
            share(&points, &our_points, close),
            share(&lines, &our_lines, one_line),
            share(&our_points, &points, close),
            share(&our_lines, &lines, one_line),
        ];
        let [points_found, lines_found, points_known, lines_known] = shares.map(|share| 100.0 * share);
        println!(
            "hospital, frames 0..59, {detector:?}, rims {rims:?}: of {} published points {points_found:.1} % have one of our {} within 2 cm, {points_known:.1} % of ours one of them",
            points.len(),
            our_points.len(),
        );
        println!(
            "    of {} published lines {lines_found:.1} % have one of our {} within 1 degree and 3 cm, {lines_known:.1} % of ours one of them",
            lines.len(),
            our_lines.len(),
        );
        assert!(shares.iter().zip(floors).all(|(share, floor)| *share >= floor), "{shares:?} {floors:?}");

        // A building: most lines along three directions at right angles, which are the axes of the rendered world.
        let manhattan =
            ours.structural_groups.iter().find(|group| group.kind == registry::MANHATTAN).unwrap();
        assert!(manhattan.line_ids.len() * 10 >= our_lines.len() * 7, "{}", manhattan.line_ids.len());
        assert!(manhattan.direction().unwrap().amax() > 0.9999);
        assert_eq!(ours.frames.len(), 60);
    }
}

#[test]
fn a_landmark_is_where_all_its_observations_say() {
    let Some(frames) = data("rgbd/tartanair_hospital_60") else { return };
    let options = OpenOptions { frames: 0..12, ..OpenOptions::default() };
    let ours = written(&made(&rgbd::tartanair::open(&frames, &options).unwrap()));
    let camera = ours.manifest.cameras[0].projection();
    let mut worst = 0.0_f64;
    for bundle in ours.bundles() {
        let camera_from_world = bundle.frame.world_from_camera().unwrap().pose().unwrap().inverse();
        for row in &bundle.point_observations {
            let place = ours.point_landmarks.binary_search_by_key(&row.point_id, |row| row.point_id).unwrap();
            let in_camera = camera_from_world * ours.point_landmarks[place].position();
            let pixel = camera.project(in_camera).unwrap();
            worst = worst.max((pixel.x - row.u).abs()).max((pixel.y - row.v).abs());
            assert!((in_camera.z - row.depth.unwrap()).abs() < 1e-9);
        }
        for row in &bundle.line_observations {
            let place = ours.line_landmarks.binary_search_by_key(&row.line_id, |row| row.line_id).unwrap();
            let image = ours.line_landmarks[place].plucker().image(&camera, &camera_from_world).unwrap();
            for [u, v] in [[row.start_u, row.start_v], [row.end_u, row.end_v]] {
                let distance = image.dot(&Vector3::new(u, v, 1.0)) / image.xy().norm();
                worst = worst.max(distance.abs());
            }
        }
    }
    assert!(ours.point_observations.len() > 1000 && worst < 1e-6, "{worst} px");
}

/// Deviations of depth maps from the depths of point observations, in standard deviations of the sensor and of the true poses,
/// at places that are no rims: the middle half of them is as wide as `1.349` standard deviations of a normal distribution.
fn deviations(raw: &RawSequence, ours: &Sequence) -> Vec<f64> {
    let raster = raw.raster();
    let mut deviations = Vec::new();
    for bundle in ours.bundles() {
        let frame = raw.frames.iter().find(|frame| frame.frame_id == bundle.frame.frame_id).unwrap();
        let map = raw.depth(frame).unwrap();
        for row in &bundle.point_observations {
            let (Some(depth), Some(place)) = (row.depth, raster.raster(nalgebra::Point2::new(row.u, row.v)))
            else {
                continue;
            };
            let surface = map.surface(place, raster.camera().fx, &raw.depth_noise);
            if let Some(surface) = surface.filter(|surface| !surface.jump) {
                let sigma_m = libm::hypot(raw.depth_noise.sigma_m(depth), raw.pose_sigma_m);
                deviations.push((surface.depth_m - depth) / sigma_m);
            }
        }
    }
    deviations.sort_by(f64::total_cmp);
    deviations
}

#[test]
fn frames_of_tum_agree_with_each_other_to_the_noise_of_their_sensor() {
    for (name, frames, points, lines, widest) in [
        ("rgbd_dataset_freiburg1_desk_9", 9, 400, 80, 1.0),
        // Frames 0.7 s apart, seen from all sides.
        ("rgbd_dataset_freiburg3_cabinet_58", 58, 80, 25, 2.0),
    ] {
        let Some(folder) = data(&format!("rgbd/{name}")) else { continue };
        let raw = rgbd::tum::open(&folder, &OpenOptions::default()).unwrap();
        let ours = written(&made(&raw));
        assert_eq!(ours.frames.len(), frames);
        assert!(ours.point_landmarks.len() > points && ours.line_landmarks.len() > lines);
        let deviations = deviations(&raw, &ours);
        let at = |part: usize| deviations[deviations.len() * part / 4];
        let spread = (at(3) - at(1)) / 1.349;
        println!(
            "{name}: {} points, {} lines, {} groups; depth maps deviate from {} observations by {spread:.2} standard deviations \
             of sensor and poses, {:.2} in the middle",
            ours.point_landmarks.len(),
            ours.line_landmarks.len(),
            ours.structural_groups.len(),
            deviations.len(),
            at(2)
        );
        assert!(spread < widest && at(2).abs() < 1.0, "{name}: {spread} {}", at(2));
    }
}
