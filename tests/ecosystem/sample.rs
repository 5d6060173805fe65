//! A small but complete sequence: every table, two cameras, frames that lack one thing or another.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::structure::*;

/// Two cameras with y down.
pub(crate) const CAMERAS: [PinholeCamera; 2] = [
    PinholeCamera { fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 },
    PinholeCamera { fx: 320.0, fy: 320.0, cx: 320.0, cy: 240.0, width: 640, height: 480 },
];
/// Two cameras with y up, as ICL-NUIM has them.
pub(crate) const MIRRORED_CAMERAS: [PinholeCamera; 2] = [
    PinholeCamera { fx: 481.2, fy: -480.0, cx: 319.5, cy: 239.5, width: 640, height: 480 },
    PinholeCamera { fx: 320.0, fy: -320.0, cx: 320.0, cy: 240.0, width: 640, height: 480 },
];

/// Frames; the last is seen without noise only.
const FRAMES: i64 = 8;
/// The frame that shows nothing.
const EMPTY_FRAME: i64 = 3;
/// The frame whose true pose is not known.
const LOST_FRAME: i64 = 5;
/// Time of the first frame; an odd number, so that a float would not hold it.
const FIRST_STAMP: i64 = 1_341_846_313_592_026_001;

/// A number in −1..1 that depends on its arguments alone.
fn scatter(index: i64, salt: f64) -> f64 {
    (index as f64 * 12.9898 + salt * 78.233).sin()
}

fn true_pose(frame: i64) -> Pose {
    let time = frame as f64;
    let rotation = UnitQuaternion::from_euler_angles(0.02 * time, -0.03 * time, 0.01 * time);
    Pose::new(rotation, Vector3::new(0.05 * time, -0.02 * time, 0.1 * time - 0.3))
}

/// Ids with gaps, some beyond what 32 bits or a float hold.
fn point_id(index: i64) -> PointId {
    PointId(if index == 11 { (1 << 53) + 1 } else { index * index })
}

fn points() -> Vec<PointLandmark> {
    (0..12)
        .map(|index| {
            let at = [1.0, 2.0, 3.0].map(|salt| scatter(index, salt));
            PointLandmark {
                point_id: point_id(index),
                x: at[0],
                y: 0.6 * at[1],
                z: 4.0 + at[2],
                descriptor: (index % 3 == 0).then(|| Descriptor(vec![0, 255, u8::try_from(index).unwrap()])),
            }
        })
        .collect()
}

/// Two groups of parallel lines and one line of no group.
fn lines() -> Vec<LineLandmark> {
    let (along_x, along_y, slanted) = (Vector3::x(), Vector3::y() * 0.7, Vector3::new(0.5, 0.3, 0.2));
    [(10, along_x), (11, -along_x), (12, along_y), (13, along_y), (20, slanted)]
        .into_iter()
        .map(|(id, direction)| {
            let middle = Point3::new(0.4 * scatter(id, 4.0), 0.3 * scatter(id, 5.0), 4.0 + scatter(id, 6.0));
            let segment = Segment { start: middle - direction / 2.0, end: middle + direction / 2.0 };
            LineLandmark::from_segment(LineId(id), &segment).unwrap()
        })
        .collect()
}

fn group(id: i64, direction: Vector3<f64>, lines: &[i64]) -> StructuralGroup {
    StructuralGroup {
        group_id: GroupId(id),
        kind: registry::PARALLEL.to_owned(),
        direction_x: Some(direction.x),
        direction_y: Some(direction.y),
        direction_z: Some(direction.z),
        line_ids: lines.iter().map(|line| LineId(*line)).collect(),
    }
}

fn manifest(cameras: [PinholeCamera; 2]) -> Manifest {
    let origins = [registry::PIXEL_CENTER, registry::PIXEL_CORNER];
    let cameras = (0..)
        .zip(cameras)
        .zip(origins)
        .map(|((id, camera), origin)| Camera::pinhole(CameraId(id), &camera, origin));
    let mut manifest =
        Manifest { name: "sample".to_owned(), cameras: cameras.collect(), ..Manifest::default() };
    manifest.source.dataset = "simulation".into();
    manifest.source.url = Some("https://example.org/sample".to_owned());
    manifest.source.licence = Some("CC-BY-4.0".to_owned());
    manifest.source.citation = Some("A sample, \"quoted\", 2026".to_owned());
    manifest.generator =
        Generator { tool: "test".to_owned(), version: "1".to_owned(), ..Generator::default() };
    manifest.clock.kind = registry::RECORDED.into();
    manifest.noise = Some(Noise {
        model: registry::NOISE_GAUSSIAN.to_owned(),
        seed: None,
        parameters: [("sigma_px".to_owned(), 1.0)].into(),
    });
    manifest
}

fn observe(sequence: &mut Sequence, frame: &Frame) {
    let camera = sequence.camera(frame.camera_id).unwrap().projection();
    let camera_from_world = true_pose(frame.frame_id.0).inverse();
    let pixel = |point: Point3<f64>| {
        let in_camera = camera_from_world * point;
        let pixel = camera.project(in_camera).unwrap();
        assert!(camera.contains(pixel, 0.0), "the scene lies in every image");
        (pixel.x, pixel.y, Some(in_camera.z))
    };
    for point in &sequence.point_landmarks {
        let (u, v, depth) = pixel(point.position());
        let row = PointObservation { frame_id: frame.frame_id, point_id: point.point_id, u, v, depth };
        sequence.point_observations.push(row);
    }
    // Line 13 is never seen.
    for line in sequence.line_landmarks.iter().filter(|line| line.line_id != LineId(13)) {
        let ((start_u, start_v, start_depth), (end_u, end_v, end_depth)) =
            (pixel(line.segment().start), pixel(line.segment().end));
        sequence.line_observations.push(LineObservation {
            frame_id: frame.frame_id,
            line_id: line.line_id,
            start_u,
            start_v,
            start_depth,
            end_u,
            end_v,
            end_depth,
        });
    }
}

/// Moves every observation a little; the last frame is not measured.
fn measure(sequence: &mut Sequence) {
    let noise = |row: usize, salt: f64| 0.7 * scatter(i64::try_from(row).unwrap(), salt);
    for (row, seen) in sequence.point_observations.iter().enumerate() {
        if seen.frame_id.0 != FRAMES - 1 {
            sequence.point_measurements.push(PointMeasurement {
                frame_id: seen.frame_id,
                point_id: seen.point_id,
                u: seen.u + noise(row, 7.0),
                v: seen.v + noise(row, 8.0),
                depth: seen.depth.filter(|_| row % 4 != 0),
            });
        }
    }
    for (row, seen) in sequence.line_observations.iter().enumerate() {
        if seen.frame_id.0 != FRAMES - 1 {
            // The ends are swapped: their order means nothing.
            sequence.line_measurements.push(LineMeasurement {
                frame_id: seen.frame_id,
                line_id: seen.line_id,
                start_u: seen.end_u + noise(row, 9.0),
                start_v: seen.end_v,
                start_depth: None,
                end_u: seen.start_u,
                end_v: seen.start_v + noise(row, 10.0),
                end_depth: seen.start_depth,
            });
        }
    }
}

fn estimate(sequence: &mut Sequence) {
    for name in [registry::MAP_TO_FRAME, registry::POINT_BA] {
        let off = if name == registry::POINT_BA { 1e-3 } else { 1e-2 };
        for frame in &sequence.frames {
            let moved = Pose::new(UnitQuaternion::identity(), Vector3::new(off, 0.0, 0.0));
            let pose = PoseRow::from(&(moved * true_pose(frame.frame_id.0)));
            sequence.trajectories.push(TrajectoryPose::new(name.to_owned(), frame.frame_id, pose));
        }
        sequence.map_points.extend(sequence.point_landmarks.iter().map(|point| MapPoint {
            estimate: name.to_owned(),
            point_id: point.point_id,
            x: point.x + off,
            y: point.y,
            z: point.z,
            covariance: (point.point_id.0 % 2 == 0).then(|| vec![1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]),
        }));
    }
    sequence.tracking.extend(sequence.frames.iter().map(|frame| TrackedFrame {
        estimate: registry::MAP_TO_FRAME.to_owned(),
        frame_id: frame.frame_id,
        state: if frame.frame_id.0 == 0 { registry::GAUGE } else { registry::TRACKED }.to_owned(),
        points: 7,
        lines: 2,
        point_inliers: 6,
        line_inliers: 2,
        residual_rms: (frame.frame_id.0 > 0).then_some(0.75),
    }));
    sequence.iterations.extend((0..3_i32).map(|step| Iteration {
        estimate: registry::POINT_BA.to_owned(),
        iteration: step.into(),
        cost: 0.5_f64.powi(step),
        cost_change: (step > 0).then_some(0.5_f64.powi(step)),
        gradient_max: 1e-3,
        step_norm: (step > 0).then_some(0.25),
        damping: 1e4,
        accepted: true,
    }));
    sequence.map_lines.extend(sequence.line_landmarks.iter().map(|line| MapLine {
        estimate: "unrefined".to_owned(),
        line_id: line.line_id,
        start_x: line.start_x,
        start_y: line.start_y,
        start_z: line.start_z,
        end_x: line.end_x,
        end_y: line.end_y,
        end_z: line.end_z + 0.01,
        covariance: None,
    }));
}

fn graph(sequence: &mut Sequence) {
    let name = || "initial".to_owned();
    for row in sequence.trajectories.iter().filter(|row| row.estimate == registry::MAP_TO_FRAME) {
        let fixed = row.frame_id.0 == 0;
        sequence.graph_poses.push(GraphPose::new(name(), row.frame_id, fixed, row.world_from_camera()));
    }
    sequence.graph_points.extend(sequence.point_landmarks.iter().map(|point| GraphPoint {
        graph: name(),
        point_id: point.point_id,
        x: point.x,
        y: point.y,
        z: point.z,
    }));
    sequence.graph_lines.extend(sequence.line_landmarks.iter().map(|line| GraphLine {
        graph: name(),
        line_id: line.line_id,
        start_x: line.start_x,
        start_y: line.start_y,
        start_z: line.start_z,
        end_x: line.end_x,
        end_y: line.end_y,
        end_z: line.end_z,
    }));
    let mut factors: Vec<GraphFactor> = sequence
        .point_measurements
        .iter()
        .map(|row| GraphFactor {
            kind: registry::POINT_REPROJECTION.to_owned(),
            frame_id: Some(row.frame_id),
            point_id: Some(row.point_id),
            measurement: vec![row.u, row.v],
            information: Some(vec![1.0, 0.0, 1.0]),
            ..GraphFactor::default()
        })
        .collect();
    factors.push(GraphFactor {
        kind: registry::RELATIVE_POSE.to_owned(),
        frame_id: Some(FrameId(0)),
        other_frame_id: Some(FrameId(1)),
        measurement: vec![0.05, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0],
        ..GraphFactor::default()
    });
    factors.push(GraphFactor {
        kind: registry::PARALLELISM.to_owned(),
        line_id: Some(LineId(10)),
        group_id: Some(GroupId(0)),
        ..GraphFactor::default()
    });
    sequence.graph_factors = (0..)
        .zip(factors)
        .map(|(factor_id, factor)| GraphFactor { graph: name(), factor_id, ..factor })
        .collect();
}

/// The sequence, as the given cameras see it in turn.
pub(crate) fn sequence(cameras: [PinholeCamera; 2]) -> Sequence {
    let mut sequence = Sequence {
        manifest: manifest(cameras),
        point_landmarks: points(),
        line_landmarks: lines(),
        structural_groups: vec![group(0, Vector3::x(), &[10, 11]), group(5, Vector3::y(), &[12, 13])],
        ..Sequence::default()
    };
    for id in 0..FRAMES {
        let pose = (id != LOST_FRAME).then(|| PoseRow::from(&true_pose(id)));
        let frame = Frame::new(FrameId(id), FIRST_STAMP + id * 33_333_333, CameraId(id % 2), pose);
        if id != EMPTY_FRAME {
            observe(&mut sequence, &frame);
        }
        sequence.frames.push(frame);
    }
    sequence.sort();
    measure(&mut sequence);
    estimate(&mut sequence);
    graph(&mut sequence);
    sequence.point_correspondences =
        point_correspondences(&sequence.point_measurements, &sequence.point_observations);
    sequence.line_correspondences =
        line_correspondences(&sequence.line_measurements, &sequence.line_observations);
    sequence.frame_statistics = frame_statistics(&sequence);
    sequence.sort();
    sequence
}
