//! Numbers of a table where they lie, for numpy.

use arrow::array::{Array as _, ArrayRef, AsArray as _, UInt8Array};
use arrow::datatypes::{DataType, Float64Type, Int64Type, UInt8Type};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Numbers of a table where they lie: ``numpy.asarray`` looks at them without a copy.
#[pyclass(frozen, module = "open_structure")]
pub(crate) struct Column {
    /// Whole numbers, numbers, or bytes that are 0 or 1; none of them null.
    values: ArrayRef,
}

impl Column {
    pub(crate) fn new(values: ArrayRef) -> Self {
        Self { values }
    }

    /// An array of numpy that looks at numbers.
    pub(crate) fn as_numpy(py: Python<'_>, values: ArrayRef) -> PyResult<Bound<'_, PyAny>> {
        let column = Py::new(py, Self::new(values))?;
        py.import("numpy")?.call_method1("asarray", (column,))
    }

    /// Address of the first number, for whoever only looks, and the type as numpy writes it.
    fn place(&self) -> Option<(usize, &'static str)> {
        let number = if cfg!(target_endian = "little") { ["<i8", "<f8"] } else { [">i8", ">f8"] };
        match self.values.data_type() {
            DataType::Int64 => {
                Some((self.values.as_primitive::<Int64Type>().values().as_ptr() as usize, number[0]))
            }
            DataType::Float64 => {
                Some((self.values.as_primitive::<Float64Type>().values().as_ptr() as usize, number[1]))
            }
            DataType::UInt8 => {
                Some((self.values.as_primitive::<UInt8Type>().values().as_ptr() as usize, "|b1"))
            }
            _ => None,
        }
    }
}

#[pymethods]
impl Column {
    fn __len__(&self) -> usize {
        self.values.len()
    }

    /// Where the numbers lie, in the words of numpy's array interface, version 3; read-only.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Some((address, kind)) = self.place() else {
            return Err(PyAttributeError::new_err("__array_interface__"));
        };
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", (self.values.len(),))?;
        interface.set_item("typestr", kind)?;
        interface.set_item("data", (address, true))?;
        Ok(interface)
    }
}

/// Truth values as bytes.
pub(crate) fn bytes_of(values: &arrow::array::BooleanArray) -> UInt8Array {
    UInt8Array::from_iter_values((0..values.len()).map(|row| u8::from(values.value(row))))
}
