//! One table of a sequence, shared with every program that takes Arrow.

use std::sync::Arc;

use arrow::array::{
    Array, ArrayRef, AsArray as _, BooleanArray, Float64Array, Int64Array, RecordBatch, RecordBatchIterator,
    RecordBatchReader, StructArray,
};
use arrow::datatypes::{DataType, Float64Type, Int64Type};
use arrow::ffi::{FFI_ArrowArray, FFI_ArrowSchema};
use arrow::ffi_stream::FFI_ArrowArrayStream;
use arrow::ipc::reader::StreamReader;
use arrow::ipc::writer::StreamWriter;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyIterator, PyList, PyString};

use crate::column::{Column, bytes_of};
use crate::errors;
use crate::sent::Sent;

/// One table of a sequence.
///
/// Speaks the Arrow ``PyCapsule`` interface, so that every library that takes Arrow takes it as it is and without a copy:
/// ``pyarrow.table(table)``, ``polars.DataFrame(table)``, ``duckdb.sql("select * from table")``. ``table["u"]`` is one
/// column as an array of numpy.
///
/// What a column means, in which unit and in which space, is its metadata: see ``columns``.
#[pyclass(frozen, module = "open_structure")]
#[derive(Clone)]
pub(crate) struct Table {
    name: String,
    batch: RecordBatch,
}

impl Table {
    pub(crate) fn new(name: &str, batch: RecordBatch) -> Self {
        Self { name: name.to_owned(), batch }
    }

    pub(crate) fn rows(&self) -> usize {
        self.batch.num_rows()
    }

    /// A column as an array of numpy.
    fn numpy<'py>(py: Python<'py>, array: &ArrayRef) -> PyResult<Bound<'py, PyAny>> {
        let nulls = array.nulls().filter(|nulls| nulls.null_count() > 0);
        match (array.data_type(), nulls) {
            (DataType::Int64 | DataType::Float64, None) => Column::as_numpy(py, Arc::clone(array)),
            (DataType::Float64, Some(_)) => {
                let values = array.as_primitive::<Float64Type>().iter();
                let values = Float64Array::from_iter_values(values.map(|value| value.unwrap_or(f64::NAN)));
                Column::as_numpy(py, Arc::new(values))
            }
            (DataType::Int64, Some(nulls)) => {
                let values = array.as_primitive::<Int64Type>().iter();
                let values = Int64Array::from_iter_values(values.map(Option::unwrap_or_default));
                let absent = BooleanArray::new(!nulls.inner(), None);
                let arguments = (
                    Column::as_numpy(py, Arc::new(values))?,
                    Column::as_numpy(py, Arc::new(bytes_of(&absent)))?,
                );
                py.import("numpy.ma")?.getattr("MaskedArray")?.call1(arguments)
            }
            (DataType::Boolean, _) => Column::as_numpy(py, Arc::new(bytes_of(array.as_boolean()))),
            _ => objects(py, array),
        }
    }
}

/// A column of words, bytes or lists as an array of objects; `None` where a value is absent.
fn objects<'py>(py: Python<'py>, array: &ArrayRef) -> PyResult<Bound<'py, PyAny>> {
    let numpy = py.import("numpy")?;
    let found = numpy.call_method1("empty", (array.len(), py.get_type::<PyAny>()))?;
    let set = |row: usize, value: Bound<'py, PyAny>| found.set_item(row, value);
    let present = |row: &usize| array.is_valid(*row);
    match array.data_type() {
        DataType::Utf8 => {
            let words = array.as_string::<i32>();
            (0..array.len())
                .filter(present)
                .try_for_each(|row| set(row, PyString::new(py, words.value(row)).into_any()))?;
        }
        DataType::Binary => {
            let bytes = array.as_binary::<i32>();
            (0..array.len())
                .filter(present)
                .try_for_each(|row| set(row, PyBytes::new(py, bytes.value(row)).into_any()))?;
        }
        DataType::List(_) => {
            let lists = array.as_list::<i32>();
            (0..array.len())
                .filter(present)
                .try_for_each(|row| set(row, Table::numpy(py, &lists.value(row))?))?;
        }
        other => return Err(errors::internal(&format!("a column of type {other}"))),
    }
    Ok(found)
}

#[pymethods]
impl Table {
    /// Name of the table.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Names of the columns, in order.
    #[getter]
    fn column_names(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// What each column means: ``name``, ``type``, ``nullable``, ``unit``, ``space`` and ``description``.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let described = |field: &Arc<arrow::datatypes::Field>| {
            let column = PyDict::new(py);
            column.set_item("name", field.name())?;
            column.set_item("type", field.data_type().to_string())?;
            column.set_item("nullable", field.is_nullable())?;
            for key in ["unit", "space", "description"] {
                column.set_item(key, field.metadata().get(key).map_or("-", String::as_str))?;
            }
            Ok(column)
        };
        self.batch.schema().fields().iter().map(described).collect()
    }

    /// Number of rows.
    #[getter]
    fn num_rows(&self) -> usize {
        self.batch.num_rows()
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    /// Sent to another process, a table is its rows.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Sent<'py, (&str, Bound<'py, PyBytes>)> {
        let mut stream = Vec::new();
        let written = StreamWriter::try_new(&mut stream, &self.batch.schema())
            .and_then(|mut writer| writer.write(&self.batch).and_then(|()| writer.finish()));
        written.map_err(|cause| errors::internal(&cause.to_string()))?;
        Ok((py.get_type::<Self>().getattr("_received")?, (&self.name, PyBytes::new(py, &stream))))
    }

    /// What `__reduce__` sent.
    #[staticmethod]
    fn _received(name: &str, stream: &[u8]) -> PyResult<Self> {
        let batch = StreamReader::try_new(stream, None).and_then(|mut batches| batches.next().transpose());
        match batch {
            Ok(Some(batch)) => Ok(Self::new(name, batch)),
            Ok(None) => Err(errors::option(format!("{name}: expected a table that was sent, found no rows"))),
            Err(cause) => Err(errors::option(format!("{name}: expected a table that was sent: {cause}"))),
        }
    }

    fn __repr__(&self) -> String {
        format!("<Table {}: {} rows, {}>", self.name, self.batch.num_rows(), self.column_names().join(", "))
    }

    /// One column as an array of numpy, see ``to_numpy``.
    fn __getitem__<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        match self.batch.column_by_name(column) {
            Some(array) => Self::numpy(py, array),
            None => Err(PyKeyError::new_err(column.to_owned())),
        }
    }

    fn __contains__(&self, column: &Bound<'_, PyAny>) -> bool {
        column.extract::<String>().is_ok_and(|column| self.batch.column_by_name(&column).is_some())
    }

    /// The names of the columns, as of a mapping.
    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyList::new(py, self.column_names())?.try_iter()
    }

    /// The schema as an ``arrow_schema`` capsule.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema().as_ref());
        let schema = schema.map_err(|cause| errors::internal(&cause.to_string()))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// The rows as an ``arrow_schema`` and an ``arrow_array`` capsule, without a copy.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_array__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyCapsule>, Bound<'py, PyCapsule>)> {
        // A producer may give what it has.
        let _ = requested_schema;
        let rows = StructArray::from(self.batch.clone());
        let array = FFI_ArrowArray::new(&rows.to_data());
        Ok((self.__arrow_c_schema__(py)?, PyCapsule::new_with_value(py, array, c"arrow_array")?))
    }

    /// The rows as an ``arrow_array_stream`` capsule of one batch, without a copy.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        let batches: Box<dyn RecordBatchReader + Send> = Box::new(batches);
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(batches), c"arrow_array_stream")
    }

    /// A ``pyarrow.Table`` that looks at the same memory.
    fn to_pyarrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("pyarrow")?.call_method1("table", (slf,))
    }

    /// A ``pandas.DataFrame``; columns of numbers without absent values look at the same memory.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let options = PyDict::new(slf.py());
        // Columns side by side would have to be copied into one block.
        options.set_item("split_blocks", true)?;
        Self::to_pyarrow(slf)?.call_method("to_pandas", (), Some(&options))
    }

    /// A ``polars.DataFrame`` that looks at the same memory.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

    /// A dictionary of arrays of numpy by the names of the columns.
    ///
    /// Numbers look at the memory of the table, read-only. Where a number is absent, the column is a copy with ``nan``, a
    /// column of whole numbers a masked one. Words, bytes and lists are arrays of objects; ``None`` where absent.
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for (field, array) in self.batch.schema().fields().iter().zip(self.batch.columns()) {
            columns.set_item(field.name(), Self::numpy(py, array)?)?;
        }
        Ok(columns)
    }
}
