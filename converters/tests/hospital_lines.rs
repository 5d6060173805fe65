//! Lines of the real hospital frames against those that were published for the same frames, where they are at hand.
//!
//! They are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use nalgebra::{Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector3};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::simulate::Random;
use open_structure::structure::{Camera, CameraId, registry};
use open_structure_converters::associate::{
    GroupOptions, LineMap, LineOptions, Rejected, Rims, group_lines, lift, visible_part,
};
use open_structure_converters::detect::{Detector, SegmentOptions, segments};
use open_structure_converters::rgbd::{DepthMap, DepthNoise, Raster};
use open_structure_converters::text_release::{Limits, discover, read};
use opencv::imgcodecs::{IMREAD_GRAYSCALE, imread};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const FRAMES: usize = 60;
/// Half precision of the depth files.
const NOISE: DepthNoise = DepthNoise { constant_m: 1e-3, linear: 5e-4, quadratic_per_m: 0.0 };

fn data() -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let here =
        data.join("rgbd/tartanair_hospital_60").is_dir() && data.join("open-structure/hospital").is_dir();
    if !here {
        println!("SKIPPED: the hospital frames are not here; set OPEN_STRUCTURE_DATA to convert them");
    }
    here.then_some(data)
}

fn raster() -> Raster {
    let pinhole = PinholeCamera { fx: 320.0, fy: 320.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };
    Raster::new(&Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CORNER), None)
}

fn poses(data: &Path) -> Vec<Pose> {
    // Columns: x, y, z of the optical camera in the north-east-down one.
    let optical = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let optical = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(optical));
    let text = std::fs::read_to_string(data.join("rgbd/tartanair_hospital_60/pose_left.txt")).unwrap();
    let pose = |line: &str| {
        let n: Vec<f64> = line.split_whitespace().map(|number| number.parse().unwrap()).collect();
        let ned = Pose::from_components([n[0], n[1], n[2]], [n[3], n[4], n[5], n[6]]).unwrap();
        Pose::new(ned.rotation() * optical, ned.translation())
    };
    text.lines().map(pose).collect()
}

fn depth(data: &Path, frame: usize) -> DepthMap {
    let name = format!("rgbd/tartanair_hospital_60/depth_left/{frame:06}_left_depth.npy");
    let bytes = std::fs::read(data.join(name)).unwrap();
    let depth: Vec<f32> = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap();
    let mut map = DepthMap::new(640, 480, depth).unwrap();
    map.limit(0.1, 50.0);
    map
}

struct Published {
    lines: Vec<Segment>,
    /// As observed in frames 0..59, one per line: the longest.
    observed: Vec<Segment>,
}

fn published(data: &Path, poses: &[Pose]) -> Published {
    let limits = Limits::default();
    let found = discover(&[data.join("open-structure/hospital")], &limits).unwrap();
    let sequence = read(&found.sequences[0], &limits).unwrap();
    let landmarks: BTreeMap<i64, Segment> = sequence.line_landmarks[0]
        .segments
        .iter()
        .map(|line| (line.id, Segment { start: line.start.into(), end: line.end.into() }))
        .collect();
    let camera = *raster().camera();
    let mut seen: BTreeMap<i64, Segment> = BTreeMap::new();
    for row in &sequence.association.as_ref().unwrap().rows.line_observations {
        let Some(pose) = usize::try_from(row.frame).ok().and_then(|frame| poses.get(frame)) else { continue };
        let point = |[u, v, d]: [f64; 3]| pose * camera.back_project(Point2::new(u, v), d);
        let view = Segment { start: point(row.start), end: point(row.end) };
        let best = seen.entry(row.line).or_insert(view);
        if view.length() > best.length() {
            *best = view;
        }
    }
    let seen: BTreeMap<_, _> = seen.into_iter().filter(|(id, _)| landmarks.contains_key(id)).collect();
    Published { lines: seen.keys().map(|id| landmarks[id]).collect(), observed: seen.into_values().collect() }
}

/// Whether two lines are one: at most an angle apart, and at most a distance where they run side by side.
fn same(a: &Segment, b: &Segment, angle_deg: f64, distance_m: f64) -> bool {
    let (line, other) = (a.plucker().unwrap(), b.plucker().unwrap());
    if line.angle_to(&other).to_degrees() > angle_deg {
        return false;
    }
    let direction = a.direction().unwrap();
    let along = |point: Point3<f64>| direction.dot(&(point - a.start));
    let (first, second) = (along(b.start), along(b.end));
    let (from, to) = (first.min(second).max(0.0), first.max(second).min(a.length()));
    from < to && [from, to].iter().all(|at| other.distance_to_point(a.start + direction * *at) <= distance_m)
}

fn share(of: &[Segment], among: &[Segment]) -> f64 {
    let found = of.iter().filter(|line| among.iter().any(|other| same(line, other, 1.0, 0.03))).count();
    found as f64 / of.len() as f64
}

struct Found {
    lines: Vec<Segment>,
    grouped: Vec<Segment>,
}

fn convert(
    data: &Path,
    poses: &[Pose],
    detection: &SegmentOptions,
    options: &LineOptions,
    grouping: &GroupOptions,
    least_views: usize,
) -> Found {
    let raster = raster();
    let clock = std::time::Instant::now();
    let mut map = LineMap::new(options);
    let mut rejected: BTreeMap<Rejected, usize> = BTreeMap::new();
    let (mut detected, mut lifted) = (0, 0);
    let mut spent = [0.0; 5];
    for (frame, pose) in poses.iter().enumerate() {
        let start = std::time::Instant::now();
        let name = format!("rgbd/tartanair_hospital_60/image_left/{frame:06}_left.png");
        let grey = imread(data.join(name).to_str().unwrap(), IMREAD_GRAYSCALE).unwrap();
        let depth = depth(data, frame);
        spent[0] += start.elapsed().as_secs_f64();
        let start = std::time::Instant::now();
        let found = segments(&grey, detection).unwrap();
        spent[1] += start.elapsed().as_secs_f64();
        let start = std::time::Instant::now();
        detected += found.len();
        let mut random = Random::new(1, "lines", frame as u64);
        let mut lines = Vec::new();
        for segment in found {
            match lift(&raster, &depth, pose, segment, &NOISE, options, &mut random) {
                Ok(line) => lines.push(line),
                Err(reason) => *rejected.entry(reason).or_default() += 1,
            }
        }
        spent[2] += start.elapsed().as_secs_f64();
        let start = std::time::Instant::now();
        lifted += lines.len();
        map.add(u32::try_from(frame).unwrap(), &lines);
        spent[3] += start.elapsed().as_secs_f64();
    }
    let before = map.len();
    let candidates = map.finish();
    let kept: Vec<Segment> =
        candidates.iter().filter(|line| line.frames.len() >= least_views).map(|line| line.segment).collect();
    let mut grouped = kept.clone();
    let groups = group_lines(&mut grouped, grouping);
    let start = std::time::Instant::now();
    let mut views = vec![0; grouped.len()];
    for (frame, pose) in poses.iter().enumerate() {
        let depth = depth(data, frame);
        for (line, views) in grouped.iter().zip(&mut views) {
            if visible_part(&raster, &depth, &NOISE, &pose.inverse(), line, options).is_some() {
                *views += 1;
            }
        }
    }
    spent[4] += start.elapsed().as_secs_f64();
    let lines: Vec<_> =
        kept.iter().zip(&views).filter(|(_, n)| **n >= least_views).map(|(l, _)| *l).collect();
    let grouped: Vec<_> =
        grouped.iter().zip(&views).filter(|(_, n)| **n >= least_views).map(|(l, _)| *l).collect();
    println!(
        "detected {detected}, lifted {lifted}, rejected {rejected:?}, landmarks {before} -> {} -> {} -> {}, views {}, {:.1} s {spent:.2?}",
        candidates.len(),
        kept.len(),
        grouped.len(),
        views.iter().sum::<usize>(),
        clock.elapsed().as_secs_f64()
    );
    for group in groups.iter().take(4).chain(groups.iter().filter(|g| g.kind != registry::PARALLEL)) {
        println!("  {} of {} {:.3?}", group.kind, group.members.len(), group.direction.as_slice());
    }
    Found { lines, grouped }
}

#[test]
fn explore() {
    let Some(data) = data() else { return };
    let poses = poses(&data);
    let published = published(&data, &poses);
    println!("published {} lines", published.lines.len());
    let lengths = |lines: &[Segment]| {
        let mut all: Vec<f64> = lines.iter().map(Segment::length).collect();
        all.sort_by(f64::total_cmp);
        format!("{:.2} {:.2} {:.2}", all[all.len() / 10], all[all.len() / 2], all[all.len() * 9 / 10])
    };
    println!("lengths {} / {}", lengths(&published.lines), lengths(&published.observed));
    println!("published turned against observed {:.3}", share(&published.lines, &published.observed));
    for detector in [Detector::Fld, Detector::Lsd] {
        for rims in [Rims::Nearer, Rims::Reject] {
            let detection = SegmentOptions { detector, ..SegmentOptions::default() };
            let options = LineOptions { rims, ..LineOptions::default() };
            let found = convert(&data, &poses, &detection, &options, &GroupOptions::default(), 3);
            println!(
                "{detector:?} {rims:?}: published found {:.3} (grouped {:.3}; as observed {:.3}, grouped {:.3}); ours published {:.3} (grouped {:.3}, as observed {:.3})",
                share(&published.lines, &found.lines),
                share(&published.lines, &found.grouped),
                share(&published.observed, &found.lines),
                share(&published.observed, &found.grouped),
                share(&found.lines, &published.lines),
                share(&found.grouped, &published.lines),
                share(&found.lines, &published.observed),
            );
        }
    }
    let _ = (Vector3::<f64>::zeros(), BTreeSet::<u8>::new());
}
