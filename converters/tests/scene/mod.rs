//! A small scene, and a text release of it as the published ones look.
#![allow(clippy::format_collect, reason = "tests")]

use nalgebra::{Point2, Point3, UnitQuaternion, Vector3};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;

/// Random numbers of a known recurrence: the same on every machine.
pub(crate) struct Draw(u64);

impl Draw {
    /// Uniform in (0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Normal, by Box and Muller.
    pub(crate) fn normal(&mut self, sigma: f64) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        sigma * radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Noise of the rows of a file.
#[derive(Clone, Copy)]
pub(crate) enum Noise {
    None,
    /// 1 px; 0.05 m, of which what exceeds 0.1 m is replaced by 0.08 m.
    FirstRelease {
        seed: u64,
    },
}

/// A line as it was observed, and as it was published: turned about its midpoint.
#[derive(Clone, Copy)]
pub(crate) struct SceneLine {
    pub(crate) group: i64,
    pub(crate) unrefined: Segment,
    pub(crate) published: Segment,
}

pub(crate) struct Scene {
    pub(crate) camera: PinholeCamera,
    /// `world_from_camera`; ids have gaps.
    pub(crate) frames: BTreeMap<i64, Pose>,
    pub(crate) points: BTreeMap<i64, Point3<f64>>,
    pub(crate) lines: BTreeMap<i64, SceneLine>,
}

/// Rows `(landmark, frame, numbers)`.
pub(crate) struct SceneRows {
    pub(crate) points: Vec<(i64, i64, [f64; 2])>,
    pub(crate) lines: Vec<(i64, i64, [f64; 6])>,
}

/// The text files of both archives, by name.
pub(crate) struct Release {
    pub(crate) observation: BTreeMap<String, String>,
    pub(crate) baseline: BTreeMap<String, String>,
}

/// To the digits that are printed, so that truth and text are the same numbers.
fn printed(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

fn printed_point(point: Point3<f64>) -> Point3<f64> {
    point.map(printed)
}

impl Scene {
    pub(crate) fn new() -> Self {
        Self::with_camera([535.4, 539.2, 320.1, 247.6])
    }

    pub(crate) fn with_camera([fx, fy, cx, cy]: [f64; 4]) -> Self {
        let camera = PinholeCamera { fx, fy, cx, cy, width: 640, height: 480 };
        let mut draw = Draw(42);
        let mut between = |low: f64, high: f64| low + (high - low) * draw.uniform();
        let frames = (0..32)
            .map(|index| {
                let turn = f64::from(index) / 31.0 - 0.5;
                let translation =
                    Vector3::new(1.6 * turn, 0.4 * (3.0 * turn).sin(), -4.0 + turn).map(printed);
                let rotation = UnitQuaternion::from_euler_angles(0.05 * turn, -0.3 * turn, 0.1 * turn);
                let components = rotation.coords.map(printed);
                let pose = Pose::from_components(translation.into(), components.into()).unwrap();
                (i64::from(index) + i64::from(index / 10), pose)
            })
            .collect();
        let points = (0..70)
            .map(|id| {
                let point = Point3::new(between(-1.0, 1.0), between(-0.7, 0.7), between(-0.6, 0.6));
                (id * 3 + 1, printed_point(point))
            })
            .collect();
        let directions = [Vector3::new(1.0, 0.1, 0.2), Vector3::new(0.1, 1.0, -0.3)];
        let lines = (0..10)
            .map(|id| {
                let group = i64::from(id >= 5);
                let direction = directions[usize::from(id >= 5)].normalize();
                let midpoint = Point3::new(between(-0.5, 0.5), between(-0.4, 0.4), between(-0.4, 0.4));
                let half = between(0.25, 0.4);
                // Two to three degrees, as the release's lines were turned.
                let axis = direction.cross(&Vector3::new(between(-1.0, 1.0), 0.3, between(0.5, 1.0)));
                let turned =
                    UnitQuaternion::from_scaled_axis(axis.normalize() * between(0.035, 0.05)) * direction;
                let sign = if id % 2 == 0 { 1.0 } else { -1.0 };
                let segment = |along: Vector3<f64>| Segment {
                    start: printed_point(midpoint - along * half * sign),
                    end: printed_point(midpoint + along * half * sign),
                };
                (id * 2, SceneLine { group, unrefined: segment(turned), published: segment(direction) })
            })
            .collect();
        Self { camera, frames, points, lines }
    }

    pub(crate) fn depth_of_point(&self, frame: i64, point: i64) -> f64 {
        (self.frames[&frame].inverse() * self.points[&point]).z
    }

    /// What every frame sees, without noise; ends in alternating order.
    pub(crate) fn rows(&self) -> SceneRows {
        let mut rows = SceneRows { points: Vec::new(), lines: Vec::new() };
        let inside =
            |pixel: &Point2<f64>| (0.0..=640.0).contains(&pixel.x) && (0.0..=480.0).contains(&pixel.y);
        for (frame, pose) in &self.frames {
            let camera_from_world = pose.inverse();
            let see = |point: Point3<f64>| {
                let in_camera = camera_from_world * point;
                let pixel = self.camera.project(in_camera).filter(inside)?;
                Some([pixel.x, pixel.y, in_camera.z])
            };
            for (id, point) in &self.points {
                rows.points.extend(see(*point).map(|[u, v, _]| (*id, *frame, [u, v])));
            }
            for (id, line) in &self.lines {
                let ends = (see(line.unrefined.start), see(line.unrefined.end));
                let (Some(a), Some(b)) = ends else { continue };
                let (a, b) = if (id + frame) % 3 == 0 { (b, a) } else { (a, b) };
                rows.lines.push((*id, *frame, [a[0], a[1], a[2], b[0], b[1], b[2]]));
            }
        }
        rows
    }

    /// Tagged rows of a file of observations.
    fn tagged(&self, noise: Noise) -> String {
        let SceneRows { points, lines } = self.rows();
        let mut draw = Draw(match noise {
            Noise::None => 0,
            Noise::FirstRelease { seed } => seed,
        });
        let pixel = |value: f64, draw: &mut Draw| match noise {
            Noise::None => value,
            Noise::FirstRelease { .. } => value + draw.normal(1.0),
        };
        let depth = |value: f64, draw: &mut Draw| match noise {
            Noise::None => value,
            Noise::FirstRelease { .. } => {
                let noise = draw.normal(0.05);
                value + if noise > 0.1 { 0.08 } else { noise }
            }
        };
        let mut text = String::new();
        for (id, frame, [u, v]) in points {
            let (u, v) = (pixel(u, &mut draw), pixel(v, &mut draw));
            writeln!(text, "MappointFrameAsso: {id} {frame} {u:.4} {v:.4}").unwrap();
        }
        for (id, frame, ends) in lines {
            write!(text, "MaplineFrameAsso: {id} {frame}").unwrap();
            for [u, v, d] in [[ends[0], ends[1], ends[2]], [ends[3], ends[4], ends[5]]] {
                let (u, v, d) = (pixel(u, &mut draw), pixel(v, &mut draw), depth(d, &mut draw));
                write!(text, " {u:.4} {v:.4} {d:.5}").unwrap();
            }
            text.push_str(" \n");
        }
        for group in 0..2 {
            let ids: Vec<String> = self
                .lines
                .iter()
                .filter(|(_, line)| line.group == group)
                .map(|(id, _)| id.to_string())
                .collect();
            writeln!(text, "ParalineMaplineAsso: {group} {} {}", ids.len(), ids.join("  ")).unwrap();
        }
        text
    }

    pub(crate) fn release(&self, association: Noise, graph: Noise) -> Release {
        let mut draw = Draw(99);
        let mut poses = String::new();
        let mut drifted = String::new();
        for (id, pose) in &self.frames {
            let ([x, y, z], [qx, qy, qz, qw]) = pose.components();
            writeln!(poses, "{id} {x:.6} {y:.6} {z:.6} {qx:.7} {qy:.7} {qz:.7} {qw:.7}").unwrap();
            let [x, y, z] = [x, y, z].map(|value| value + draw.normal(0.01));
            writeln!(drifted, "{id} {x:.6} {y:.6} {z:.6} {qx:.7} {qy:.7} {qz:.7} {qw:.7}").unwrap();
        }
        let points: String =
            self.points.iter().map(|(id, p)| format!("{id} {:.6} {:.6} {:.6}\n", p.x, p.y, p.z)).collect();
        let lines: String = self
            .lines
            .iter()
            .map(|(id, line)| {
                let Segment { start, end } = line.published;
                format!(
                    "{id} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6}\n",
                    start.x, start.y, start.z, end.x, end.y, end.z
                )
            })
            .collect();
        let tag =
            |text: &str, tag: &str| text.lines().map(|line| format!("{tag}: {line}\n")).collect::<String>();
        let graph = tag(&drifted, "Vertex")
            + &tag(&points, "Mappoint")
            + &tag(&lines, "Mapline")
            + &self.tagged(graph);
        let files = |files: &[(&str, String)]| {
            files.iter().map(|(name, text)| ((*name).to_owned(), text.clone())).collect::<BTreeMap<_, _>>()
        };
        Release {
            observation: files(&[
                ("camera_poses.txt", poses.clone()),
                ("point_landmarks.txt", points.trim_end().to_owned()),
                ("structline_landmarks.txt", lines),
                ("association.txt", self.tagged(association)),
            ]),
            baseline: files(&[
                ("venom_sequence.txt", graph),
                ("ground_truth.txt", poses),
                ("estimated_vo.txt", drifted.clone()),
                ("estimated_localmap.txt", drifted),
            ]),
        }
    }
}

impl Release {
    /// Writes `observation.zip` and `baseline.zip`; archives without files are not written.
    pub(crate) fn write_archives(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        for (name, files) in [("observation", &self.observation), ("baseline", &self.baseline)] {
            if files.is_empty() {
                continue;
            }
            let file = fs::File::create(folder.join(format!("{name}.zip"))).unwrap();
            let mut archive = zip::ZipWriter::new(file);
            for (inner, text) in files {
                let options = zip::write::SimpleFileOptions::default();
                archive.start_file(format!("{name}/{inner}"), options).unwrap();
                archive.write_all(text.as_bytes()).unwrap();
            }
            archive.finish().unwrap();
        }
    }
}
