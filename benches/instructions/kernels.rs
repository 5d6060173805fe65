//! One hot kernel on a small fixed input, a number of times, on this thread alone: what `benches/instructions/count` counts.
//!
//! `kernels KERNEL REPETITIONS` makes the input and runs the kernel; with 0 repetitions it makes the input alone, so that the difference
//! of two runs is the kernel's. `kernels` lists the names.

#[path = "../data/simulated.rs"]
mod simulated;

use std::hint::black_box;
use std::path::Path;

use anyhow::{Context, Result, bail};
use nalgebra::Point3;
use open_structure::adjust::{Method, Options, SolverOptions, adjust};
use open_structure::covisibility::{GraphOptions, reprojection_graph};
use open_structure::format::{self, WriteOptions};
use open_structure::simulate::visibility::{Occluders, View, Visibility, VisibilityModel};
use open_structure::simulate::{self, Survey};
use open_structure::structure::{Frame, MeasuredFrame, MeasurementNoise, PointMeasurement};

/// The names of the kernels, in the order in which they are counted.
const KERNELS: [&str; 5] = ["adjust-step", "parquet-rows", "mcap-frames", "track-frames", "visible-points"];

/// Frames of the simulated sequence.
const FRAMES: usize = 40;

fn main() -> Result<()> {
    // The main thread is the only one: what threads do while they wait would be counted too.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    let mut arguments = std::env::args().skip(1);
    let Some(kernel) = arguments.next() else {
        KERNELS.iter().for_each(|name| println!("{name}"));
        return Ok(());
    };
    let repetitions: u64 = arguments.next().context("kernels KERNEL REPETITIONS")?.parse()?;
    let sequence = simulated::simulated("corridor1", FRAMES)?;
    let frames = MeasuredFrame::of(&sequence);
    let folder = tempfile::tempdir()?;
    match kernel.as_str() {
        // A graph into a problem, its residuals and normal equations, one step of point adjustment.
        "adjust-step" => {
            let estimate = simulated::tracked(&sequence, &frames)?;
            let (cameras, noise) =
                (&sequence.manifest.cameras, MeasurementNoise::declared(&sequence.manifest));
            let groups = &sequence.structural_groups;
            let (graph, _) =
                reprojection_graph(&frames, &estimate, cameras, noise, groups, &GraphOptions::default())?;
            let solver = SolverOptions { max_iterations: 1, ..SolverOptions::default() };
            let options = Options { solver, ..Options::of(Method::Point) };
            for _ in 0..repetitions {
                black_box(adjust(&graph, &options)?);
            }
        }
        // Pages of measurements decompressed, decoded and turned into rows.
        "parquet-rows" => {
            let path = folder.path().join("sequence");
            format::write(&path, &sequence, WriteOptions::default())?;
            let reader = format::open(&path)?;
            for _ in 0..repetitions {
                black_box(reader.table::<PointMeasurement>()?);
            }
        }
        // Every frame with its rows out of an MCAP file.
        "mcap-frames" => {
            let path = folder.path().join("sequence.mcap");
            format::write(&path, &sequence, WriteOptions::default())?;
            let reader = format::open(&path)?;
            reader.frame_list()?;
            for _ in 0..repetitions {
                for frame in reader.frames()? {
                    black_box(frame?);
                }
            }
        }
        // Every frame tracked against the map.
        "track-frames" => {
            for _ in 0..repetitions {
                black_box(simulated::tracked(&sequence, &frames)?);
            }
        }
        // Which points lie in the frusta of the frames.
        "visible-points" => {
            let recipe = simulate::named("corridor1")?;
            let camera = recipe.camera.pinhole("camera")?;
            let visibility = Visibility { model: VisibilityModel::Frustum, ..recipe.visibility };
            let simulation = simulate::simulate(&recipe, Path::new(""), &|_, _, _| ())?;
            let points: Vec<Point3<f64>> =
                simulation.point_landmarks().iter().map(|row| Point3::new(row.x, row.y, row.z)).collect();
            let view = |frame: &Frame| -> Result<View> {
                let pose = frame.world_from_camera().context("a frame without a pose")?.pose()?;
                Ok(View::new(camera, &pose, visibility.bounds()))
            };
            let views = sequence.frames.iter().map(view).collect::<Result<_>>()?;
            let survey = Survey::new(views, Occluders::new(simulation.scene()), visibility);
            for _ in 0..repetitions {
                black_box(survey.points(&points, &|| ()));
            }
        }
        other => bail!("no kernel {other}; there are {}", KERNELS.join(", ")),
    }
    Ok(())
}
