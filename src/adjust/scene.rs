//! A small room with its measurements, for the tests of this room.

use crate::geometry::{PinholeCamera, Pose, Segment};
use crate::structure::{
    Camera, CameraId, DepthNoise, FactorGraph, FrameId, GraphFactor, GraphLine, GraphPoint, GraphPose,
    GroupId, LineId, MeasurementNoise, PointId, PoseRow, StructuralGroup, registry,
};
use nalgebra::{Point3, UnitQuaternion, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// Draws numbers.
pub(super) struct Draw(ChaCha8Rng);

impl Draw {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }
    /// Uniform in −1 to 1.
    pub(super) fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
    /// Standard normal.
    pub(super) fn normal(&mut self) -> f64 {
        loop {
            let (x, y) = (self.uniform(), self.uniform());
            let s = x * x + y * y;
            if s > 0.0 && s < 1.0 {
                return x * (-2.0 * libm::log(s) / s).sqrt();
            }
        }
    }
    pub(super) fn vector(&mut self, half: f64) -> Vector3<f64> {
        Vector3::new(self.uniform(), self.uniform(), self.uniform()) * half
    }
}

/// What to make.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene {
    pub(super) seed: u64,
    pub(super) frames: usize,
    pub(super) points: usize,
    pub(super) lines: usize,
    /// Noise of pixels and depths, sigma.
    pub(super) sigma_px: f64,
    pub(super) sigma_m: f64,
    /// How far the start is off: radians and metres.
    pub(super) off: f64,
    pub(super) with_depth: bool,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            seed: 1,
            frames: 8,
            points: 30,
            lines: 9,
            sigma_px: 0.0,
            sigma_m: 0.0,
            off: 0.0,
            with_depth: true,
        }
    }
}

impl Scene {
    /// True `world_from_camera` of each frame: on a ring of 5 m, looking inwards.
    pub(super) fn poses(&self) -> Vec<Pose> {
        (0..self.frames)
            .map(|frame| {
                let angle = 0.9 * TAU * frame as f64 / self.frames as f64;
                let centre = Vector3::new(
                    5.0 * libm::cos(angle),
                    5.0 * libm::sin(angle),
                    0.5 * libm::sin(3.0 * angle),
                );
                let forward = -centre.normalize();
                let down = -Vector3::z();
                let right = down.cross(&forward).normalize();
                let axes = nalgebra::Matrix3::from_columns(&[right, forward.cross(&right), forward]);
                let rotation = UnitQuaternion::from_matrix(&axes);
                Pose::new(rotation, centre)
            })
            .collect()
    }

    /// True points.
    pub(super) fn true_points(&self) -> Vec<Point3<f64>> {
        let mut draw = Draw::new(self.seed);
        (0..self.points).map(|_| Point3::from(draw.vector(1.5))).collect()
    }

    /// True segments: three directions at right angles, turned a little from the axes.
    pub(super) fn true_segments(&self) -> Vec<Segment> {
        let mut draw = Draw::new(self.seed + 1000);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.3, 0.4));
        (0..self.lines)
            .map(|line| {
                let along = turn * Vector3::ith_axis(line % 3).into_inner();
                let middle = Point3::from(draw.vector(1.2));
                Segment { start: middle - along * 0.8, end: middle + along * 0.8 }
            })
            .collect()
    }

    /// The camera; its y axis points up in the image.
    pub(super) fn camera() -> PinholeCamera {
        PinholeCamera::new(480.0, -475.0, 319.5, 239.5, 640, 480).unwrap()
    }

    /// The graph: the truth where `off` is zero, measurements with noise.
    pub(super) fn graph(&self) -> FactorGraph {
        let camera = Self::camera();
        let mut draw = Draw::new(self.seed + 2000);
        let mut noise = Draw::new(self.seed + 3000);
        let poses = self.poses();
        let depth = if self.with_depth {
            DepthNoise::Constant { sigma_m: self.sigma_m.max(0.01) }
        } else {
            DepthNoise::Unknown
        };
        let mut graph = FactorGraph {
            name: "initial".to_owned(),
            cameras: vec![Camera::pinhole(CameraId(0), &camera, registry::PIXEL_CENTER)],
            noise: MeasurementNoise {
                sigma_px: self.sigma_px.max(1e-3).max(if self.sigma_px == 0.0 { 1.0 } else { 0.0 }),
                depth,
            },
            ..FactorGraph::default()
        };
        for (frame, pose) in poses.iter().enumerate() {
            let frame_id = FrameId(10 * frame as i64);
            graph.camera_of_frame.insert(frame_id, CameraId(0));
            let step = Vector6::from_fn(|_, _| draw.uniform() * if frame == 0 { 0.0 } else { self.off });
            let start = Pose::exp(&step) * *pose;
            graph.poses.push(GraphPose::new(
                "initial".to_owned(),
                frame_id,
                frame == 0,
                PoseRow::from(&start),
            ));
        }
        for (point, place) in self.true_points().iter().enumerate() {
            let start = place + draw.vector(2.0 * self.off);
            graph.points.push(GraphPoint {
                graph: "initial".to_owned(),
                point_id: PointId(point as i64),
                x: start.x,
                y: start.y,
                z: start.z,
            });
            for (frame, pose) in poses.iter().enumerate() {
                let seen = pose.inverse() * *place;
                let Some(pixel) = camera.project(seen) else { continue };
                let mut measurement =
                    vec![pixel.x + self.sigma_px * noise.normal(), pixel.y + self.sigma_px * noise.normal()];
                let depth = seen.z + self.sigma_m * noise.normal();
                if self.with_depth {
                    measurement.push(depth);
                }
                graph.factors.push(GraphFactor {
                    graph: "initial".to_owned(),
                    factor_id: graph.factors.len() as i64,
                    kind: registry::POINT_REPROJECTION.to_owned(),
                    frame_id: Some(FrameId(10 * frame as i64)),
                    point_id: Some(PointId(point as i64)),
                    measurement,
                    ..GraphFactor::default()
                });
            }
        }
        for (line, segment) in self.true_segments().iter().enumerate() {
            let (start, end) =
                (segment.start + draw.vector(2.0 * self.off), segment.end + draw.vector(2.0 * self.off));
            graph.lines.push(GraphLine {
                graph: "initial".to_owned(),
                line_id: LineId(line as i64),
                start_x: start.x,
                start_y: start.y,
                start_z: start.z,
                end_x: end.x,
                end_y: end.y,
                end_z: end.z,
            });
            for (frame, pose) in poses.iter().enumerate() {
                let mut measurement = Vec::new();
                for end in [segment.start, segment.end] {
                    let seen = pose.inverse() * end;
                    let pixel = camera.project(seen).unwrap();
                    measurement.push(pixel.x + self.sigma_px * noise.normal());
                    measurement.push(pixel.y + self.sigma_px * noise.normal());
                    let depth = seen.z + self.sigma_m * noise.normal();
                    if self.with_depth {
                        measurement.push(depth);
                    }
                }
                graph.factors.push(GraphFactor {
                    graph: "initial".to_owned(),
                    factor_id: graph.factors.len() as i64,
                    kind: registry::LINE_REPROJECTION.to_owned(),
                    frame_id: Some(FrameId(10 * frame as i64)),
                    line_id: Some(LineId(line as i64)),
                    measurement,
                    ..GraphFactor::default()
                });
            }
        }
        for group in 0..3_i64 {
            let line_ids = (0..self.lines as i64).filter(|line| line % 3 == group).map(LineId).collect();
            let kind = registry::PARALLEL.to_owned();
            graph.groups.push(StructuralGroup {
                group_id: GroupId(group),
                kind,
                line_ids,
                ..StructuralGroup::default()
            });
        }
        graph
    }
}
