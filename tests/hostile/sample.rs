//! Small whole files to be damaged, and files that are whole but malicious.

use std::collections::BTreeMap;
use std::fs;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use bytes::Bytes;
use open_structure::format::{self, WriteOptions};
use open_structure::structure::*;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::{FileMetaData, ParquetMetaDataReader, ParquetMetaDataWriter};
use parquet::file::properties::WriterProperties;

/// Files of a folder by name.
pub(crate) type Parts = BTreeMap<String, Vec<u8>>;

/// A few frames with numbers, texts, lists, bytes and nulls.
fn sequence() -> Sequence {
    let mut sequence = Sequence::default();
    sequence.manifest.name = "sample".to_owned();
    let pose = PoseRow { translation: [1.0, 2.0, 3.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    for id in 0..12_i32 {
        let frame_id = FrameId(i64::from(id));
        sequence.frames.push(Frame::new(
            frame_id,
            i64::from(id) * 1000,
            CameraId(0),
            (id % 3 != 0).then_some(pose),
        ));
        for point in 0..40_i32 {
            sequence.point_measurements.push(PointMeasurement {
                frame_id,
                point_id: PointId(i64::from(point)),
                u: f64::from(id * 40 + point) / 7.0,
                v: f64::from(point) * 1.25,
                depth: (point % 4 != 0).then_some(f64::from(point)),
            });
        }
        sequence.graph_factors.push(GraphFactor {
            graph: "initial".to_owned(),
            factor_id: i64::from(id),
            kind: "point-reprojection".to_owned(),
            frame_id: Some(frame_id),
            measurement: vec![f64::from(id), 0.5],
            information: (id % 2 == 0).then(|| vec![1.0, 0.0, 1.0]),
            ..GraphFactor::default()
        });
    }
    for id in 0..5_u8 {
        sequence.point_landmarks.push(PointLandmark {
            point_id: PointId(i64::from(id)),
            descriptor: (id > 1).then(|| Descriptor(vec![id; 32])),
            ..PointLandmark::default()
        });
    }
    sequence
}

/// A whole MCAP file.
pub(crate) fn mcap_bytes() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.mcap");
    format::write(&path, &sequence(), WriteOptions::default()).unwrap();
    fs::read(path).unwrap()
}

/// A whole Parquet folder.
pub(crate) fn folder_parts() -> Parts {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole");
    format::write(&path, &sequence(), WriteOptions::default()).unwrap();
    fs::read_dir(path)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect()
}

/// The same Parquet file with another number of rows in its footer.
pub(crate) fn with_row_count(whole: &[u8], rows: i64) -> Vec<u8> {
    let bytes = Bytes::copy_from_slice(whole);
    let footer = ParquetMetaDataReader::new().parse_and_finish(&bytes).unwrap();
    let file = footer.file_metadata();
    let file = FileMetaData::new(
        file.version(),
        rows,
        file.created_by().map(str::to_owned),
        file.key_value_metadata().cloned(),
        file.schema_descr_ptr(),
        file.column_orders().cloned(),
    );
    let groups = footer
        .row_groups()
        .iter()
        .map(|group| group.clone().into_builder().set_num_rows(rows).build().unwrap())
        .collect();
    let changed = parquet::file::metadata::ParquetMetaData::new(file, groups);
    // The footer's length stands before the last four bytes.
    let (body, _) = whole.split_at(whole.len() - 8);
    let length = u32::from_le_bytes(whole[whole.len() - 8..whole.len() - 4].try_into().unwrap()) as usize;
    let mut bytes = body[..body.len() - length].to_vec();
    ParquetMetaDataWriter::new(&mut bytes, &changed).finish().unwrap();
    bytes
}

/// A table `map_points` of twenty thousand rows that all name an estimate of 64 kB.
pub(crate) fn dictionary_bomb() -> Vec<u8> {
    const ROWS: usize = 20_000;
    let long = "x".repeat(1 << 16);
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_dictionary_page_size_limit(1 << 24)
        .build();
    let schema = format::arrow_schema(MapPoint::TABLE);
    let mut writer = ArrowWriter::try_new(Vec::new(), Arc::clone(&schema), Some(properties)).unwrap();
    for first in (0..ROWS).step_by(1000) {
        let numbers: ArrayRef = Arc::new(Float64Array::from(vec![0.0; 1000]));
        let ids = Int64Array::from_iter_values((first..first + 1000).map(|id| id as i64));
        let estimates = StringArray::from(vec![long.as_str(); 1000]);
        let columns: Vec<ArrayRef> = vec![
            Arc::new(estimates),
            Arc::new(ids),
            Arc::clone(&numbers),
            Arc::clone(&numbers),
            Arc::clone(&numbers),
            arrow::array::new_null_array(schema.field(5).data_type(), 1000),
        ];
        writer.write(&RecordBatch::try_new(Arc::clone(&schema), columns).unwrap()).unwrap();
    }
    writer.into_inner().unwrap()
}
