//! Columns of a table, an Arrow record batch at a time, from either encoding.

use arrow::array::RecordBatch;

use super::Error;
use super::batches::BatchSource;
use crate::structure::TableInfo;

/// Columns of a table, a batch at a time.
pub struct RecordBatches<'a> {
    source: BatchSource<'a>,
    table: &'static TableInfo,
}

impl<'a> RecordBatches<'a> {
    pub(super) const fn new(source: BatchSource<'a>, table: &'static TableInfo) -> Self {
        Self { source, table }
    }

    /// Passes over messages of other tables, and over columns that this version does not know.
    fn advance(&mut self) -> Option<Result<RecordBatch, Error>> {
        match &mut self.source {
            BatchSource::Empty => None,
            BatchSource::Parquet(batches) => batches.next_columns(),
            BatchSource::Mcap(reader, messages) => loop {
                let columns = messages.next()?.and_then(|message| reader.columns(message, self.table));
                match columns.transpose() {
                    None => {}
                    Some(columns) => break Some(columns.map(|columns| known(columns, self.table))),
                }
            },
        }
    }
}

impl Iterator for RecordBatches<'_> {
    type Item = Result<RecordBatch, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let result = self.advance();
        if matches!(result, Some(Err(_))) {
            self.source = BatchSource::Empty;
        }
        result
    }
}

/// The columns that this version knows.
fn known(batch: RecordBatch, table: &TableInfo) -> RecordBatch {
    let schema = batch.schema();
    let is_known = |name: &str| table.fields.iter().any(|field| field.name == name);
    let known: Vec<usize> =
        (0..schema.fields().len()).filter(|index| is_known(schema.field(*index).name())).collect();
    // Places that are there.
    batch.project(&known).unwrap_or(batch)
}

#[cfg(test)]
mod tests {
    use arrow::array::AsArray;
    use arrow::datatypes::{Float64Type, Int64Type};

    use crate::format::{self, WriteOptions};
    use crate::structure::{CameraId, Frame, FrameId, LineMeasurement, PointId, PointMeasurement, Sequence};

    #[test]
    fn columns_hold_what_rows_hold() {
        let mut sequence = Sequence::default();
        for frame_id in (0..3).map(FrameId) {
            sequence.frames.push(Frame::new(frame_id, frame_id.0, CameraId(0), None));
            for place in 0..5 {
                let (u, depth) = (f64::from(place) * 1.1, (place != 2).then_some(2.0));
                let point_id = PointId(i64::from(place));
                sequence.point_measurements.push(PointMeasurement { frame_id, point_id, u, v: 1.5, depth });
            }
        }
        let folder = tempfile::tempdir().unwrap();
        for name in ["sequence", "sequence.mcap"] {
            let path = folder.path().join(name);
            format::write(&path, &sequence, WriteOptions::default()).unwrap();
            let reader = format::open(&path).unwrap();
            let (mut frames, mut u, mut absent) = (Vec::new(), Vec::new(), 0);
            for batch in reader.record_batches::<PointMeasurement>().unwrap() {
                let batch = batch.unwrap();
                let column = |name| batch.column_by_name(name).unwrap();
                frames.extend_from_slice(column("frame_id").as_primitive::<Int64Type>().values());
                u.extend_from_slice(column("u").as_primitive::<Float64Type>().values());
                absent += column("depth").null_count();
            }
            let rows = &sequence.point_measurements;
            assert_eq!(frames, rows.iter().map(|row| row.frame_id.0).collect::<Vec<_>>(), "{name}");
            assert_eq!(u, rows.iter().map(|row| row.u).collect::<Vec<_>>(), "{name}");
            assert_eq!(absent, 3, "{name}");
            let lines = reader.record_batches::<LineMeasurement>().unwrap();
            assert_eq!(lines.map(|batch| batch.unwrap().num_rows()).sum::<usize>(), 0, "{name}");
        }
    }
}
