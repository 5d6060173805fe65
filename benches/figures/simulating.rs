//! How fast it is found what frames see, how the work grows, and what memory it takes.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use nalgebra::Point3;
use open_structure::geometry::PinholeCamera;
use open_structure::simulate::scene::Scene;
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
    Ok(())
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
fn numpy(
    points: &[Point3<f64>],
    poses: &[open_structure::geometry::Pose],
    camera: &PinholeCamera,
) -> Result<Option<(f64, usize)>> {
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
