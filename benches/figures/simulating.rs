//! How fast it is found what frames see, how the work grows, and what memory it takes.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use nalgebra::Point3;
use open_structure::format;
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::simulate::visibility::{Occluders, View, Visibility, VisibilityModel};
use open_structure::simulate::{self, Recipe, Survey};

use crate::figure::{Bound, Figures, median_time};

const RUNS: usize = 5;

/// The frustum test as it is written with NumPy: all points at once, frame by frame. Prints frames that were
/// tried a second and what they see, all together.
const NUMPY: &str = "
import sys, time
import numpy as np
folder, fx, fy, cx, cy, width, height = sys.argv[1], *map(float, sys.argv[2:])
points = np.ascontiguousarray(np.fromfile(folder + '/points').reshape(-1, 3).T)
poses = np.fromfile(folder + '/poses').reshape(-1, 3, 4)
times = []
for _ in range(6):
    start, seen = time.perf_counter(), 0
    with np.errstate(all='ignore'):
        for pose in poses:
            x, y, z = pose[:, :3] @ points + pose[:, 3:]
            u, v = fx * x / z + cx, fy * y / z + cy
            mask = (z > 0.01) & (u >= 0) & (u <= width) & (v >= 0) & (v <= height)
            seen += len(np.flatnonzero(mask))
    times.append(time.perf_counter() - start)
print(sorted(times[1:])[2], seen)
";

/// Every figure of the simulator.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    for (scene, frames) in [("corridor1", 1000), ("box1", 1000)] {
        against_numpy(figures, scene, frames)?;
    }
    growth(figures)?;
    memory(figures)
}

/// A recipe of the library with other numbers of frames and landmarks.
fn recipe(name: &str, frames: u64, points: u32) -> Result<Recipe> {
    let mut recipe = serde_json::to_value(simulate::named(name)?)?;
    recipe["trajectory"]["frames"] = frames.into();
    recipe["points"] = serde_json::json!({ "count": points });
    recipe["lines"]["count"] = 0.into();
    if let Some(fields) = recipe.as_object_mut() {
        fields.remove("expected");
    }
    Ok(serde_json::from_value(recipe)?)
}

/// Pairs of a landmark and a frame that are tried in a second, and the same by NumPy.
fn against_numpy(figures: &mut Figures, name: &str, frames: u64) -> Result<()> {
    let recipe = recipe(name, frames, 100_000)?;
    let simulation = simulate::simulate(&recipe, Path::new(""), &|_, _, _| ())?;
    let camera = recipe.camera.pinhole("camera")?;
    let points: Vec<Point3<f64>> =
        simulation.point_landmarks().iter().map(|row| Point3::new(row.x, row.y, row.z)).collect();
    let poses = simulation
        .frames()
        .iter()
        .map(|frame| Ok(frame.world_from_camera().context("a frame without a pose")?.pose()?))
        .collect::<Result<Vec<_>>>()?;
    let pairs = points.len() as f64 * poses.len() as f64 / 1e6;

    let mut seen = Vec::new();
    let mut speeds = Vec::new();
    for model in [VisibilityModel::Frustum, VisibilityModel::Occlusion] {
        let visibility = Visibility { model, ..recipe.visibility };
        let views = poses.iter().map(|pose| View::new(camera, pose, visibility.bounds())).collect();
        let survey = Survey::new(views, Occluders::new(simulation.scene()), visibility);
        let time = median_time(RUNS, || survey.points(&points, &|| ())).as_secs_f64();
        seen.push(survey.points(&points, &|| ()).iter().map(Vec::len).sum::<usize>());
        speeds.push(pairs / time);
    }
    let what = format!("{name}, {} points, {} frames", points.len(), poses.len());
    let unit = "million pairs/s";
    figures.add(format!("trying what is in view, {what}"), speeds[0], unit, Bound::None);
    figures.add(format!("trying what is seen, faces included, {what}"), speeds[1], unit, Bound::None);
    let Some((numpy, seen_by_numpy)) = numpy(&points, &poses, &camera)? else { return Ok(()) };
    ensure!(seen[0] == seen_by_numpy, "{name}: NumPy sees {seen_by_numpy} points, we see {}", seen[0]);
    let numpy = pairs / numpy;
    figures.add(format!("NumPy, trying what is in view, {what}"), numpy, unit, Bound::None);
    let over = |which: &str| format!("{which} over NumPy's frustum, {name}");
    figures.add(over("trying what is in view"), speeds[0] / numpy, "times", Bound::AtLeast(10.0));
    figures.add(over("trying what is seen, faces included"), speeds[1] / numpy, "times", Bound::AtLeast(2.0));
    Ok(())
}

/// Seconds that NumPy takes, and how many points it sees, all frames together; `None` without NumPy.
fn numpy(points: &[Point3<f64>], poses: &[Pose], camera: &PinholeCamera) -> Result<Option<(f64, usize)>> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let points = points.iter().flat_map(|point| [point.x, point.y, point.z]);
    fs::write(folder.path().join("points"), points.flat_map(f64::to_ne_bytes).collect::<Vec<u8>>())?;
    let rows = poses.iter().flat_map(|pose| {
        let inverse = pose.inverse();
        let (rotation, translation) = (inverse.rotation_matrix(), inverse.translation());
        (0..3).flat_map(move |row| {
            [rotation[(row, 0)], rotation[(row, 1)], rotation[(row, 2)], translation[row]]
        })
    });
    fs::write(folder.path().join("poses"), rows.flat_map(f64::to_ne_bytes).collect::<Vec<u8>>())?;
    let PinholeCamera { fx, fy, cx, cy, width, height } = *camera;
    let numbers = [fx, fy, cx, cy, width.into(), height.into()].map(|number: f64| number.to_string());
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    let output = Command::new(python).args(["-c", NUMPY]).arg(folder.path()).args(numbers).output();
    let Some(output) = output.ok().filter(|output| output.status.success()) else {
        eprintln!("SKIPPED: NumPy, which is not in .venv");
        return Ok(None);
    };
    let text = String::from_utf8(output.stdout)?;
    let (seconds, seen) = text.trim().split_once(' ').context("no two numbers")?;
    Ok(Some((seconds.parse()?, seen.parse()?)))
}

/// What a run of `os simulate` took.
struct Run {
    seconds: f64,
    /// Greatest resident memory, MiB.
    peak_mib: f64,
    /// Observations of points and lines.
    observations: f64,
}

impl Run {
    /// Time per observation, nanoseconds.
    fn nanos(&self) -> f64 {
        self.seconds / self.observations * 1e9
    }
}

/// Runs `os simulate` and looks at its memory meanwhile; the output is removed.
fn run(recipe: &serde_json::Value, encoding: &str) -> Result<Run> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let (path, output) = (folder.path().join("recipe.json"), folder.path().join(format!("out.{encoding}")));
    fs::write(&path, recipe.to_string())?;
    let start = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_os"))
        .arg("simulate")
        .arg(&path)
        .arg("-o")
        .arg(&output)
        .stdout(Stdio::null())
        .spawn()?;
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0_f64;
    let ending = loop {
        // The kernel keeps the greatest value, so only what comes after the last look is missed.
        let text = fs::read_to_string(&status).unwrap_or_default();
        if let Some(line) = text.lines().find_map(|line| line.strip_prefix("VmHWM:")) {
            peak = peak.max(line.trim().trim_end_matches(" kB").parse().unwrap_or(0.0));
        }
        if let Some(ending) = child.try_wait()? {
            break ending;
        }
        thread::sleep(Duration::from_millis(2));
    };
    let seconds = start.elapsed().as_secs_f64();
    ensure!(ending.success(), "os simulate ended with {ending}");
    let reader = format::open(&output)?;
    let rows = |table: &str| {
        reader
            .tables()
            .iter()
            .find(|stored| stored.table.name == table)
            .and_then(|stored| stored.rows)
            .unwrap_or(0)
    };
    let observations = (rows("point_observations") + rows("line_observations")) as f64;
    Ok(Run { seconds, peak_mib: peak / 1024.0, observations })
}

/// A corridor of a length, in corridors of the first release, walked once round; nothing is seen that is
/// farther than 8 m, so that length alone does not change how much a frame sees.
fn corridor(length: f64, frames: u64, points: u32, lines: u32) -> serde_json::Value {
    serde_json::json!({
        "name": "corridor",
        "trajectory": { "kind": "corridor", "frames": frames, "half_leg_m": [11.0 * length - 5.0, 11.0 * length - 5.0] },
        "scene": [{ "kind": "ring-corridor", "outer_m": 22.0 * length, "inner_m": 22.0 * length - 8.8 }],
        "points": { "count": points },
        "lines": { "count": lines, "max_length_m": 2.0, "free": 0.5, "on_edges": 0.1, "oblique": 0.1 },
        "visibility": { "depth_range_m": [0.1, 8.0] },
        "noise": { "model": "gaussian" },
    })
}

/// Time per observation, as frames and landmarks grow tenfold: where frames see as much, and where they see
/// ten times as much, in the same corridor.
fn growth(figures: &mut Figures) -> Result<()> {
    let small = corridor(1.0, 1000, 9_000, 1_000);
    let longer = corridor(10.0, 10_000, 90_000, 10_000);
    let denser = corridor(1.0, 10_000, 90_000, 10_000);
    for encoding in ["parquet", "mcap"] {
        // The small one several times, about the large ones, so that all meet the same machine.
        let mut of_small = vec![run(&small, encoding)?, run(&small, encoding)?];
        let of_longer = run(&longer, encoding)?;
        of_small.push(run(&small, encoding)?);
        let of_denser = run(&denser, encoding)?;
        of_small.extend([run(&small, encoding)?, run(&small, encoding)?]);
        of_small.sort_unstable_by(|one, other| one.seconds.total_cmp(&other.seconds));
        let of_small = of_small.swap_remove(2);
        let runs = [
            ("1k frames x 10k landmarks", &of_small),
            ("10k x 100k, as many in a frame", &of_longer),
            ("10k x 100k, ten times as many in a frame", &of_denser),
        ];
        for (what, run) in runs {
            let what =
                format!("simulating {what} ({:.2} million observations), {encoding}", run.observations / 1e6);
            figures.add(what, run.nanos(), "ns an observation", Bound::None);
        }
        for (what, run) in [("as many", &of_longer), ("ten times as many", &of_denser)] {
            let what = format!(
                "time an observation, ten times the frames and landmarks, {what} in a frame, {encoding}"
            );
            figures.add(what, run.nanos() / of_small.nanos(), "times", Bound::AtMost(1.3));
        }
    }
    Ok(())
}

/// Memory while a hundred million observations are written.
fn memory(figures: &mut Figures) -> Result<()> {
    let mut recipe = corridor(1.0, 10_000, 190_000, 1_000);
    if let Some(fields) = recipe.as_object_mut() {
        fields.remove("noise");
    }
    for encoding in ["parquet", "mcap"] {
        let run = run(&recipe, encoding)?;
        let what = format!("simulating {:.1} million observations, {encoding}", run.observations / 1e6);
        figures.add(format!("{what}: resident memory"), run.peak_mib, "MiB", Bound::AtMost(1024.0));
        figures.add(format!("{what}: speed"), run.observations / run.seconds / 1e6, "million/s", Bound::None);
    }
    Ok(())
}
