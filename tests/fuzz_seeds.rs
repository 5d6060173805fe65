//! The seeds of the fuzz targets are whole files; `UPDATE_SEEDS=1` writes them anew.

use std::fs;
use std::path::{Path, PathBuf};

use open_structure::format::{self, WriteOptions};
use open_structure::structure::*;
use open_structure_converters::text_release::{BareLine, FileProblems, parse};

fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(target)
}

/// One or two rows of each kind of column.
fn sequence() -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "seed".to_owned();
    for id in 0..3 {
        let pose = PoseRow { translation: [0.0, 1.0, 2.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        let frame_id = FrameId(id);
        sequence.frames.push(Frame::new(frame_id, id * 1000, CameraId(0), (id != 1).then_some(pose)));
        sequence.graph_poses.push(GraphPose::new("initial".to_owned(), frame_id, id == 0, pose));
        for point in 0..3_u32 {
            sequence.point_measurements.push(PointMeasurement {
                frame_id,
                point_id: PointId(i64::from(point)),
                u: 10.5 * f64::from(point),
                v: 0.1,
                depth: (point > 0).then_some(2.25),
            });
        }
    }
    sequence.point_landmarks.push(PointLandmark {
        point_id: PointId(0),
        descriptor: Some(Descriptor(vec![1, 2, 3])),
        ..PointLandmark::default()
    });
    sequence.graph_factors.push(GraphFactor {
        graph: "initial".to_owned(),
        kind: "point-reprojection".to_owned(),
        frame_id: Some(FrameId(0)),
        point_id: Some(PointId(0)),
        measurement: vec![1.0, 2.0],
        information: Some(vec![1.0, 0.0, 1.0]),
        ..GraphFactor::default()
    });
    sequence
}

/// Texts by what lines without a tag are, as the target's first byte says it.
fn texts() -> [(&'static str, u8, &'static str); 4] {
    let association = "MappointFrameAsso: 7 0 52.9079 318.8103\nMaplineFrameAsso: 4 0 1 2 3.5 4 5e0 6\r\n\
                       ParalineMaplineAsso: 0 2 4 5\nVertex: 0 1 2 3 0 0 0 1\nMappoint:7 1.0 -2.5 1e-3\n\
                       Mapline: 4 0 0 1 1 1 1\n# a comment\nOther: 1\nMappointFrameAsso: 7 0 nan";
    [
        ("association", 0, association),
        ("poses", 1, "0 1 2 3 0 0 0 1\n 1  1.5 2 3  0 0 0.6 0.8 \n"),
        ("points", 2, "0 1 2 3\n5 -1.25 2e2 .5"),
        ("segments", 3, "0 1 2 3 4 5 6\r\n"),
    ]
}

fn write_seeds() {
    let written = tempfile::tempdir().unwrap();
    for target in ["mcap_reader", "parquet_reader", "text_reader"] {
        let _ = fs::remove_dir_all(folder(target));
        fs::create_dir_all(folder(target)).unwrap();
    }
    let sequence = sequence();
    format::write(&folder("mcap_reader").join("tables.mcap"), &sequence, WriteOptions::default()).unwrap();
    let bare = Sequence { frames: sequence.frames.clone(), ..Sequence::default() };
    format::write(&folder("mcap_reader").join("frames.mcap"), &bare, WriteOptions::default()).unwrap();
    let parquet = written.path().join("parquet");
    format::write(&parquet, &sequence, WriteOptions::default()).unwrap();
    for (first, table) in PARQUET_TABLES.iter().enumerate() {
        let mut bytes = vec![u8::try_from(first).unwrap()];
        bytes.extend(fs::read(parquet.join(format!("{table}.parquet"))).unwrap());
        fs::write(folder("parquet_reader").join(table), bytes).unwrap();
    }
    for (name, first, text) in texts() {
        fs::write(folder("text_reader").join(name), [&[first], text.as_bytes()].concat()).unwrap();
    }
}

/// As in the target: the first byte of a seed is an index into these.
const PARQUET_TABLES: [&str; 5] =
    ["frames", "point_measurements", "graph_factors", "point_landmarks", "graph_poses"];

fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let mut seeds: Vec<_> = fs::read_dir(folder(target))
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    seeds.sort();
    seeds
}

#[test]
fn seeds_are_whole_files_that_every_reader_reads() {
    if std::env::var_os("UPDATE_SEEDS").is_some() {
        write_seeds();
    }
    let temporary = tempfile::tempdir().unwrap();
    let mcap = seeds("mcap_reader");
    assert_eq!(mcap.len(), 2);
    for (name, _) in mcap {
        let sequence = format::read(folder("mcap_reader").join(&name)).unwrap();
        assert_eq!(sequence.frames.len(), 3, "{name}");
    }
    let parquet = seeds("parquet_reader");
    assert_eq!(parquet.len(), PARQUET_TABLES.len());
    let good = temporary.path().join("good");
    format::write(&good, &sequence(), WriteOptions::default()).unwrap();
    for (name, bytes) in parquet {
        assert_eq!(PARQUET_TABLES[usize::from(bytes[0])], name);
        fs::write(good.join(format!("{name}.parquet")), &bytes[1..]).unwrap();
        assert_eq!(format::read(&good).unwrap().frames.len(), 3, "{name}");
    }
    let text = seeds("text_reader");
    assert_eq!(text.len(), texts().len());
    for (name, bytes) in text {
        let bare = [None, Some(BareLine::Pose), Some(BareLine::Point), Some(BareLine::Segment)];
        let rows = parse(&bytes[1..], bare[usize::from(bytes[0])], &mut FileProblems::new(&name));
        assert!(!rows.is_empty(), "{name}");
    }
}
