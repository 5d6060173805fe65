//! One frame and what it shows.

use std::sync::Arc;

use open_structure::format::record_batch;
use open_structure::structure::{CameraId, FrameBundle, FrameId, PoseRow, Record};
use pyo3::prelude::*;

use crate::column::Column;
use crate::errors;
use crate::sent::Sent;
use crate::sequence::matrix;
use crate::table::Table;

/// One frame: an exposure of a camera, with its rows of the tables of frames.
#[pyclass(frozen, module = "open_structure")]
pub(crate) struct Frame {
    id: FrameId,
    stamp_nanos: i64,
    camera_id: CameraId,
    pose: Option<PoseRow>,
    shown: Shown,
}

/// What a frame shows.
enum Shown {
    /// Rows, made into columns when they are asked for.
    Rows(FrameBundle),
    /// Columns from another process: measurements of points and lines, observations of points and lines.
    Tables([Table; 4]),
}

/// A frame as it is sent to another process.
type Parts = (i64, i64, i64, Option<[f64; 7]>, [Table; 4]);

impl Frame {
    pub(crate) fn new(bundle: FrameBundle) -> Self {
        let frame = &bundle.frame;
        Self {
            id: frame.frame_id,
            stamp_nanos: frame.stamp_nanos,
            camera_id: frame.camera_id,
            pose: frame.world_from_camera(),
            shown: Shown::Rows(bundle),
        }
    }
}

fn table<R: Record>(rows: &[R]) -> PyResult<Table> {
    Ok(Table::new(R::TABLE.name, record_batch(rows).map_err(errors::of_format)?))
}

#[pymethods]
impl Frame {
    /// Name of the frame.
    #[getter]
    fn frame_id(&self) -> i64 {
        self.id.0
    }

    /// Time of the exposure, nanoseconds.
    #[getter]
    fn stamp_nanos(&self) -> i64 {
        self.stamp_nanos
    }

    /// Camera of the manifest that took the frame.
    #[getter]
    fn camera_id(&self) -> i64 {
        self.camera_id.0
    }

    /// The true pose as a matrix (4, 4), metres; ``None`` where it is not known.
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(row) = self.pose else { return Ok(None) };
        let pose = row.pose().map_err(|cause| errors::step(format!("{}: {cause}", self.id)))?;
        let numbers = arrow::array::Float64Array::from(matrix(&pose).to_vec());
        Column::as_numpy(py, Arc::new(numbers))?.call_method1("reshape", (4, 4)).map(Some)
    }

    /// Measured points: ``point_id``, ``u`` and ``v`` in pixels, ``depth`` in metres.
    #[getter]
    fn point_measurements(&self) -> PyResult<Table> {
        match &self.shown {
            Shown::Rows(bundle) => table(&bundle.point_measurements),
            Shown::Tables(tables) => Ok(tables[0].clone()),
        }
    }

    /// Measured lines: ``line_id``, both ends in pixels, their depths in metres.
    #[getter]
    fn line_measurements(&self) -> PyResult<Table> {
        match &self.shown {
            Shown::Rows(bundle) => table(&bundle.line_measurements),
            Shown::Tables(tables) => Ok(tables[1].clone()),
        }
    }

    /// Points as a perfect front-end sees them.
    #[getter]
    fn point_observations(&self) -> PyResult<Table> {
        match &self.shown {
            Shown::Rows(bundle) => table(&bundle.point_observations),
            Shown::Tables(tables) => Ok(tables[2].clone()),
        }
    }

    /// Lines as a perfect front-end sees them.
    #[getter]
    fn line_observations(&self) -> PyResult<Table> {
        match &self.shown {
            Shown::Rows(bundle) => table(&bundle.line_observations),
            Shown::Tables(tables) => Ok(tables[3].clone()),
        }
    }

    /// Sent to another process, a frame takes its rows along.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Sent<'py, Parts> {
        let tables = [
            self.point_measurements()?,
            self.line_measurements()?,
            self.point_observations()?,
            self.line_observations()?,
        ];
        let pose = self.pose.map(|PoseRow { translation: [tx, ty, tz], rotation_xyzw: [qx, qy, qz, qw] }| {
            [tx, ty, tz, qx, qy, qz, qw]
        });
        let parts = (self.id.0, self.stamp_nanos, self.camera_id.0, pose, tables);
        Ok((py.get_type::<Self>().getattr("_received")?, parts))
    }

    /// What `__reduce__` sent.
    #[staticmethod]
    fn _received(
        frame_id: i64,
        stamp_nanos: i64,
        camera_id: i64,
        pose: Option<[f64; 7]>,
        tables: [PyRef<'_, Table>; 4],
    ) -> Self {
        Self {
            id: FrameId(frame_id),
            stamp_nanos,
            camera_id: CameraId(camera_id),
            pose: pose.map(PoseRow::from_numbers),
            shown: Shown::Tables(tables.map(|table| table.clone())),
        }
    }

    fn __repr__(&self) -> String {
        let [points, lines] = match &self.shown {
            Shown::Rows(bundle) => [bundle.point_measurements.len(), bundle.line_measurements.len()],
            Shown::Tables([points, lines, ..]) => [points.rows(), lines.rows()],
        };
        format!("<Frame {}: {points} points and {lines} lines measured>", self.id.0)
    }
}
