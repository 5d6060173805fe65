//! Both encodings give back what was written, bit by bit.

mod arbitrary;

use std::fs;
use std::path::Path;

use arbitrary::{bytes_of, bytes_of_rows, catalogues, sequences};
use open_structure::format::{self, Encoding, WriteOptions};
use open_structure::structure::*;
use proptest::prelude::*;

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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_catalogue_gives_back_what_was_written(rows in catalogues()) {
        let folder = tempfile::tempdir().unwrap();
        format::write_catalogue(folder.path(), &rows, false).unwrap();
        let read = format::read_catalogue(folder.path()).unwrap();
        prop_assert_eq!(bytes_of_rows(&read), bytes_of_rows(&rows));
    }
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

/// Writes under a name and reads everything back.
fn written_and_read(path: &Path, sequence: &Sequence) -> (format::Written, Sequence) {
    let written = format::write(path, sequence, WriteOptions::default()).unwrap();
    (written, format::read(path).unwrap())
}

/// The files of an output by name, and what is in them.
fn files(path: &Path) -> Vec<(String, Vec<u8>)> {
    if path.is_file() {
        return vec![(String::new(), fs::read(path).unwrap())];
    }
    let mut files: Vec<_> = fs::read_dir(path)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn a_table_of_several_row_groups_comes_back_in_order_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sequence");
    let rows = 2 * (1 << 18) + 5;
    let row = |id| PointLandmark { point_id: PointId(id), x: id as f64, ..Default::default() };
    let sequence = Sequence { point_landmarks: (0..rows).map(row).collect(), ..Sequence::default() };
    format::write(&path, &sequence, WriteOptions::default()).unwrap();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let read = pool.install(|| format::open(&path).unwrap().table::<PointLandmark>().unwrap());
        assert!(read == sequence.point_landmarks, "{threads} threads");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]

    /// Any rows of any table go through MCAP and from there through Parquet, and every bit comes back.
    #[test]
    fn any_sequence_goes_through_both_encodings_bit_by_bit(sequence in sequences()) {
        let folder = tempfile::tempdir().unwrap();
        let (mcap, from_mcap) = written_and_read(&folder.path().join("a.mcap"), &sequence);
        prop_assert_eq!(bytes_of(&from_mcap), bytes_of(&sequence));
        let (parquet, from_parquet) = written_and_read(&folder.path().join("b"), &from_mcap);
        prop_assert_eq!(bytes_of(&from_parquet), bytes_of(&sequence));

        // The digests are of the rows, not of how they are stored.
        prop_assert_eq!(&mcap.tables, &parquet.tables);
        prop_assert_eq!(&from_mcap.manifest.tables, &mcap.tables);
        let manifest = Manifest { tables: Vec::new(), ..from_parquet.manifest };
        prop_assert_eq!(manifest, sequence.manifest);
    }

    /// Frame after frame, and each frame by its id, come the rows of the tables, in their order.
    #[test]
    fn frames_hold_the_rows_of_the_tables(sequence in sequences()) {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.mcap", "b"] {
            let path = folder.path().join(name);
            format::write(&path, &sequence, WriteOptions::default()).unwrap();
            let reader = format::open(&path).unwrap();
            let mut joined = Sequence { ..sequence.clone() };
            joined.point_observations.clear();
            joined.line_observations.clear();
            joined.point_measurements.clear();
            joined.line_measurements.clear();
            let mut alone = joined.clone();
            let mut frames = Vec::new();
            for bundle in reader.frames().unwrap() {
                let mut bundle = bundle.unwrap();
                let mut by_id = reader.frame(bundle.frame.frame_id).unwrap().unwrap();
                for (all, bundle) in [(&mut joined, &mut bundle), (&mut alone, &mut by_id)] {
                    all.point_observations.append(&mut bundle.point_observations);
                    all.line_observations.append(&mut bundle.line_observations);
                    all.point_measurements.append(&mut bundle.point_measurements);
                    all.line_measurements.append(&mut bundle.line_measurements);
                }
                frames.push(bundle.frame);
            }
            joined.frames.clone_from(&frames);
            alone.frames = frames;
            prop_assert_eq!(bytes_of(&joined), bytes_of(&sequence), "{}", name);
            prop_assert_eq!(bytes_of(&alone), bytes_of(&sequence), "{}", name);
        }
    }

    /// Whoever writes the same sequence writes the same bytes.
    #[test]
    fn the_same_sequence_gives_the_same_bytes(sequence in sequences()) {
        let folder = tempfile::tempdir().unwrap();
        for (first, second) in [("a.mcap", "b.mcap"), ("a", "b")] {
            let (first, second) = (folder.path().join(first), folder.path().join(second));
            format::write(&first, &sequence, WriteOptions::default()).unwrap();
            format::write(&second, &sequence, WriteOptions::default()).unwrap();
            prop_assert!(files(&first) == files(&second), "{}", first.display());
        }
    }
}

/// Row groups, messages and pages end where they are full; what lies across their ends is whole too.
#[test]
fn tables_longer_than_a_row_group_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut sequence = Sequence::default();
    let mut random = arbitrary::Random::new(7);
    for id in 0..40 {
        sequence.frames.push(Frame::new(FrameId(id), id * 1000, CameraId(0), None));
        for point in 0..8000 {
            sequence.point_measurements.push(PointMeasurement {
                frame_id: FrameId(id),
                point_id: PointId(point * 3),
                // Decimal at first, noisy later: the layout of the columns changes on the way.
                u: if id < 20 { (point % 640) as f64 + 0.25 } else { f64::from_bits(random.next() >> 2) },
                v: random.float(),
                depth: (point % 5 != 0).then(|| random.float()),
            });
        }
    }
    let expected = bytes_of(&sequence);
    for name in ["a.mcap", "b"] {
        let path = folder.path().join(name);
        let (_, back) = written_and_read(&path, &sequence);
        assert!(bytes_of(&back) == expected, "{name}: other rows come back");
        let frame = format::open(&path).unwrap().frame(FrameId(33)).unwrap().unwrap();
        let rows = &sequence.point_measurements[33 * 8000..34 * 8000];
        let digest = |rows: &[PointMeasurement]| {
            let mut digest = ContentDigest::default();
            digest.update(rows);
            digest.finish()
        };
        assert_eq!(digest(&frame.point_measurements), digest(rows), "{name}");
    }
}
