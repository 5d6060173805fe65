//! A chunk: rows of components of one entity, with their times, as Arrow has them.

use std::collections::HashMap;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, DurationNanosecondArray, FixedSizeBinaryArray, FixedSizeListArray, Float32Array, Int64Array,
    ListArray, RecordBatch, UInt8Array, UInt32Array,
};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field, Schema};
use arrow::error::ArrowError;
use arrow::ipc::writer::StreamWriter;

use super::rrd_stream::Tuid;

/// The version of the layout of chunks.
const LAYOUT: &str = "0.1.4";

/// Components of one entity, a row for each time, or one row that holds at all times.
pub(super) struct Chunk {
    /// Path of the entity.
    pub(super) entity: String,
    /// Frame and nanoseconds of each row; `None` of a single row that holds at all times.
    pub(super) times: Option<Vec<[i64; 2]>>,
    pub(super) components: Vec<Component>,
}

/// A column of components: in each row some instances.
pub(super) struct Component {
    archetype: &'static str,
    field: &'static str,
    kind: &'static str,
    values: ArrayRef,
}

fn item(data_type: DataType, nullable: bool) -> Arc<Field> {
    Arc::new(Field::new("item", data_type, nullable))
}

/// Vectors of a width out of their numbers.
fn vectors_of(width: i32, values: ArrayRef) -> Result<ArrayRef, ArrowError> {
    Ok(Arc::new(FixedSizeListArray::try_new(item(values.data_type().clone(), false), width, values, None)?))
}

/// Lists of some lengths out of what is in them.
fn lists_of(
    lengths: impl IntoIterator<Item = usize>,
    values: ArrayRef,
    nullable: bool,
) -> Result<ArrayRef, ArrowError> {
    let field = item(values.data_type().clone(), nullable);
    Ok(Arc::new(ListArray::try_new(field, OffsetBuffer::from_lengths(lengths), values, None)?))
}

impl Component {
    /// Vectors of 32-bit numbers.
    pub(super) fn vectors<const N: usize>(
        names: [&'static str; 3],
        rows: &[Vec<[f32; N]>],
    ) -> Result<Self, ArrowError> {
        let numbers: Vec<f32> = rows.iter().flatten().flatten().copied().collect();
        let values = vectors_of(width::<N>()?, Arc::new(Float32Array::from(numbers)))?;
        Self::new(names, lists_of(rows.iter().map(Vec::len), values, true)?)
    }

    /// Strips of vectors of 32-bit numbers, two vectors or more each.
    pub(super) fn strips<const N: usize>(
        names: [&'static str; 3],
        rows: &[Vec<Vec<[f32; N]>>],
    ) -> Result<Self, ArrowError> {
        let numbers: Vec<f32> = rows.iter().flatten().flatten().flatten().copied().collect();
        let values = vectors_of(width::<N>()?, Arc::new(Float32Array::from(numbers)))?;
        let strips = lists_of(rows.iter().flatten().map(Vec::len), values, false)?;
        Self::new(names, lists_of(rows.iter().map(Vec::len), strips, true)?)
    }

    /// Colours, as 0xRRGGBBAA.
    pub(super) fn colours(archetype: &'static str, rows: &[Vec<u32>]) -> Result<Self, ArrowError> {
        let values: UInt32Array = rows.iter().flatten().copied().collect();
        let lists = lists_of(rows.iter().map(Vec::len), Arc::new(values), true)?;
        Self::new([archetype, "colors", "Color"], lists)
    }

    /// One number in one row.
    pub(super) fn number(names: [&'static str; 3], number: f32) -> Result<Self, ArrowError> {
        Self::new(names, lists_of([1], Arc::new(Float32Array::from(vec![number])), true)?)
    }

    /// Directions of three axes in one row.
    pub(super) fn axes(names: [&'static str; 3], axes: [u8; 3]) -> Result<Self, ArrowError> {
        let values = vectors_of(3, Arc::new(UInt8Array::from(axes.to_vec())))?;
        Self::new(names, lists_of([1], values, true)?)
    }

    #[expect(clippy::unnecessary_wraps, reason = "the end of a chain of those that may fail")]
    fn new([archetype, field, kind]: [&'static str; 3], values: ArrayRef) -> Result<Self, ArrowError> {
        Ok(Self { archetype, field, kind, values })
    }

    fn described(&self) -> Field {
        let name = format!("{}:{}", self.archetype, self.field);
        let about = [
            ("rerun:archetype", format!("rerun.archetypes.{}", self.archetype)),
            ("rerun:component", name.clone()),
            ("rerun:component_type", format!("rerun.components.{}", self.kind)),
            ("rerun:kind", "data".to_owned()),
        ];
        Field::new(name, self.values.data_type().clone(), true).with_metadata(metadata(about))
    }
}

fn width<const N: usize>() -> Result<i32, ArrowError> {
    i32::try_from(N).map_err(|_| ArrowError::ComputeError(format!("vectors of {N} numbers")))
}

fn metadata<const N: usize>(about: [(&str, String); N]) -> HashMap<String, String> {
    about.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

impl Chunk {
    fn rows(&self) -> usize {
        self.times.as_ref().map_or(1, Vec::len)
    }

    /// The chunk as an Arrow IPC stream.
    ///
    /// * `row_ids` — as many as it has rows, rising.
    pub(super) fn encode(&self, id: Tuid, row_ids: &[Tuid]) -> Result<Vec<u8>, ArrowError> {
        debug_assert_eq!(row_ids.len(), self.rows());
        let ids = FixedSizeBinaryArray::try_from_iter(row_ids.iter().map(|id| id.bytes()))?;
        let control = metadata([
            ("rerun:kind", "control".to_owned()),
            ("rerun:is_sorted", "true".to_owned()),
            ("ARROW:extension:name", "rerun.datatypes.TUID".to_owned()),
            ("ARROW:extension:metadata", "{\"namespace\":\"row\"}".to_owned()),
        ]);
        let mut fields = vec![Field::new("rerun.controls.RowId", ids_type(), false).with_metadata(control)];
        let mut columns: Vec<ArrayRef> = vec![Arc::new(ids)];
        if let Some(times) = &self.times {
            let of = |which: usize| times.iter().map(move |time| time[which]);
            let frames: Int64Array = of(0).collect();
            let nanos = DurationNanosecondArray::from_iter_values(of(1));
            let sorted = [0, 1].map(|which| times.is_sorted_by_key(|time| time[which]));
            for (name, sorted, column) in
                [("frame", sorted[0], Arc::new(frames) as ArrayRef), ("time", sorted[1], Arc::new(nanos))]
            {
                let index = metadata([
                    ("rerun:kind", "index".to_owned()),
                    ("rerun:index_name", name.to_owned()),
                    ("rerun:is_sorted", sorted.to_string()),
                ]);
                fields.push(Field::new(name, column.data_type().clone(), true).with_metadata(index));
                columns.push(column);
            }
        }
        fields.extend(self.components.iter().map(Component::described));
        columns.extend(self.components.iter().map(|component| Arc::clone(&component.values)));
        let about = metadata([
            ("rerun:entity_path", self.entity.clone()),
            ("rerun:id", id.chunk_name()),
            ("sorbet:version", LAYOUT.to_owned()),
        ]);
        let schema = Arc::new(Schema::new(fields).with_metadata(about));
        let batch = RecordBatch::try_new(Arc::clone(&schema), columns)?;
        let mut writer = StreamWriter::try_new(Vec::new(), &schema)?;
        writer.write(&batch)?;
        writer.into_inner()
    }
}

fn ids_type() -> DataType {
    DataType::FixedSizeBinary(16)
}
