//! A furnished room, rendered in the layouts of the datasets, and sequences made of the images.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nalgebra::Point3;
use open_structure::geometry::{Pose, Segment};
use open_structure::simulate::render::{Layout, RenderOptions, render};
use open_structure::simulate::{Recipe, Simulation, simulate};
use open_structure_converters::generate::{Generated, Options, generate};
use open_structure_converters::rgbd::{DepthNoise, OpenOptions, RawSequence, icl, tartanair, tum};
use tempfile::TempDir;

/// A room of 5 m x 4 m x 2.8 m with two boxes in it, one along the walls and one turned, seen on a walk of 1.9 m.
const ROOM: &str = r#"
name = "room"
seed = 5
[trajectory]
kind = "waypoints"
frames = 12
look = { target_m = [0.1, 1.5, -0.5] }
waypoints = [{ position_m = [-0.9, -0.9, 0.2] }, { position_m = [0.0, -1.2, 0.3] }, { position_m = [0.9, -0.8, 0.4] }]
[[scene]]
kind = "room"
size_m = [5.0, 4.0, 2.8]
[[scene]]
kind = "box"
size_m = [0.8, 0.8, 1.2]
position_m = [-1.2, 1.5, -0.8]
[[scene]]
kind = "box"
size_m = [1.1, 0.8, 0.7]
position_m = [0.7, 1.0, -1.05]
roll_pitch_yaw_deg = [0.0, 0.0, 32.0]
[points]
count = 100
[lines]
count = 50
min_length_m = 0.5
max_length_m = 3.0
on_edges = 0.5
oblique = 0.0
free = 0.0
"#;

/// Frames of the walk.
const FRAMES: usize = 12;

/// Layouts that are rendered.
pub(crate) const LAYOUTS: [Layout; 4] = [Layout::Tum, Layout::Icl, Layout::IclOriginal, Layout::TartanAir];

/// A camera of about three tenths of the dataset's size.
fn camera(layout: Layout) -> &'static str {
    match layout {
        Layout::Tum => "fx = 147.2\nfy = 148.3\ncx = 88.1\ncy = 68.1\nwidth = 176\nheight = 132",
        Layout::Icl | Layout::IclOriginal => {
            "preset = \"icl-nuim\"\nfx = 132.3\nfy = -132.0\ncx = 87.5\ncy = 65.5\nwidth = 176\nheight = 132"
        }
        Layout::TartanAir => {
            "preset = \"tartanair\"\nfx = 132.0\nfy = 132.0\ncx = 88.0\ncy = 66.0\nwidth = 176\nheight = 132"
        }
    }
}

/// What was simulated for a layout, and the files that were rendered, by their paths.
pub(crate) struct Room {
    pub(crate) layout: Layout,
    pub(crate) simulation: Simulation,
    files: Vec<(PathBuf, Vec<u8>)>,
}

static ROOMS: [OnceLock<Room>; 4] = [const { OnceLock::new() }; 4];
static SEQUENCES: [OnceLock<Generated>; 4] = [const { OnceLock::new() }; 4];

fn place(layout: Layout) -> usize {
    LAYOUTS.iter().position(|other| *other == layout).unwrap()
}

/// The room in a layout; rendered once for all tests.
pub(crate) fn room(layout: Layout) -> &'static Room {
    ROOMS[place(layout)].get_or_init(|| {
        let recipe = Recipe::from_toml(&format!("{ROOM}\n[camera]\n{}", camera(layout))).unwrap();
        let simulation = simulate(&recipe, Path::new(""), &|_, _, _| {}).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let options = RenderOptions {
            // Half the walk of the same camera.
            frames: if layout == Layout::IclOriginal { 0..8 } else { 0..FRAMES },
            ..RenderOptions::new(layout)
        };
        render(&simulation, &options, folder.path(), &|_, _| {}).unwrap();
        let mut files = Vec::new();
        let mut folders = vec![folder.path().to_owned()];
        while let Some(below) = folders.pop() {
            for entry in fs::read_dir(below).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let name = path.strip_prefix(folder.path()).unwrap().to_owned();
                    files.push((name, fs::read(path).unwrap()));
                }
            }
        }
        Room { layout, simulation, files }
    })
}

/// The sequence that is made of the room's images; made once for all tests.
pub(crate) fn sequence(layout: Layout) -> &'static Generated {
    SEQUENCES[place(layout)].get_or_init(|| room(layout).converted(&options(layout), 2, |_| {}))
}

/// Options for images without any noise, and a third as wide as a dataset's.
pub(crate) fn options(layout: Layout) -> Options {
    let mut options = Options::default();
    // Small images have small corners, and an image of a level less than 70 px high has none.
    options.points.levels = 3;
    options.points.fast_threshold = 10;
    options.segments.length_px = 18.0;
    if layout == Layout::Tum {
        // Half a step of the files is all that is wrong.
        options.depth.noise = Some(DepthNoise { constant_m: 1e-4, linear: 0.0, quadratic_per_m: 0.0 });
        options.depth.pose_sigma_m = Some(0.0);
    }
    options
}

impl Room {
    /// The images in a folder.
    pub(crate) fn folder(&self) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in &self.files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        folder
    }

    /// The sequence that is made of the images, after a change to what is read.
    pub(crate) fn converted(
        &self,
        options: &Options,
        threads: usize,
        change: impl FnOnce(&mut RawSequence),
    ) -> Generated {
        // As the program does: what is tested are its threads.
        opencv::core::set_num_threads(1).unwrap();
        let folder = self.folder();
        let open = match self.layout {
            Layout::Tum => tum::open,
            Layout::Icl | Layout::IclOriginal => icl::open,
            Layout::TartanAir => tartanair::open,
        };
        let mut raw = open(folder.path(), &OpenOptions::default()).unwrap();
        change(&mut raw);
        generate(&raw, "room", options, threads, false, &|_, _, _| {}).unwrap()
    }

    /// From the world of the sequence to that of the scene: TartanAir's is north-east-down, half a turn about x.
    pub(crate) fn scene_from_world(&self) -> Pose {
        let tartanair = self.layout == Layout::TartanAir;
        let rotation_xyzw = if tartanair { [1.0, 0.0, 0.0, 0.0] } else { [0.0, 0.0, 0.0, 1.0] };
        Pose::from_components([0.0; 3], rotation_xyzw).unwrap()
    }

    /// Edges of the room and its boxes, and the lines that are painted on them.
    pub(crate) fn lines(&self) -> Vec<Segment> {
        let edges = self.simulation.scene().edges.iter();
        let mut lines: Vec<Segment> =
            edges.map(|edge| Segment { start: edge.start, end: edge.end }).collect();
        lines.extend(self.simulation.line_landmarks().unwrap().iter().map(|row| Segment {
            start: Point3::new(row.start_x, row.start_y, row.start_z),
            end: Point3::new(row.end_x, row.end_y, row.end_z),
        }));
        lines
    }
}
