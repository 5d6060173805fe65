//! The shapes of a scene in the plane of a picture, and how they are fitted into it.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::chart::Area;
use super::scene::Scene;
use super::view::Plane;
use crate::structure::{Camera, Frame, LineId, StructuralGroup};

/// Most points, lines and places of the path that are drawn: what is drawn keeps its shape, the file stays small.
const MOST_POINTS: usize = 20_000;
const MOST_LINES: usize = 10_000;
const MOST_PLACES: usize = 4000;
/// Cameras that are drawn along the path.
const CAMERAS: usize = 14;
/// Farther outside than this a shape is left out, units of the picture.
const FARTHEST: f64 = 1e4;

/// The shapes of a scene in the plane of the picture, metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shapes {
    pub(super) dots: Vec<[f64; 2]>,
    pub(super) lines: Vec<(LineId, [[f64; 2]; 2])>,
    pub(super) edges: Vec<[[f64; 2]; 2]>,
    pub(super) path: Vec<[f64; 2]>,
    pub(super) axes: [[f64; 2]; 3],
    /// Some cameras: where each is, and the ways from there to the corners of its image one metre before it.
    cameras: Vec<([f64; 2], [[f64; 2]; 4])>,
}

/// Every n-th of a list, so that at most `most` are left.
pub(super) fn thinned<T>(list: &[T], most: usize) -> impl Iterator<Item = &T> {
    list.iter().step_by(list.len().div_ceil(most).max(1))
}

/// Groups, the largest first, and the rank of each line's group.
pub(super) fn ranked(groups: &[StructuralGroup]) -> (Vec<&StructuralGroup>, BTreeMap<LineId, usize>) {
    let mut largest: Vec<&StructuralGroup> = groups.iter().collect();
    largest.sort_by_key(|group| (std::cmp::Reverse(group.line_ids.len()), group.group_id));
    let mut rank_of = BTreeMap::new();
    for (rank, group) in largest.iter().enumerate() {
        for line in &group.line_ids {
            rank_of.entry(*line).or_insert(rank);
        }
    }
    (largest, rank_of)
}

/// The longest round length that is not longer than some metres; `None` where numbers end.
pub(super) fn round_length(metres: f64) -> Option<f64> {
    let power = libm::pow(10.0, libm::floor(libm::log10(metres)));
    let round = [5.0, 2.0, 1.0].into_iter().find(|part| part * power <= metres).unwrap_or(1.0) * power;
    (round.is_finite() && round > 0.0).then_some(round)
}

/// A length in words.
pub(super) fn metres_in_words(metres: f64) -> String {
    if (1e-3..1e5).contains(&metres) { format!("{metres} m") } else { format!("{metres:e} m") }
}

impl Shapes {
    pub(super) fn of(scene: &Scene<'_>, plane: &Plane) -> Self {
        let points = thinned(scene.points, MOST_POINTS);
        let lines = thinned(scene.lines, MOST_LINES);
        let poses = thinned(scene.frames, MOST_PLACES).filter_map(Frame::world_from_camera);
        Self {
            dots: points.filter_map(|point| plane.place(Vector3::new(point.x, point.y, point.z))).collect(),
            lines: lines
                .filter_map(|line| {
                    let start = plane.place(Vector3::new(line.start_x, line.start_y, line.start_z))?;
                    let end = plane.place(Vector3::new(line.end_x, line.end_y, line.end_z))?;
                    Some((line.line_id, [start, end]))
                })
                .collect(),
            edges: thinned(scene.edges, MOST_LINES)
                .filter_map(|[start, end]| Some([plane.place(start.coords)?, plane.place(end.coords)?]))
                .collect(),
            path: poses.filter_map(|pose| plane.place(Vector3::from(pose.translation))).collect(),
            axes: [0, 1, 2].map(|axis| [plane.right[axis], plane.up[axis]]),
            cameras: cameras(scene, plane),
        }
    }

    /// Left lower and right upper corner of what the picture is fitted to: the middle 99 % of the points, all lines and the path.
    pub(super) fn bounds(&self) -> Option<[[f64; 2]; 2]> {
        let mut bounds = [[0.0; 2]; 2];
        for axis in 0..2 {
            let mut dots: Vec<f64> = self.dots.iter().map(|dot| dot[axis]).collect();
            dots.sort_unstable_by(f64::total_cmp);
            let stray = dots.len() / 200;
            let inner = dots.get(stray..dots.len() - stray).unwrap_or_default();
            let ends =
                self.lines.iter().flat_map(|(_, ends)| ends).chain(&self.path).map(|place| place[axis]);
            let all = || inner.first().into_iter().chain(inner.last()).copied().chain(ends.clone());
            let (low, high) = (all().min_by(f64::total_cmp)?, all().max_by(f64::total_cmp)?);
            (bounds[0][axis], bounds[1][axis]) = (low, high);
        }
        Some(bounds)
    }

    /// Strokes of some cameras along the path, as the pyramids of what they see.
    ///
    /// Smaller where the path is short in the picture, so that cameras do not hide each other.
    ///
    /// * `sizes` — least and largest length of a pyramid, units of the picture.
    pub(super) fn camera_strokes(&self, fit: &Fit, sizes: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
        let spread = |axis: usize| {
            let places = || self.path.iter().map(|place| place[axis]);
            let (low, high) =
                places().fold((f64::MAX, f64::MIN), |(low, high), place| (low.min(place), high.max(place)));
            (high - low).max(0.0)
        };
        let size = (0.11 * (spread(0) + spread(1)) * fit.scale).clamp(sizes[0], sizes[1]);
        let depth = size / fit.scale;
        let mut strokes = Vec::new();
        for (apex, corners) in &self.cameras {
            let at = |way: &[f64; 2]| fit.place([apex[0] + depth * way[0], apex[1] + depth * way[1]]);
            let corners = [at(&corners[0]), at(&corners[1]), at(&corners[2]), at(&corners[3])];
            let (Some(apex), [Some(a), Some(b), Some(c), Some(d)]) = (fit.place(*apex), corners) else {
                continue;
            };
            strokes.push(vec![a, b, c, d, a, apex, b]);
            strokes.push(vec![c, apex, d]);
        }
        strokes
    }
}

fn cameras(scene: &Scene<'_>, plane: &Plane) -> Vec<([f64; 2], [[f64; 2]; 4])> {
    let posed: Vec<&Frame> =
        scene.frames.iter().filter(|frame| frame.world_from_camera().is_some()).collect();
    let mut found = Vec::new();
    for frame in thinned(&posed, CAMERAS) {
        let Some(Ok(pose)) = frame.world_from_camera().map(|pose| pose.pose()) else { continue };
        let camera = scene.manifest.camera(frame.camera_id).map(Camera::projection);
        let (half_width, half_height) = camera.map_or((0.6, 0.45), |camera| {
            let half = |size: u32, focal: f64| (0.5 * f64::from(size) / focal.abs()).clamp(0.1, 1.5);
            (half(camera.width, camera.fx), half(camera.height, camera.fy))
        });
        let way = |x: f64, y: f64| {
            plane.place(pose.transform_vector(&Vector3::new(x * half_width, y * half_height, 1.0)))
        };
        let corners = [way(-1.0, -1.0), way(1.0, -1.0), way(1.0, 1.0), way(-1.0, 1.0)];
        let (Some(apex), [Some(a), Some(b), Some(c), Some(d)]) = (plane.place(pose.translation()), corners)
        else {
            continue;
        };
        found.push((apex, [a, b, c, d]));
    }
    found
}

/// The way from the plane to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    middle: [f64; 2],
    centre: [f64; 2],
    /// Units of the picture for a metre.
    pub(super) scale: f64,
}

impl Fit {
    /// `None` when there is nothing to fit.
    ///
    /// * `room` — where in the picture the shapes shall be.
    pub(super) fn new(shapes: &Shapes, room: Area) -> Option<Self> {
        let [low, high] = shapes.bounds()?;
        let lengths = [room.width, room.height];
        let scale = (0..2).map(|axis| lengths[axis] / (high[axis] - low[axis])).fold(f64::MAX, f64::min);
        let scale = if scale.is_finite() && scale > 0.0 { scale.min(1e6) } else { 1.0 };
        Some(Self {
            middle: [0, 1].map(|axis| 0.5 * low[axis] + 0.5 * high[axis]),
            centre: [room.left + 0.5 * room.width, room.top + 0.5 * room.height],
            scale,
        })
    }

    /// Where a place of the plane is in the picture; `None` far outside.
    pub(super) fn place(&self, [right, up]: [f64; 2]) -> Option<[f64; 2]> {
        let x = self.centre[0] + (right - self.middle[0]) * self.scale;
        let y = self.centre[1] - (up - self.middle[1]) * self.scale;
        (x.abs() < FARTHEST && y.abs() < FARTHEST).then_some([x, y])
    }
}
