//! A small sequence without a fault: an arc of frames round points and two groups of parallel lines.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::geometry::{PinholeCamera, Pose, Segment};
use crate::structure::*;
use crate::validate::mix::mix;

const CAMERA: PinholeCamera =
    PinholeCamera { fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 };
pub(super) const FRAMES: i64 = 40;
pub(super) const POINTS: i64 = 60;
pub(super) const SIGMA_PX: f64 = 1.0;
pub(super) const SIGMA_DEPTH_M: f64 = 0.05;

/// Normal numbers by Box and Muller, the same ones on every machine.
pub(super) struct Noise(u64);

impl Noise {
    pub(super) fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    fn uniform(&mut self) -> f64 {
        self.0 = mix(self.0);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    pub(super) fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

fn pose(index: i64) -> Pose {
    let angle = 0.6 * (index as f64 / FRAMES as f64 - 0.5);
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::y() * -angle);
    // Looks at (0, 0, 5) from 5 m away.
    let centre = Vector3::new(5.0 * angle.sin(), 0.1 * (3.0 * angle).cos(), 5.0 - 5.0 * angle.cos());
    Pose::new(rotation, centre)
}

fn manifest() -> Manifest {
    Manifest {
        name: "good".to_owned(),
        source: Source {
            dataset: "simulation".to_owned(),
            licence: Some("CC0-1.0".to_owned()),
            citation: Some("none needed".to_owned()),
            ..Source::default()
        },
        cameras: vec![Camera::pinhole(CameraId(0), &CAMERA, registry::PIXEL_CENTER)],
        noise: Some(crate::structure::Noise {
            model: registry::NOISE_GAUSSIAN.to_owned(),
            seed: Some(1),
            parameters: [("sigma_px".to_owned(), SIGMA_PX), ("sigma_depth_m".to_owned(), SIGMA_DEPTH_M)]
                .into(),
        }),
        ..Manifest::default()
    }
}

fn points() -> Vec<PointLandmark> {
    let mut noise = Noise::new(7);
    (0..POINTS)
        .map(|id| {
            let place = Point3::new(noise.uniform() - 0.5, noise.uniform() - 0.5, 4.5 + noise.uniform());
            PointLandmark::new(PointId(id * 3), place)
        })
        .collect()
}

fn lines() -> Vec<LineLandmark> {
    (0..12)
        .map(|id| {
            let offset = f64::from(id / 2);
            let along = if id % 2 == 0 { Vector3::new(1.0, 0.1, 0.2) } else { Vector3::new(0.1, -1.0, 0.3) };
            let start = Point3::new(-0.5 + 0.1 * offset, 0.4 - 0.13 * offset, 4.6 + 0.1 * offset);
            let segment = Segment { start, end: start + along };
            LineLandmark::from_segment(LineId(i64::from(id)), &segment).unwrap()
        })
        .collect()
}

/// The good sequence, noisy measurements and all.
pub(super) fn sequence() -> Sequence {
    noisy(SIGMA_PX, SIGMA_DEPTH_M)
}

/// The good sequence with noise of other sigmas than it declares.
pub(super) fn noisy(sigma_px: f64, sigma_depth: f64) -> Sequence {
    let mut sequence = Sequence { manifest: manifest(), ..Sequence::default() };
    sequence.point_landmarks = points();
    sequence.line_landmarks = lines();
    for (group, first) in [(0, 0), (1, 1)] {
        let line_ids: Vec<LineId> = (first..12).step_by(2).map(LineId).collect();
        let direction = sequence.line_landmarks[group].plucker().direction;
        sequence.structural_groups.push(StructuralGroup {
            group_id: GroupId(first),
            kind: registry::PARALLEL.to_owned(),
            direction_x: Some(direction.x),
            direction_y: Some(direction.y),
            direction_z: Some(direction.z),
            line_ids,
        });
    }
    let mut noise = Noise::new(3);
    for index in 0..FRAMES {
        let world_from_camera = pose(index);
        let frame_id = FrameId(index * 2);
        let stored = PoseRow::from(&world_from_camera);
        sequence.frames.push(Frame::new(frame_id, index * 33_333_333, CameraId(0), Some(stored)));
        for (estimate, shift) in [(registry::FRAME_TO_FRAME, 0.02), (registry::POINT_BA, 0.01)] {
            let mut moved = stored;
            moved.translation[0] += shift;
            sequence.trajectories.push(TrajectoryPose::new(estimate.to_owned(), frame_id, moved));
        }
        observe(&mut sequence, frame_id, &world_from_camera.inverse(), &mut noise, sigma_px, sigma_depth);
    }
    graph(&mut sequence);
    sequence.sort();
    refresh(&mut sequence);
    sequence
}

fn observe(
    sequence: &mut Sequence,
    frame_id: FrameId,
    camera_from_world: &Pose,
    noise: &mut Noise,
    sigma_px: f64,
    sigma_depth: f64,
) {
    for landmark in &sequence.point_landmarks {
        let seen = camera_from_world * landmark.position();
        let pixel = CAMERA.project(seen).unwrap();
        let row = PointObservation {
            frame_id,
            point_id: landmark.point_id,
            u: pixel.x,
            v: pixel.y,
            depth: Some(seen.z),
        };
        sequence.point_measurements.push(PointMeasurement {
            frame_id,
            point_id: row.point_id,
            u: row.u + sigma_px * noise.normal(),
            v: row.v + sigma_px * noise.normal(),
            depth: Some(seen.z + sigma_depth * noise.normal()),
        });
        sequence.point_observations.push(row);
    }
    for landmark in &sequence.line_landmarks {
        let ends = [landmark.segment().start, landmark.segment().end].map(|end| camera_from_world * end);
        let [start, end] = ends.map(|end| CAMERA.project(end).unwrap());
        sequence.line_observations.push(LineObservation {
            frame_id,
            line_id: landmark.line_id,
            start_u: start.x,
            start_v: start.y,
            start_depth: Some(ends[0].z),
            end_u: end.x,
            end_v: end.y,
            end_depth: Some(ends[1].z),
        });
        sequence.line_measurements.push(LineMeasurement {
            frame_id,
            line_id: landmark.line_id,
            start_u: start.x + sigma_px * noise.normal(),
            start_v: start.y + sigma_px * noise.normal(),
            start_depth: Some(ends[0].z + sigma_depth * noise.normal()),
            end_u: end.x + sigma_px * noise.normal(),
            end_v: end.y + sigma_px * noise.normal(),
            end_depth: Some(ends[1].z + sigma_depth * noise.normal()),
        });
    }
}

fn graph(sequence: &mut Sequence) {
    let graph = || "initial".to_owned();
    for frame in &sequence.frames {
        let pose = frame.world_from_camera().unwrap();
        sequence.graph_poses.push(GraphPose::new(graph(), frame.frame_id, frame.frame_id.0 == 0, pose));
    }
    for point in &sequence.point_landmarks {
        let PointLandmark { point_id, x, y, z, .. } = *point;
        sequence.graph_points.push(GraphPoint { graph: graph(), point_id, x, y, z });
    }
    for line in &sequence.line_landmarks {
        let LineLandmark { line_id, start_x, start_y, start_z, end_x, end_y, end_z, .. } = *line;
        let row = GraphLine { graph: graph(), line_id, start_x, start_y, start_z, end_x, end_y, end_z };
        sequence.graph_lines.push(row);
    }
    let mut factors = Vec::new();
    for row in &sequence.point_measurements {
        factors.push(GraphFactor {
            kind: registry::POINT_REPROJECTION.to_owned(),
            frame_id: Some(row.frame_id),
            point_id: Some(row.point_id),
            measurement: vec![row.u, row.v],
            information: Some(vec![1.0, 0.0, 1.0]),
            ..GraphFactor::default()
        });
    }
    for row in &sequence.line_measurements {
        factors.push(GraphFactor {
            kind: registry::LINE_REPROJECTION.to_owned(),
            frame_id: Some(row.frame_id),
            line_id: Some(row.line_id),
            measurement: vec![row.start_u, row.start_v, row.end_u, row.end_v],
            ..GraphFactor::default()
        });
    }
    factors.push(GraphFactor {
        kind: registry::RELATIVE_POSE.to_owned(),
        frame_id: Some(FrameId(0)),
        other_frame_id: Some(FrameId(2)),
        measurement: vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        ..GraphFactor::default()
    });
    factors.push(GraphFactor {
        kind: registry::PARALLELISM.to_owned(),
        line_id: Some(LineId(0)),
        group_id: Some(GroupId(0)),
        ..GraphFactor::default()
    });
    for (factor_id, factor) in (0..).zip(factors) {
        sequence.graph_factors.push(GraphFactor { graph: graph(), factor_id, ..factor });
    }
}

/// Makes again what is computed from the rest.
pub(super) fn refresh(sequence: &mut Sequence) {
    sequence.point_correspondences =
        point_correspondences(&sequence.point_measurements, &sequence.point_observations);
    sequence.line_correspondences =
        line_correspondences(&sequence.line_measurements, &sequence.line_observations);
    sequence.frame_statistics = frame_statistics(sequence);
}
