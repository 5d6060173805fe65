//! Depths for measurements that have none.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3};

use super::super::Random;
use super::NoiseRecipe;
use super::depth::DepthNoise;
use crate::geometry::{PinholeCamera, Pose, Segment, triangulate_point};
use crate::structure::{FrameId, MeasurementNoise, PointId, Sequence};

/// Excess chi-square above which a landmark is not where its rows see it: the validator's, 3 degrees of freedom.
const MOST_EXCESS: f64 = 60.0;
/// Fewer rows say nothing against a landmark.
const LEAST_ROWS: usize = 3;

/// What completing did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompletedDepths {
    /// Points that got a depth.
    pub points: usize,
    /// Ends of lines that got a depth.
    pub line_ends: usize,
    /// Points whose landmark contradicts its rows, or that have none, so that their triangulation was taken.
    pub triangulated: usize,
    /// Measurements that stay without: no true pose, no landmark, behind the camera, or no sensor would give a depth.
    pub without: usize,
}

type View = (PinholeCamera, Pose, Point2<f64>);

impl NoiseRecipe {
    /// Gives measurements without depth one, drawn about the true depth by the recipe's model; everything else stays.
    ///
    /// The first release publishes pixels alone for its points, noisy ones for simulated sequences; its own tracker had
    /// depth with the noise of the release's generator. The true depth is the z of the landmark in the true camera; of a
    /// landmark that contradicts its own rows (excess chi-square over 60, as of `sphere1`) and of one that is missing, that
    /// of the triangulation through the true poses. An end of a segment has the depth of the point of its line that is
    /// nearest to its ray.
    ///
    /// * `sequence` — its measurement tables are changed; sorted by frame.
    ///
    /// What is drawn depends on the seed, the frame and the rows. A depth is not cut to the camera's range.
    pub fn complete_depths(&self, sequence: &mut Sequence, seed: u64) -> CompletedDepths {
        let cameras: BTreeMap<FrameId, (PinholeCamera, Pose)> = sequence
            .frames
            .iter()
            .filter_map(|frame| {
                let camera = sequence.manifest.camera(frame.camera_id)?.projection();
                Some((frame.frame_id, (camera, frame.world_from_camera()?.pose().ok()?.inverse())))
            })
            .collect();
        let mut done = CompletedDepths::default();
        let depth = DepthNoise::new(self);
        if sequence.point_measurements.iter().any(|row| row.depth.is_none()) {
            let sigma_px = MeasurementNoise::declared(&sequence.manifest).sigma_px;
            let points = points(sequence, &cameras, sigma_px, &mut done);
            let mut stream = Stream::new(seed, "noise depths of points");
            for row in &mut sequence.point_measurements {
                let random = stream.of(row.frame_id);
                let truth = points.get(&row.point_id).zip(cameras.get(&row.frame_id));
                let truth = truth.map(|(point, (_, camera_from_world))| (camera_from_world * *point).z);
                let drawn = depth.measure(truth, None, random);
                if row.depth.is_none() {
                    row.depth = drawn;
                    *(if drawn.is_some() { &mut done.points } else { &mut done.without }) += 1;
                }
            }
        }
        let lines: BTreeMap<_, Segment> =
            sequence.line_landmarks.iter().map(|line| (line.line_id, line.segment())).collect();
        let mut stream = Stream::new(seed, "noise depths of lines");
        for row in &mut sequence.line_measurements {
            let random = stream.of(row.frame_id);
            let truth = lines.get(&row.line_id).zip(cameras.get(&row.frame_id));
            let ends = [
                (row.start_u, row.start_v, &mut row.start_depth),
                (row.end_u, row.end_v, &mut row.end_depth),
            ];
            for (u, v, measured) in ends {
                let true_depth = truth.and_then(|(line, (camera, camera_from_world))| {
                    depth_on_line(camera, camera_from_world, line, Point2::new(u, v))
                });
                let drawn = depth.measure(true_depth, Some(0.0), random);
                if measured.is_none() {
                    *measured = drawn;
                    *(if drawn.is_some() { &mut done.line_ends } else { &mut done.without }) += 1;
                }
            }
        }
        done
    }
}

/// The random numbers of one frame after the other.
struct Stream {
    seed: u64,
    purpose: &'static str,
    current: Option<(FrameId, Random)>,
}

impl Stream {
    fn new(seed: u64, purpose: &'static str) -> Self {
        Self { seed, purpose, current: None }
    }

    fn of(&mut self, frame_id: FrameId) -> &mut Random {
        let (seed, purpose) = (self.seed, self.purpose);
        if self.current.as_ref().is_none_or(|(frame, _)| *frame != frame_id) {
            self.current = None;
        }
        let make = || (frame_id, Random::new(seed, purpose, frame_id.0.cast_unsigned()));
        &mut self.current.get_or_insert_with(make).1
    }
}

/// Where each measured point is.
fn points(
    sequence: &Sequence,
    cameras: &BTreeMap<FrameId, (PinholeCamera, Pose)>,
    sigma_px: f64,
    done: &mut CompletedDepths,
) -> BTreeMap<PointId, Point3<f64>> {
    let mut views: BTreeMap<PointId, Vec<View>> = BTreeMap::new();
    for row in &sequence.point_measurements {
        if let Some((camera, camera_from_world)) = cameras.get(&row.frame_id) {
            views.entry(row.point_id).or_default().push((
                *camera,
                *camera_from_world,
                Point2::new(row.u, row.v),
            ));
        }
    }
    let landmarks: BTreeMap<PointId, Point3<f64>> =
        sequence.point_landmarks.iter().map(|row| (row.point_id, Point3::new(row.x, row.y, row.z))).collect();
    let place = |(point_id, views): (&PointId, &Vec<View>)| {
        let landmark = landmarks.get(point_id).copied();
        let found = (views.len() >= LEAST_ROWS || landmark.is_none()).then(|| triangulate_point(views))?;
        let contradicts = |landmark: Point3<f64>| {
            let squares =
                |point: Point3<f64>| -> f64 { views.iter().map(|view| error_px(view, point)).sum() };
            found.is_some_and(|found| {
                squares(landmark) - squares(found.point) > MOST_EXCESS * sigma_px * sigma_px
            })
        };
        match landmark {
            Some(landmark) if !contradicts(landmark) => None,
            _ => found.map(|found| (*point_id, found.point)),
        }
    };
    let triangulated: Vec<(PointId, Point3<f64>)> = views.iter().filter_map(place).collect();
    done.triangulated = triangulated.len();
    let mut all = landmarks;
    all.extend(triangulated);
    all
}

/// Squared distance of a point's image from its pixel; infinite where it has none.
fn error_px((camera, camera_from_world, pixel): &View, point: Point3<f64>) -> f64 {
    camera.project(camera_from_world * point).map_or(f64::INFINITY, |image| (image - pixel).norm_squared())
}

/// The depth of the point of a line that is nearest to the ray of a pixel, metres; `None` where they are parallel.
fn depth_on_line(
    camera: &PinholeCamera,
    camera_from_world: &Pose,
    line: &Segment,
    pixel: Point2<f64>,
) -> Option<f64> {
    let start = (camera_from_world * line.start).coords;
    let along = (camera_from_world * line.end).coords - start;
    let ray = camera.ray(pixel);
    // min |start + s along − t ray|²
    let (a, b, c) = (along.norm_squared(), along.dot(&ray), 1.0);
    let determinant = a * c - b * b;
    if determinant <= 1e-12 * a {
        return None;
    }
    let s = (b * ray.dot(&start) - c * along.dot(&start)) / determinant;
    Some(start.z + s * along.z)
}
