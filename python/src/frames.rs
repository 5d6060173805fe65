//! The frames of a sequence, one after the other.

use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;

use open_structure::format::Error;
use open_structure::structure::{FrameBundle, FrameId, Sequence as Rows};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::slice::PySliceIndices;
use pyo3::types::{PyList, PySlice};

use crate::errors;
use crate::frame::Frame;
use crate::sent::Sent;
use crate::sequence::{Sequence, Source};
use crate::work;

/// Frames that were read and wait to be taken.
const WAITING: usize = 16;

/// The frames of a sequence, in order; looks like a list.
#[pyclass(frozen, module = "open_structure")]
pub(crate) struct Frames {
    sequence: Py<Sequence>,
    ids: Vec<FrameId>,
}

impl Frames {
    fn at(&self, py: Python<'_>, place: isize) -> PyResult<Frame> {
        let index =
            if place < 0 { self.ids.len().checked_add_signed(place) } else { usize::try_from(place).ok() };
        let id = index.and_then(|index| self.ids.get(index));
        let id = id.ok_or_else(|| {
            PyIndexError::new_err(format!("{} frames, no frame at {place}", self.ids.len()))
        })?;
        self.sequence.get().frame(py, id.0)
    }

    pub(crate) fn new(sequence: Py<Sequence>, ids: Vec<FrameId>) -> Self {
        Self { sequence, ids }
    }
}

#[pymethods]
impl Frames {
    fn __len__(&self) -> usize {
        self.ids.len()
    }

    /// The frame at a place, counted from the end where it is negative; of a slice the frames, as a list.
    fn __getitem__<'py>(&self, py: Python<'py>, place: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        if let Ok(slice) = place.cast::<PySlice>() {
            let PySliceIndices { start, step, slicelength, .. } =
                slice.indices(self.ids.len().try_into()?)?;
            let places = (0..slicelength).map(|count| start + step * count.cast_signed());
            let frames = places.map(|place| self.at(py, place)).collect::<PyResult<Vec<_>>>()?;
            return Ok(PyList::new(py, frames)?.into_any());
        }
        Ok(Bound::new(py, self.at(py, place.extract()?)?)?.into_any())
    }

    fn __reversed__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let builtins = slf.py().import("builtins")?;
        let places = builtins.call_method1("range", (slf.get().ids.len(),))?.call_method0("__reversed__")?;
        builtins.call_method1("map", (slf.getattr("__getitem__")?, places))
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<FrameIterator> {
        FrameIterator::new(py, self.sequence.get().source())
    }

    /// Sent to another process, the frames are those of the sequence there.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Sent<'py, (Py<Sequence>, &'static str)> {
        Ok((py.import("builtins")?.getattr("getattr")?, (self.sequence.clone_ref(py), "frames")))
    }

    fn __repr__(&self) -> String {
        format!("<{} frames>", self.ids.len())
    }
}

/// Where the next frame comes from.
enum Next {
    /// A thread that reads ahead.
    File(Receiver<Result<FrameBundle, Error>>),
    /// A sequence in memory, and the place of the next frame.
    Memory(Arc<Rows>, usize),
}

/// Gives one frame after the other; a file is read ahead by a thread, a few frames at most.
#[pyclass(frozen, module = "open_structure")]
pub(crate) struct FrameIterator {
    next: Mutex<Next>,
}

impl FrameIterator {
    pub(crate) fn new(_py: Python<'_>, source: &Source) -> PyResult<Self> {
        let next = match source {
            Source::Memory(sequence) => Next::Memory(Arc::clone(sequence), 0),
            Source::File(reader) => {
                let (sender, receiver) = sync_channel(WAITING);
                let reader = Arc::clone(reader);
                let read = move || match reader.frames() {
                    Ok(frames) => {
                        for frame in frames {
                            let failed = frame.is_err();
                            // Nobody takes any more where the iterator is gone.
                            if sender.send(frame).is_err() || failed {
                                break;
                            }
                        }
                    }
                    Err(error) => drop(sender.send(Err(error))),
                };
                thread::Builder::new()
                    .spawn(|| work::among_threads(read))
                    .map_err(|cause| errors::step(format!("no thread to read with: {cause}")))?;
                Next::File(receiver)
            }
        };
        Ok(Self { next: Mutex::new(next) })
    }
}

#[pymethods]
impl FrameIterator {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        // The lock of the interpreter is not held while another thread may hold this one.
        let found = py.detach(|| {
            let mut next = self.next.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            match &mut *next {
                Next::File(receiver) => receiver.recv().ok(),
                Next::Memory(sequence, place) => {
                    let frame = sequence.frames.get(*place)?;
                    *place += 1;
                    bundle_of(sequence, frame.frame_id).map(Ok)
                }
            }
        });
        found.transpose().map(|found| found.map(Frame::new)).map_err(errors::of_format)
    }
}

/// A frame of a sequence in memory, with its rows; per-frame tables are sorted.
pub(crate) fn bundle_of(sequence: &Rows, frame_id: FrameId) -> Option<FrameBundle> {
    let frame = sequence.frames.iter().find(|frame| frame.frame_id == frame_id)?.clone();
    macro_rules! rows {
        ($table:ident) => {{
            let begin = sequence.$table.partition_point(|row| row.frame_id < frame_id);
            let count = sequence.$table[begin..].partition_point(|row| row.frame_id == frame_id);
            sequence.$table[begin..begin + count].to_vec()
        }};
    }
    Some(FrameBundle {
        frame,
        point_observations: rows!(point_observations),
        line_observations: rows!(line_observations),
        point_measurements: rows!(point_measurements),
        line_measurements: rows!(line_measurements),
    })
}
