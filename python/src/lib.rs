//! The native half of the Python package `open_structure`: sequences as Arrow tables, and the steps of `os` as functions.
//!
//! What a name means to Python users stands in the doc comments here: they are the docstrings. Types are told by
//! `open_structure/_native.pyi`, which the tests hold against this.

mod adjust;
mod arguments;
mod column;
mod errors;
mod estimate;
mod evaluate;
mod frame;
mod frames;
mod graph;
mod json;
mod measure;
mod sent;
mod sequence;
mod simulate;
mod table;
mod track;
mod validate;
mod work;

use pyo3::prelude::*;

/// Sequences of Open-Structure as Arrow tables, and the steps of the program `os` as functions.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    work::loaded();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<column::Column>()?;
    module.add_class::<frame::Frame>()?;
    module.add_class::<frames::Frames>()?;
    module.add_class::<frames::FrameIterator>()?;
    module.add_class::<sequence::Sequence>()?;
    module.add_class::<table::Table>()?;
    module.add_function(wrap_pyfunction!(adjust::adjust, module)?)?;
    module.add_function(wrap_pyfunction!(evaluate::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(evaluate::evaluate_frames, module)?)?;
    module.add_function(wrap_pyfunction!(graph::graph, module)?)?;
    module.add_function(wrap_pyfunction!(measure::measure, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::recipes, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(track::track, module)?)?;
    module.add_function(wrap_pyfunction!(validate::validate, module)?)?;
    module.add_function(wrap_pyfunction!(estimate::write_estimate, module)?)?;
    Ok(())
}
