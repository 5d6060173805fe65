//! The sample of `sequences/sample`: a scene of two boxes, in the files of the first text release.
//!
//! `UPDATE_SAMPLE=1 cargo test --workspace --test sample_sequence` writes it. Nothing here depends on the machine: only
//! sums, products, quotients and square roots of binary64, and a generator of our own, so that the same digits come out.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use nalgebra::{Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector3, Vector6};
use open_structure::geometry::{PinholeCamera, Pose};

/// The camera of the release's simulator.
const CAMERA: PinholeCamera =
    PinholeCamera { fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 };
const FRAMES: u32 = 12;
const POINTS: i64 = 40;
const SIGMA_PX: f64 = 1.0;
const SIGMA_DEPTH_M: f64 = 0.05;

/// `SplitMix64` (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// In [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The sum of twelve uniform numbers less six: mean 0, sigma 1, close to normal, and free of logarithms.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn normals(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * sigma
    }
}

/// A box with its lower corner and its size, metres.
const BOXES: [([f64; 3], [f64; 3]); 2] =
    [([-0.8, -0.5, 0.0], [0.9, 0.7, 0.6]), ([0.25, -0.2, 0.0], [0.5, 0.8, 1.0])];

/// A line: its id, its ends, and its group, if it has one.
struct Line {
    id: i64,
    ends: [Point3<f64>; 2],
    group: Option<usize>,
}

struct Scene {
    points: Vec<(i64, Point3<f64>)>,
    lines: Vec<Line>,
}

/// Points on the faces of the boxes; their upper and upright edges as lines, in three groups; two lines in none.
fn scene(random: &mut Random) -> Scene {
    let corner = |(low, size): ([f64; 3], [f64; 3]), at: [f64; 3]| {
        Point3::new(low[0] + at[0] * size[0], low[1] + at[1] * size[1], low[2] + at[2] * size[2])
    };
    let mut points = Vec::new();
    for index in 0..POINTS {
        let of = BOXES[usize::try_from(index % 2).unwrap()];
        let mut at = [random.uniform(), random.uniform(), random.uniform()];
        // One of the five faces that can be seen.
        let face = random.next() % 5;
        at[usize::try_from(face / 2).unwrap()] = if face.is_multiple_of(2) { 1.0 } else { 0.0 };
        // Ids have gaps, as they do in the release.
        points.push((index + index / 7, corner(of, at)));
    }
    let edges = [
        ([0.0, 0.0, 1.0], [1.0, 0.0, 1.0], 0),
        ([0.0, 1.0, 1.0], [1.0, 1.0, 1.0], 0),
        ([0.0, 0.0, 1.0], [0.0, 1.0, 1.0], 1),
        ([1.0, 0.0, 1.0], [1.0, 1.0, 1.0], 1),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 2),
        ([1.0, 1.0, 0.0], [1.0, 1.0, 1.0], 2),
    ];
    let mut lines = Vec::new();
    for of in BOXES {
        for (index, (start, end, group)) in edges.into_iter().enumerate() {
            let mut ends = [corner(of, start), corner(of, end)];
            if index % 3 == 2 {
                // Signs are mixed within a group.
                ends.reverse();
            }
            lines.push((ends, Some(group)));
        }
    }
    lines.push(([Point3::new(-0.7, -0.5, 0.1), Point3::new(0.0, -0.5, 0.5)], None));
    lines.push(([Point3::new(0.3, -0.2, 0.9), Point3::new(0.7, -0.2, 0.3)], None));
    let lines = (0..).zip(lines).map(|(id, (ends, group))| Line { id: id + id / 5, ends, group }).collect();
    Scene { points, lines }
}

/// The camera on an arc about the boxes, looking at them.
fn pose(frame: u32) -> Pose {
    // The circle by a ratio of polynomials, from −53 to 53 degrees.
    let t = f64::from(frame) / f64::from(FRAMES - 1) - 0.5;
    let (sine, cosine) = (2.0 * t / (1.0 + t * t), (1.0 - t * t) / (1.0 + t * t));
    let centre = Vector3::new(2.8 * sine, -2.8 * cosine, 1.3 + 0.4 * t);
    let forward = (Vector3::new(0.0, 0.0, 0.4) - centre).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Pose::new(rotation, centre)
}

/// Where a point appears, and how deep it lies, if it is in the image.
fn sight(world_from_camera: &Pose, point: Point3<f64>) -> Option<(Point2<f64>, f64)> {
    let in_camera = world_from_camera.inverse() * point;
    CAMERA.project(in_camera).filter(|pixel| CAMERA.contains(*pixel, 0.0)).map(|pixel| (pixel, in_camera.z))
}

/// A pose off the true one; the smaller the sigma, the nearer.
fn perturbed(pose: &Pose, random: &mut Random, sigma: f64) -> Pose {
    let (rotation, translation) = (random.normals(sigma * 0.3), random.normals(sigma));
    let tangent =
        Vector6::new(rotation.x, rotation.y, rotation.z, translation.x, translation.y, translation.z);
    // First order is exact enough for a small error, and free of sines.
    let half = tangent.fixed_rows::<3>(0) * 0.5;
    let turn = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(1.0, half.x, half.y, half.z));
    Pose::new(turn * pose.rotation(), pose.translation() + translation)
}

fn pose_lines(tag: &str, poses: &[Pose]) -> String {
    (0..).zip(poses).fold(String::new(), |mut text, (frame, pose): (usize, _)| {
        let ([tx, ty, tz], [qx, qy, qz, qw]) = pose.components();
        let _ = writeln!(text, "{tag}{frame} {tx:.7} {ty:.7} {tz:.7} {qx:.9} {qy:.9} {qz:.9} {qw:.9}");
        text
    })
}

fn point_lines(tag: &str, points: &[(i64, Point3<f64>)]) -> String {
    points.iter().fold(String::new(), |mut text, (id, point)| {
        let _ = writeln!(text, "{tag}{id} {:.7} {:.7} {:.7}", point.x, point.y, point.z);
        text
    })
}

fn segment_lines(tag: &str, lines: &[Line]) -> String {
    lines.iter().fold(String::new(), |mut text, Line { id, ends: [start, end], .. }| {
        let _ = writeln!(
            text,
            "{tag}{id} {:.7} {:.7} {:.7} {:.7} {:.7} {:.7}",
            start.x, start.y, start.z, end.x, end.y, end.z
        );
        text
    })
}

/// Rows of every frame, noise-free or with noise, and the groups.
fn rows(scene: &Scene, poses: &[Pose], mut noise: Option<&mut Random>) -> String {
    let mut text = String::new();
    let pixel_noise =
        |noise: &mut Option<&mut Random>| noise.as_mut().map_or(0.0, |random| random.normal()) * SIGMA_PX;
    for (id, point) in &scene.points {
        for (frame, pose) in poses.iter().enumerate() {
            if let Some((pixel, _)) = sight(pose, *point) {
                let (u, v) = (pixel.x + pixel_noise(&mut noise), pixel.y + pixel_noise(&mut noise));
                let _ = writeln!(text, "MappointFrameAsso: {id} {frame} {u:.4} {v:.4}");
            }
        }
    }
    for Line { id, ends, .. } in &scene.lines {
        for (frame, pose) in poses.iter().enumerate() {
            let (Some(start), Some(end)) = (sight(pose, ends[0]), sight(pose, ends[1])) else { continue };
            // Which end comes first is arbitrary.
            let seen = if frame % 4 == 3 { [end, start] } else { [start, end] };
            let _ = write!(text, "MaplineFrameAsso: {id} {frame}");
            for (pixel, depth) in seen {
                let (u, v) = (pixel.x + pixel_noise(&mut noise), pixel.y + pixel_noise(&mut noise));
                let error = noise.as_mut().map_or(0.0, |random| random.normal()) * SIGMA_DEPTH_M;
                // As the release's code did, see the registry.
                let error = if error > 0.1 { 0.08 } else { error };
                let _ = write!(text, " {u:.4} {v:.4} {:.5}", depth + error);
            }
            text.push('\n');
        }
    }
    for group in 0..3 {
        let members: Vec<String> = scene
            .lines
            .iter()
            .filter(|line| line.group == Some(group))
            .map(|line| line.id.to_string())
            .collect();
        let _ = writeln!(text, "ParalineMaplineAsso: {group} {} {}", members.len(), members.join(" "));
    }
    text
}

/// Names and texts of the files.
fn files() -> Vec<(&'static str, String)> {
    let mut random = Random(20_240_911);
    let scene = scene(&mut random);
    let truth: Vec<Pose> = (0..FRAMES).map(pose).collect();
    let mut estimate = |sigma: f64| -> Vec<Pose> {
        // The first pose is the gauge.
        let others = truth[1..].iter().map(|pose| perturbed(pose, &mut random, sigma)).collect::<Vec<_>>();
        std::iter::once(truth[0]).chain(others).collect()
    };
    let (frame_to_frame, map_to_frame) = (estimate(0.03), estimate(0.01));
    let (point_ba, point_line_ba) = (estimate(0.004), estimate(0.003));
    let mut map = |sigma: f64| Scene {
        points: scene.points.iter().map(|(id, point)| (*id, point + random.normals(sigma))).collect(),
        lines: scene
            .lines
            .iter()
            .map(|line| Line {
                id: line.id,
                ends: line.ends.map(|end| end + random.normals(sigma)),
                group: line.group,
            })
            .collect(),
    };
    let (initial, after_points, after_lines) = (map(0.02), map(0.004), map(0.003));
    let graph = [
        pose_lines("Vertex: ", &map_to_frame),
        point_lines("Mappoint: ", &initial.points),
        segment_lines("Mapline: ", &initial.lines),
        rows(&scene, &truth, Some(&mut random)),
    ];
    vec![
        ("observation/camera_poses.txt", pose_lines("", &truth)),
        ("observation/point_landmarks.txt", point_lines("", &scene.points)),
        ("observation/structline_landmarks.txt", segment_lines("", &scene.lines)),
        ("observation/association.txt", rows(&scene, &truth, None)),
        ("baseline/venom_sequence.txt", graph.concat()),
        ("baseline/Frame-to-Frame.txt", pose_lines("", &frame_to_frame)),
        ("baseline/Map-to-Frame.txt", pose_lines("", &map_to_frame)),
        ("baseline/Point_BA.txt", pose_lines("", &point_ba)),
        ("baseline/PointLine_BA.txt", pose_lines("", &point_line_ba)),
        ("baseline/Point_Mappoint.txt", point_lines("Mappoint:", &after_points.points)),
        ("baseline/PointLine_mappoint.txt", point_lines("Mappoint:", &after_lines.points)),
        ("baseline/PointLine_mapline.txt", segment_lines("Mapline:", &after_lines.lines)),
        (
            "baseline/system_parameter.txt",
            format!(
                "The settings of the Venom Simulator system are saved in this file: \nframe_num_:{FRAMES}\ntraject_type_:0\nlines_:{}\npoints_:{POINTS}\n",
                scene.lines.len()
            ),
        ),
    ]
}

#[test]
fn the_sample_is_what_its_program_makes() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("sequences/sample");
    for (name, text) in files() {
        let path = folder.join(name);
        if std::env::var_os("UPDATE_SAMPLE").is_some() {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, &text).unwrap();
        }
        let found = fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(
            found, text,
            "{name} differs; UPDATE_SAMPLE=1 cargo test --workspace --test sample_sequence"
        );
    }
}

#[test]
fn every_point_and_line_is_seen_from_most_places() {
    let mut random = Random(20_240_911);
    let scene = scene(&mut random);
    let poses: Vec<Pose> = (0..FRAMES).map(pose).collect();
    for (id, point) in &scene.points {
        let seen = poses.iter().filter(|pose| sight(pose, *point).is_some()).count();
        assert!(seen >= 6, "point {id} is seen {seen} times");
    }
    for line in &scene.lines {
        let seen =
            poses.iter().filter(|pose| line.ends.iter().all(|end| sight(pose, *end).is_some())).count();
        assert!(seen >= 6, "line {} is seen {seen} times", line.id);
    }
}
