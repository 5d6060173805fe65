//! A sequence with rows in every table: one with everything present, one with everything absent that may be.

use open_structure::geometry::Segment;
use open_structure::structure::*;

/// Calls a macro with every table: `name: Row`. A test below holds the list against the code's.
macro_rules! every_table {
    ($callback:ident) => {
        $callback! {
            frames: Frame,
            trajectories: TrajectoryPose,
            point_landmarks: PointLandmark,
            line_landmarks: LineLandmark,
            structural_groups: StructuralGroup,
            map_points: MapPoint,
            map_lines: MapLine,
            point_correspondences: PointCorrespondence,
            line_correspondences: LineCorrespondence,
            graph_poses: GraphPose,
            graph_points: GraphPoint,
            graph_lines: GraphLine,
            graph_factors: GraphFactor,
            frame_statistics: FrameStatistics,
            point_observations: PointObservation,
            line_observations: LineObservation,
            point_measurements: PointMeasurement,
            line_measurements: LineMeasurement,
        }
    };
}
pub(crate) use every_table;

const SEGMENT: Segment =
    Segment { start: nalgebra::Point3::new(1.0, 2.0, 5.0), end: nalgebra::Point3::new(1.0, 4.0, 5.0) };

fn manifest() -> Manifest {
    let text = |text: &str| Some(text.to_owned());
    Manifest {
        name: "sample".to_owned(),
        description: text("rows in every table"),
        source: Source {
            dataset: registry::SIMULATION.to_owned(),
            sequence: text("sample"),
            url: text("https://example.org"),
            licence: text("CC0-1.0"),
            citation: text("nobody"),
            files: vec![SourceFile { name: "a.txt".to_owned(), bytes: 3, sha256: "0".repeat(64) }],
        },
        generator: Generator {
            tool: "spec_sync".to_owned(),
            version: "0.0.0".to_owned(),
            seed: Some(u64::MAX),
            parameters: [("a".to_owned(), "b".to_owned())].into(),
        },
        clock: Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: Some(30.0) },
        cameras: vec![Camera {
            camera_id: CameraId(0),
            model: registry::PINHOLE.to_owned(),
            width: 640,
            height: 480,
            fx: 500.0,
            fy: 500.0,
            cx: 319.5,
            cy: 239.5,
            axes: registry::RIGHT_DOWN_FORWARD.to_owned(),
            pixel_origin: registry::PIXEL_CENTER.to_owned(),
            removed_distortion: Some(Distortion {
                model: "brown-conrady".to_owned(),
                coefficients: vec![0.1, 0.0, 0.0, 0.0, 0.0],
            }),
            depth_min: Some(0.1),
            depth_max: Some(10.0),
        }],
        noise: Some(Noise {
            model: registry::NOISE_GAUSSIAN.to_owned(),
            seed: Some(1),
            parameters: [("sigma_px".to_owned(), 1.0)].into(),
        }),
        recovered: vec![Recovery {
            table: "line_landmarks".to_owned(),
            columns: vec!["start_x".to_owned()],
            rows: 1,
            method: "fitted".to_owned(),
            ids: vec![0],
        }],
        excluded: vec![Exclusion {
            file: "a.txt".to_owned(),
            reason: "not a number".to_owned(),
            count: 1,
            first_line: Some(7),
        }],
        ..Manifest::default()
    }
}

/// The sequence.
pub(crate) fn sample() -> Sequence {
    let pose = PoseRow { translation: [1.0, 2.0, 3.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let (first, second) = (FrameId(0), FrameId(5));
    let (point, line, group) = (PointId(7), LineId(3), GroupId(0));
    let (start, end) = (SEGMENT.start, SEGMENT.end);
    let mut sequence = Sequence { manifest: manifest(), ..Sequence::default() };
    sequence.frames =
        vec![Frame::new(first, 0, CameraId(0), Some(pose)), Frame::new(second, 100, CameraId(0), None)];
    sequence.trajectories = vec![
        TrajectoryPose::new(registry::MAP_TO_FRAME.to_owned(), first, pose),
        TrajectoryPose::new(registry::MAP_TO_FRAME.to_owned(), second, pose),
    ];
    sequence.point_landmarks = vec![
        PointLandmark {
            descriptor: Some(Descriptor(vec![0, 0xab, 0xff])),
            ..PointLandmark::new(point, start)
        },
        PointLandmark::new(PointId(i64::MAX), end),
    ];
    sequence.line_landmarks = vec![LineLandmark::from_segment(line, &SEGMENT).unwrap()];
    sequence.structural_groups = vec![
        StructuralGroup {
            group_id: group,
            kind: registry::PARALLEL.to_owned(),
            direction_x: Some(0.0),
            direction_y: Some(1.0),
            direction_z: Some(0.0),
            line_ids: vec![line],
        },
        StructuralGroup {
            group_id: GroupId(1),
            kind: registry::PARALLEL.to_owned(),
            line_ids: vec![LineId(4)],
            ..StructuralGroup::default()
        },
    ];
    let estimate = registry::MAP_TO_FRAME.to_owned();
    sequence.map_points = vec![MapPoint {
        estimate: estimate.clone(),
        point_id: point,
        x: 1.0,
        y: 2.0,
        z: 5.0,
        covariance: None,
    }];
    sequence.map_lines = vec![MapLine {
        estimate,
        line_id: line,
        start_x: start.x,
        start_y: start.y,
        start_z: start.z,
        end_x: end.x,
        end_y: end.y,
        end_z: end.z,
        covariance: None,
    }];
    sequence.point_observations = vec![
        PointObservation { frame_id: first, point_id: point, u: 419.5, v: 239.5, depth: Some(5.0) },
        PointObservation { frame_id: second, point_id: point, u: 419.5, v: 239.5, depth: None },
    ];
    let segment = |frame_id, depth| LineObservation {
        frame_id,
        line_id: line,
        start_u: 10.0,
        start_v: 20.0,
        start_depth: depth,
        end_u: 30.0,
        end_v: 40.0,
        end_depth: depth,
    };
    sequence.line_observations = vec![segment(first, Some(5.0)), segment(second, None)];
    sequence.point_measurements = sequence
        .point_observations
        .iter()
        .map(|row| PointMeasurement {
            frame_id: row.frame_id,
            point_id: row.point_id,
            u: row.u + 0.5,
            v: row.v,
            depth: row.depth,
        })
        .collect();
    sequence.line_measurements = sequence
        .line_observations
        .iter()
        .map(|row| LineMeasurement {
            frame_id: row.frame_id,
            line_id: row.line_id,
            start_u: row.start_u,
            start_v: row.start_v,
            start_depth: row.start_depth,
            end_u: row.end_u + 0.5,
            end_v: row.end_v,
            end_depth: row.end_depth,
        })
        .collect();
    sequence.point_correspondences = point_correspondences(&sequence.point_measurements, &[]);
    sequence.line_correspondences = line_correspondences(&sequence.line_measurements, &[]);
    let graph = "initial".to_owned();
    sequence.graph_poses = vec![GraphPose::new(graph.clone(), first, true, pose)];
    sequence.graph_points =
        vec![GraphPoint { graph: graph.clone(), point_id: point, x: 1.0, y: 2.0, z: 5.0 }];
    sequence.graph_lines = vec![GraphLine {
        graph: graph.clone(),
        line_id: line,
        start_x: start.x,
        start_y: start.y,
        start_z: start.z,
        end_x: end.x,
        end_y: end.y,
        end_z: end.z,
    }];
    sequence.graph_factors = vec![
        GraphFactor {
            graph: graph.clone(),
            factor_id: 0,
            kind: registry::POINT_REPROJECTION.to_owned(),
            frame_id: Some(first),
            other_frame_id: Some(second),
            point_id: Some(point),
            line_id: Some(line),
            group_id: Some(group),
            measurement: vec![420.0, 239.5],
            information: Some(vec![1.0, 0.0, 1.0]),
        },
        GraphFactor { graph, factor_id: 1, kind: "other".to_owned(), ..GraphFactor::default() },
    ];
    sequence.frame_statistics = frame_statistics(&sequence);
    sequence
}

#[test]
fn the_sample_has_rows_in_every_table_of_the_code() {
    let sequence = sample();
    let mut names = Vec::new();
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            $(
                assert!(!sequence.$name.is_empty(), "{}", stringify!($name));
                names.push(stringify!($name));
            )+
        };
    }
    every_table!(each);
    assert_eq!(names, TABLES.iter().map(|table| table.name).collect::<Vec<_>>());
}
