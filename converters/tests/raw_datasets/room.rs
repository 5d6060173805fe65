//! A simulated room, rendered in the layouts of the datasets.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use open_structure::simulate::render::{Layout, RenderOptions, render};
use open_structure::simulate::{Recipe, Simulation, simulate};
use open_structure_converters::rgbd::{Error, OpenOptions, RawSequence, icl, tartanair, tum};
use opencv::core::{CV_8UC1, CV_16UC1, Mat, Scalar, Vector};
use opencv::imgcodecs;
use tempfile::TempDir;

/// A room of 7 m x 8 m x 3 m with a box in it, both along the axes, seen by a camera of a tenth of a dataset's size.
const ROOM: &str = r#"
name = "room"
seed = 5
[trajectory]
kind = "waypoints"
frames = 5
look = { target_m = [0.6, 2.2, 0.8] }
waypoints = [{ position_m = [-2.2, -2.5, 1.5] }, { position_m = [0.0, -3.0, 1.7] }]
[[scene]]
kind = "room"
size_m = [7.0, 8.0, 3.0]
position_m = [0.0, 0.0, 1.5]
[[scene]]
kind = "box"
size_m = [0.8, 2.0, 2.0]
position_m = [1.6, 1.0, 1.0]
[points]
count = 20
[lines]
count = 10
min_length_m = 0.5
"#;

const TUM: &str = "fx = 66.9\nfy = 67.4\ncx = 39.6\ncy = 30.5\nwidth = 80\nheight = 60";
const ICL: &str =
    "preset = \"icl-nuim\"\nfx = 60.15\nfy = -60.0\ncx = 39.5\ncy = 29.5\nwidth = 80\nheight = 60";
const TARTANAIR: &str =
    "preset = \"tartanair\"\nfx = 40.0\nfy = 40.0\ncx = 40.0\ncy = 30.0\nwidth = 80\nheight = 60";

/// Layouts that are rendered.
pub(crate) const LAYOUTS: [Layout; 4] = [Layout::Tum, Layout::Icl, Layout::IclOriginal, Layout::TartanAir];

/// What was simulated for a layout, and the files that were rendered, by their paths; done once for all tests.
type Made = (Simulation, Vec<(PathBuf, Vec<u8>)>);

static MADE: [OnceLock<Made>; 4] = [const { OnceLock::new() }; 4];

fn made(layout: Layout) -> &'static Made {
    let place = LAYOUTS.iter().position(|other| *other == layout).unwrap();
    MADE[place].get_or_init(|| {
        let simulation = simulation(layout);
        let folder = tempfile::tempdir().unwrap();
        render(&simulation, &RenderOptions::new(layout), folder.path(), &|_, _| {}).unwrap();
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
        (simulation, files)
    })
}

fn simulation(layout: Layout) -> Simulation {
    let camera = match layout {
        Layout::Tum => TUM,
        Layout::Icl | Layout::IclOriginal => ICL,
        Layout::TartanAir => TARTANAIR,
    };
    let recipe = Recipe::from_toml(&format!("{ROOM}\n[camera]\n{camera}")).unwrap();
    simulate(&recipe, Path::new(""), &|_, _, _| {}).unwrap()
}

/// The room's five frames in a layout.
pub(crate) fn rendered(layout: Layout) -> (&'static Simulation, TempDir) {
    let (simulation, files) = made(layout);
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    (simulation, folder)
}

pub(crate) fn open(layout: Layout, folder: &Path, options: &OpenOptions) -> Result<RawSequence, Error> {
    match layout {
        Layout::Tum => tum::open(folder, options),
        Layout::Icl | Layout::IclOriginal => icl::open(folder, options),
        Layout::TartanAir => tartanair::open(folder, options),
    }
}

/// Distance of a point from the nearest surface of the room, metres.
pub(crate) fn distance(point: nalgebra::Point3<f64>) -> f64 {
    // Negative inside.
    let outside = |size: [f64; 3], middle: [f64; 3]| {
        let beyond = [0, 1, 2].map(|axis: usize| (point[axis] - middle[axis]).abs() - size[axis] / 2.0);
        let far = beyond.map(|axis| axis.max(0.0));
        let far = far.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
        far + beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0)
    };
    let room = outside([7.0, 8.0, 3.0], [0.0, 0.0, 1.5]).abs();
    room.min(outside([0.8, 2.0, 2.0], [1.6, 1.0, 1.0]).abs())
}

/// Changes a text file.
pub(crate) fn edit(path: &Path, change: impl FnOnce(String) -> String) {
    fs::write(path, change(fs::read_to_string(path).unwrap())).unwrap();
}

/// Writes a grey PNG of 8 or 16 bits, all of one value.
pub(crate) fn write_png(path: &Path, [width, height]: [i32; 2], bits: u8) {
    let kind = if bits == 8 { CV_8UC1 } else { CV_16UC1 };
    let picture = Mat::new_rows_cols_with_default(height, width, kind, Scalar::all(90.0)).unwrap();
    assert!(imgcodecs::imwrite(path.to_str().unwrap(), &picture, &Vector::new()).unwrap());
}
