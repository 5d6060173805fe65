//! Both encodings give back what was written, bit by bit.

use open_structure::format::{self, Encoding, WriteOptions};
use open_structure::structure::*;

fn sample() -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "sample".to_owned();
    let pose = PoseRow { translation: [1.0, 2.0, 3.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    for id in 0..5 {
        sequence.frames.push(Frame::new(FrameId(id * 3), id * 100, CameraId(0), (id != 2).then_some(pose)));
        for point in 0..id {
            sequence.point_measurements.push(PointMeasurement {
                frame_id: FrameId(id * 3),
                point_id: PointId(point),
                u: 0.1 * point as f64,
                v: f64::MIN_POSITIVE,
                depth: (point % 2 == 0).then_some(-0.0),
            });
        }
    }
    sequence.point_landmarks.push(PointLandmark {
        point_id: PointId(i64::MAX),
        x: f64::MAX,
        y: 5e-324,
        z: -0.0,
        descriptor: Some(Descriptor(vec![0, 255])),
    });
    sequence.structural_groups.push(StructuralGroup {
        group_id: GroupId(1),
        kind: "parallel".into(),
        direction_x: None,
        direction_y: Some(1.0),
        direction_z: None,
        line_ids: vec![LineId(1), LineId(4)],
    });
    sequence.graph_factors.push(GraphFactor {
        graph: "g".into(),
        factor_id: 0,
        kind: "point-reprojection".into(),
        frame_id: Some(FrameId(3)),
        measurement: vec![1.0, 2.0],
        information: None,
        ..GraphFactor::default()
    });
    sequence.graph_factors.push(GraphFactor {
        graph: "g".into(),
        factor_id: 1,
        kind: "x".into(),
        measurement: vec![],
        information: Some(vec![]),
        ..GraphFactor::default()
    });
    sequence.graph_poses.push(GraphPose::new("g".into(), FrameId(3), true, pose));
    sequence.point_correspondences = point_correspondences(&sequence.point_measurements, &[]);
    sequence.frame_statistics = frame_statistics(&sequence);
    sequence
}

#[test]
fn both_encodings_give_back_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = sample();
    for name in ["a.mcap", "b"] {
        let path = folder.path().join(name);
        let written = format::write(&path, &sequence, WriteOptions::default()).unwrap();
        let reader = format::open(&path).unwrap();
        assert_eq!(reader.encoding(), Encoding::of_output(&path));
        let back = reader.read_all().unwrap();
        assert_eq!(back.manifest.tables, written.tables);
        let stripped = Sequence { manifest: sequence.manifest.clone(), ..back.clone() };
        assert_eq!(stripped, sequence);
        let frames: Vec<_> = reader.frames().unwrap().collect::<Result<_, _>>().unwrap();
        assert_eq!(frames.len(), 5);
        for frame in &frames {
            assert_eq!(reader.frame(frame.frame.frame_id).unwrap().as_ref(), Some(frame));
        }
        assert_eq!(
            frames.iter().flat_map(|f| f.point_measurements.clone()).collect::<Vec<_>>(),
            sequence.point_measurements
        );
        reader.verify_container().unwrap();
    }
}
