//! A scene in a few numbers, expanded into every table of a sequence.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use serde::Deserialize;
use serde_json::Value;

use super::Result;
use super::document::{Cell, Document, hexadecimal};
use super::noise::Noise;
use super::view::{Lens, Placement, line_forms};

/// What `base.json` holds: a small world, cameras that see it, and how it is measured.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    /// The manifest, without table summaries.
    manifest: Value,
    frames: Vec<Exposure>,
    points: Vec<Point>,
    lines: Vec<Line>,
    groups: Vec<Group>,
    /// Points that a frame does not see: `[frame_id, point_id]`.
    hidden_points: Vec<(i64, i64)>,
    /// Noise of the measurements.
    noise: MeasurementNoise,
    estimates: Vec<Estimate>,
    graph: Graph,
    /// Tables to make; `frames` is always made.
    tables: BTreeSet<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Exposure {
    frame_id: i64,
    stamp_nanos: i64,
    camera_id: i64,
    /// Camera centre in `world`, metres.
    position: [f64; 3],
    /// Rotation vector of `world_from_camera`, radians.
    rotation: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "columns bear these names")]
struct Point {
    point_id: i64,
    /// Position in `world`, metres.
    at: [f64; 3],
    descriptor: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "columns bear these names")]
struct Line {
    line_id: i64,
    start: [f64; 3],
    end: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "columns bear these names")]
struct Group {
    group_id: i64,
    kind: String,
    line_ids: Vec<i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasurementNoise {
    seed: u64,
    sigma_px: f64,
    sigma_depth_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Estimate {
    name: String,
    seed: u64,
    sigma_m: f64,
    sigma_rad: f64,
    /// Whether a map goes with the trajectory.
    map: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Graph {
    name: String,
    seed: u64,
    sigma_m: f64,
    sigma_rad: f64,
    /// Frames whose measurements become factors.
    measured_frames: Vec<i64>,
}

struct World {
    placements: Vec<Placement>,
    lenses: Vec<Lens>,
    points: Vec<Vector3<f64>>,
    lines: Vec<[Vector3<f64>; 2]>,
}

impl World {
    fn new(scene: &Scene) -> Result<Self> {
        let number = |camera: &Value, name: &str| camera[name].as_f64().unwrap_or(1.0);
        let cameras = scene.manifest["cameras"].as_array().ok_or("the manifest has no cameras")?;
        let lenses: BTreeMap<i64, Lens> = cameras
            .iter()
            .map(|camera| {
                let lens = Lens {
                    fx: number(camera, "fx"),
                    fy: number(camera, "fy"),
                    cx: number(camera, "cx"),
                    cy: number(camera, "cy"),
                };
                (camera["camera_id"].as_i64().unwrap_or(-1), lens)
            })
            .collect();
        let lens = |frame: &Exposure| {
            lenses.get(&frame.camera_id).copied().ok_or_else(|| format!("no camera {}", frame.camera_id))
        };
        Ok(Self {
            placements: scene
                .frames
                .iter()
                .map(|frame| Placement::new(frame.position.into(), frame.rotation.into()))
                .collect(),
            lenses: scene.frames.iter().map(lens).collect::<Result<_>>()?,
            points: scene.points.iter().map(|point| point.at.into()).collect(),
            lines: scene.lines.iter().map(|line| [line.start.into(), line.end.into()]).collect(),
        })
    }
}

/// Every table of a scene.
pub(crate) fn expand(scene: &Value) -> Result<Document> {
    let scene: Scene = serde_json::from_value(scene.clone()).map_err(|error| format!("scene: {error}"))?;
    let world = World::new(&scene)?;
    let mut document = Document {
        manifest: scene.manifest.clone(),
        manifest_text: None,
        tables: Vec::new(),
        summaries: Vec::new(),
    };
    let mut add = |name: &str, rows: Vec<Vec<Cell>>| -> Result<()> {
        if name == "frames" || scene.tables.contains(name) {
            document.made(name)?.rows = rows;
        }
        Ok(())
    };
    add("frames", frames(&scene, &world))?;
    add("point_landmarks", point_landmarks(&scene)?)?;
    add("line_landmarks", line_landmarks(&scene, &world))?;
    add("structural_groups", groups(&scene, &world))?;
    let observed = Rows::new(&scene, &world, None);
    let measured = Rows::new(&scene, &world, Some(&scene.noise));
    add("point_observations", observed.points)?;
    add("line_observations", observed.lines)?;
    estimates(&scene, &world, &mut add)?;
    graph(&scene, &world, &measured, &mut add)?;
    add("point_measurements", measured.points)?;
    add("line_measurements", measured.lines)?;
    for name in super::derive::DERIVED {
        add(name, Vec::new())?;
    }
    Ok(document)
}

fn cells<T: Into<Cell> + Copy>(values: &[T]) -> impl Iterator<Item = Cell> {
    values.iter().map(|value| (*value).into())
}

fn ends(segment: [Vector3<f64>; 2]) -> impl Iterator<Item = Cell> {
    segment.into_iter().flat_map(|end| [end.x.into(), end.y.into(), end.z.into()])
}

fn frames(scene: &Scene, world: &World) -> Vec<Vec<Cell>> {
    let rows = scene.frames.iter().zip(&world.placements).map(|(frame, placement)| {
        cells(&[frame.frame_id, frame.stamp_nanos, frame.camera_id])
            .chain(cells(&placement.numbers()))
            .collect()
    });
    rows.collect()
}

fn point_landmarks(scene: &Scene) -> Result<Vec<Vec<Cell>>> {
    let row = |point: &Point| -> Result<Vec<Cell>> {
        let descriptor = match &point.descriptor {
            Some(text) => Cell::Bytes(hexadecimal(text)?),
            None => Cell::Null,
        };
        Ok([point.point_id.into()].into_iter().chain(cells(&point.at)).chain([descriptor]).collect())
    };
    scene.points.iter().map(row).collect()
}

fn line_landmarks(scene: &Scene, world: &World) -> Vec<Vec<Cell>> {
    let rows = scene.lines.iter().zip(&world.lines).map(|(line, segment)| {
        let forms = line_forms(segment[0], segment[1]);
        [line.line_id.into()].into_iter().chain(ends(*segment)).chain(cells(&forms)).collect()
    });
    rows.collect()
}

fn groups(scene: &Scene, world: &World) -> Vec<Vec<Cell>> {
    let direction = |group: &Group| {
        let place = scene.lines.iter().position(|line| group.line_ids.contains(&line.line_id))?;
        let [start, end] = world.lines[place];
        Some((end - start).normalize())
    };
    let rows = scene.groups.iter().map(|group| {
        let direction = direction(group);
        vec![
            group.group_id.into(),
            group.kind.as_str().into(),
            direction.map(|direction| direction.x).into(),
            direction.map(|direction| direction.y).into(),
            direction.map(|direction| direction.z).into(),
            group.line_ids.clone().into(),
        ]
    });
    rows.collect()
}

/// What the frames see, exactly or with noise.
struct Rows {
    points: Vec<Vec<Cell>>,
    lines: Vec<Vec<Cell>>,
}

impl Rows {
    fn new(scene: &Scene, world: &World, noise: Option<&MeasurementNoise>) -> Self {
        let mut draw = Noise::new(noise.map_or(0, |noise| noise.seed));
        let mut show = |[u, v, depth]: [f64; 3]| match noise {
            None => [u, v, depth],
            Some(noise) => [
                u + draw.normal(noise.sigma_px),
                v + draw.normal(noise.sigma_px),
                depth + draw.normal(noise.sigma_depth_m),
            ],
        };
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        for ((frame, placement), lens) in scene.frames.iter().zip(&world.placements).zip(&world.lenses) {
            for (point, at) in scene.points.iter().zip(&world.points) {
                if !scene.hidden_points.contains(&(frame.frame_id, point.point_id)) {
                    let seen = show(placement.project(lens, *at));
                    points.push(cells(&[frame.frame_id, point.point_id]).chain(cells(&seen)).collect());
                }
            }
            for (line, [start, end]) in scene.lines.iter().zip(&world.lines) {
                let start = show(placement.project(lens, *start));
                let end = show(placement.project(lens, *end));
                lines.push(
                    cells(&[frame.frame_id, line.line_id]).chain(cells(&start)).chain(cells(&end)).collect(),
                );
            }
        }
        Self { points, lines }
    }
}

/// Disturbed poses and landmarks.
struct Disturbed {
    draw: Noise,
    sigma_m: f64,
    sigma_rad: f64,
}

impl Disturbed {
    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.draw.normal(sigma), self.draw.normal(sigma), self.draw.normal(sigma))
    }

    fn placement(&mut self, placement: &Placement) -> Placement {
        let (shift, turn) = (self.vector(self.sigma_m), self.vector(self.sigma_rad));
        let turned = Placement::new(Vector3::zeros(), turn).rotation * placement.rotation;
        Placement { position: placement.position + shift, rotation: turned }
    }

    fn point(&mut self, point: &Vector3<f64>) -> Vector3<f64> {
        point + self.vector(self.sigma_m)
    }
}

type Add<'a> = dyn FnMut(&str, Vec<Vec<Cell>>) -> Result<()> + 'a;

fn estimates(scene: &Scene, world: &World, add: &mut Add<'_>) -> Result<()> {
    let (mut poses, mut points, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    let (mut tracking, mut iterations) = (Vec::new(), Vec::new());
    let absent = |covariance: Option<Cell>| covariance.unwrap_or(Cell::Null);
    for estimate in &scene.estimates {
        let mut disturbed = Disturbed {
            draw: Noise::new(estimate.seed),
            sigma_m: estimate.sigma_m,
            sigma_rad: estimate.sigma_rad,
        };
        let key = |id: i64| [Cell::from(estimate.name.as_str()), id.into()].into_iter();
        let (turn, shift) = (estimate.sigma_rad.powi(2), estimate.sigma_m.powi(2));
        for (frame, placement) in scene.frames.iter().zip(&world.placements) {
            let covariance = estimate.map.then(|| diagonal(&[turn, turn, turn, shift, shift, shift]));
            let placed: Vec<Cell> = cells(&disturbed.placement(placement).numbers()).collect();
            poses.push(key(frame.frame_id).chain(placed).chain([absent(covariance)]).collect());
            if !estimate.map {
                let words: [Cell; 6] =
                    ["tracked".into(), 9.into(), 4.into(), 8.into(), 4.into(), Cell::from(0.9)];
                tracking.push(key(frame.frame_id).chain(words).collect());
            }
        }
        if estimate.map {
            for (point, at) in scene.points.iter().zip(&world.points) {
                let at: [f64; 3] = disturbed.point(at).into();
                let covariance = diagonal(&[shift; 3]);
                points.push(key(point.point_id).chain(cells(&at)).chain([covariance]).collect());
            }
            for (line, segment) in scene.lines.iter().zip(&world.lines) {
                let segment = segment.map(|end| disturbed.point(&end));
                lines.push(key(line.line_id).chain(ends(segment)).chain([diagonal(&[shift; 6])]).collect());
            }
            let steps: [[Cell; 6]; 2] = [
                [80.0.into(), Cell::Null, 900.0.into(), Cell::Null, 1e4.into(), true.into()],
                [20.0.into(), 60.0.into(), 0.25.into(), 0.5.into(), 1e4.into(), true.into()],
            ];
            iterations.extend((0..).zip(steps).map(|(step, words)| key(step).chain(words).collect()));
        }
    }
    add("trajectories", poses)?;
    add("map_points", points)?;
    add("map_lines", lines)?;
    add("tracking", tracking)?;
    add("iterations", iterations)
}

/// Upper triangle, row by row, of a diagonal matrix.
fn diagonal(values: &[f64]) -> Cell {
    let size = values.len();
    let entries = (0..size).flat_map(|row| (row..size).map(move |column| (row, column)));
    Cell::from(
        entries.map(|(row, column)| if row == column { values[row] } else { 0.0 }).collect::<Vec<f64>>(),
    )
}

fn graph(scene: &Scene, world: &World, measured: &Rows, add: &mut Add<'_>) -> Result<()> {
    let graph = &scene.graph;
    let mut disturbed =
        Disturbed { draw: Noise::new(graph.seed), sigma_m: graph.sigma_m, sigma_rad: graph.sigma_rad };
    let key = |id: i64| [Cell::from(graph.name.as_str()), id.into()].into_iter();

    let mut poses = Vec::new();
    for (index, (frame, placement)) in scene.frames.iter().zip(&world.placements).enumerate() {
        let placement = if index == 0 { *placement } else { disturbed.placement(placement) };
        poses.push(
            key(frame.frame_id).chain([(index == 0).into()]).chain(cells(&placement.numbers())).collect(),
        );
    }
    let points = scene.points.iter().zip(&world.points).map(|(point, at)| {
        let at: [f64; 3] = disturbed.point(at).into();
        key(point.point_id).chain(cells(&at)).collect()
    });
    let points = points.collect();
    let lines = scene.lines.iter().zip(&world.lines).map(|(line, segment)| {
        let segment = segment.map(|end| disturbed.point(&end));
        key(line.line_id).chain(ends(segment)).collect()
    });
    let lines = lines.collect();

    let mut factors: Vec<Vec<Cell>> = Vec::new();
    let mut factor = |kind: &str, vertices: [Option<i64>; 5], measurement: Vec<Cell>, information: Cell| {
        let number = i64::try_from(factors.len()).unwrap_or(i64::MAX);
        let numbers = Cell::Floats(measurement.iter().map(Cell::float).collect());
        let vertices = vertices.into_iter().map(|vertex| vertex.map_or(Cell::Null, Cell::Int));
        factors
            .push(key(number).chain([kind.into()]).chain(vertices).chain([numbers, information]).collect());
    };
    let weight = |sigma: f64| if sigma > 0.0 { sigma.powi(-2) } else { 1.0 };
    let (pixel, depth) = (weight(scene.noise.sigma_px), weight(scene.noise.sigma_depth_m));
    let in_graph =
        |row: &&Vec<Cell>| row[0].int().is_some_and(|frame| graph.measured_frames.contains(&frame));
    for (index, row) in measured.points.iter().filter(in_graph).enumerate() {
        let vertices = [row[0].int(), None, row[1].int(), None, None];
        // With depth or without, with information or without, by turns.
        let (measurement, information) = match index % 3 {
            0 => (row[2..4].to_vec(), Cell::Null),
            1 => (row[2..4].to_vec(), diagonal(&[pixel; 2])),
            _ => (row[2..5].to_vec(), diagonal(&[pixel, pixel, depth])),
        };
        factor("point-reprojection", vertices, measurement, information);
    }
    for (index, row) in measured.lines.iter().filter(in_graph).enumerate() {
        let vertices = [row[0].int(), None, None, row[1].int(), None];
        let flat = [&row[2..4], &row[5..7]].concat();
        match index % 2 {
            0 => factor("line-reprojection", vertices, flat, diagonal(&[pixel; 4])),
            _ => factor("line-reprojection", vertices, row[2..8].to_vec(), Cell::Null),
        }
    }
    for (frames, placements) in scene.frames.windows(2).zip(world.placements.windows(2)) {
        let between = placements[0].between(&placements[1]).numbers();
        let vertices = [Some(frames[0].frame_id), Some(frames[1].frame_id), None, None, None];
        let information = diagonal(&[1e4, 1e4, 1e4, 1e2, 1e2, 1e2]);
        factor("relative-pose", vertices, cells(&between).collect(), information);
    }
    for group in scene.groups.iter().filter(|group| group.kind == "parallel") {
        for line in &group.line_ids {
            let vertices = [None, None, None, Some(*line), Some(group.group_id)];
            factor("parallelism", vertices, Vec::new(), Cell::Null);
        }
    }
    add("graph_poses", poses)?;
    add("graph_points", points)?;
    add("graph_lines", lines)?;
    add("graph_factors", factors)
}
