//! One frame and what it shows.

use std::sync::Arc;

use open_structure::format::record_batch;
use open_structure::structure::{FrameBundle, Record};
use pyo3::prelude::*;

use crate::column::Column;
use crate::errors;
use crate::sequence::matrix;
use crate::table::Table;

/// One frame: an exposure of a camera, with its rows of the tables of frames.
#[pyclass(frozen, module = "open_structure")]
pub(crate) struct Frame {
    bundle: FrameBundle,
}

impl Frame {
    pub(crate) fn new(bundle: FrameBundle) -> Self {
        Self { bundle }
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
        self.bundle.frame.frame_id.0
    }

    /// Time of the exposure, nanoseconds.
    #[getter]
    fn stamp_nanos(&self) -> i64 {
        self.bundle.frame.stamp_nanos
    }

    /// Camera of the manifest that took the frame.
    #[getter]
    fn camera_id(&self) -> i64 {
        self.bundle.frame.camera_id.0
    }

    /// The true pose as a matrix (4, 4), metres; ``None`` where it is not known.
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(row) = self.bundle.frame.world_from_camera() else { return Ok(None) };
        let pose =
            row.pose().map_err(|cause| errors::step(format!("{}: {cause}", self.bundle.frame.frame_id)))?;
        let numbers = arrow::array::Float64Array::from(matrix(&pose).to_vec());
        Column::as_numpy(py, Arc::new(numbers))?.call_method1("reshape", (4, 4)).map(Some)
    }

    /// Measured points: ``point_id``, ``u`` and ``v`` in pixels, ``depth`` in metres.
    #[getter]
    fn point_measurements(&self) -> PyResult<Table> {
        table(&self.bundle.point_measurements)
    }

    /// Measured lines: ``line_id``, both ends in pixels, their depths in metres.
    #[getter]
    fn line_measurements(&self) -> PyResult<Table> {
        table(&self.bundle.line_measurements)
    }

    /// Points as a perfect front-end sees them.
    #[getter]
    fn point_observations(&self) -> PyResult<Table> {
        table(&self.bundle.point_observations)
    }

    /// Lines as a perfect front-end sees them.
    #[getter]
    fn line_observations(&self) -> PyResult<Table> {
        table(&self.bundle.line_observations)
    }

    fn __repr__(&self) -> String {
        format!(
            "<Frame {}: {} points and {} lines measured>",
            self.frame_id(),
            self.bundle.point_measurements.len(),
            self.bundle.line_measurements.len()
        )
    }
}
