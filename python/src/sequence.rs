//! A sequence: a file that is open, or what a step made in memory.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use open_structure::format::{self, SequenceReader, WriteOptions};
use open_structure::geometry::Pose;
use open_structure::storage;
use open_structure::structure::{self, FactorGraph, Frame as FrameRow, FrameId, PoseRow, TABLES, table_info};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::column::Column;
use crate::errors;
use crate::estimate;
use crate::frame::Frame;
use crate::frames::{FrameIterator, Frames};
use crate::json;
use crate::sent::Sent;
use crate::table::Table;
use crate::validate;
use crate::work;

/// Where the rows of a sequence are.
#[derive(Clone)]
pub(crate) enum Source {
    /// In a file or folder, read when they are asked for.
    File(Arc<SequenceReader>),
    /// In memory.
    Memory(Arc<structure::Sequence>),
}

/// A sequence: measurements of a camera's way, and what estimators made of them.
///
/// ``Sequence.open`` opens an MCAP file or a Parquet folder; tables are read when they are asked for. The functions of this
/// package give sequences in memory, which ``write`` stores. A sequence never changes. One that was opened can be pickled: other
/// processes open it themselves.
#[pyclass(frozen, module = "open_structure")]
pub(crate) struct Sequence {
    source: Source,
    summary: Option<serde_json::Value>,
}

impl Sequence {
    /// A sequence that a step made, and what it says of itself.
    pub(crate) fn made(sequence: structure::Sequence, summary: serde_json::Value) -> Self {
        Self { source: Source::Memory(Arc::new(sequence)), summary: Some(summary) }
    }

    fn opened(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        // The program may go to another folder later on.
        let path = if storage::is_url(&path) {
            path
        } else {
            std::path::absolute(&path).map_err(|cause| errors::system(&path, &cause))?
        };
        let reader = work::run(py, errors::of_format, |_| format::open(&path))?;
        Ok(Self { source: Source::File(Arc::new(reader)), summary: None })
    }

    fn kept_manifest(&self) -> &structure::Manifest {
        match &self.source {
            Source::File(reader) => reader.manifest(),
            Source::Memory(sequence) => &sequence.manifest,
        }
    }

    /// The rows in memory; what this version does not know is left behind, and told.
    pub(crate) fn in_memory(&self, py: Python<'_>) -> PyResult<Arc<structure::Sequence>> {
        match &self.source {
            Source::Memory(sequence) => Ok(Arc::clone(sequence)),
            Source::File(reader) => {
                tell_left_behind(py, reader)?;
                work::run(py, errors::of_format, |_| reader.read_all()).map(Arc::new)
            }
        }
    }

    /// Rows of one table.
    fn rows<R: structure::Record>(&self, py: Python<'_>) -> PyResult<Vec<R>> {
        match &self.source {
            Source::File(reader) => work::run(py, errors::of_format, |_| reader.table::<R>()),
            Source::Memory(sequence) => Ok(R::rows(sequence).to_vec()),
        }
    }

    pub(crate) fn frame_list(&self, py: Python<'_>) -> PyResult<Vec<FrameRow>> {
        match &self.source {
            Source::File(reader) => {
                work::run(py, errors::of_format, |_| reader.frame_list().map(<[FrameRow]>::to_vec))
            }
            Source::Memory(sequence) => Ok(sequence.frames.clone()),
        }
    }

    pub(crate) fn source(&self) -> &Source {
        &self.source
    }

    /// What the sequence is called in tables of results, as `os evaluate` calls it.
    pub(crate) fn title(&self) -> String {
        match &self.source {
            Source::Memory(sequence) => sequence.manifest.name.clone(),
            Source::File(reader) => reader.file_name(),
        }
    }
}

#[pymethods]
impl Sequence {
    /// Opens a sequence: an MCAP file (``box1.mcap``) or a Parquet folder (``box1``).
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::opened(py, path)
    }

    /// Where the sequence lies: a path, or a URL as ``str``; ``None`` for one in memory.
    #[getter]
    fn path<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        match &self.source {
            // A `Path` of Python would take the second slash from a URL.
            Source::File(reader) if storage::is_url(reader.path()) => {
                Ok(Some(reader.path().as_os_str().into_pyobject(py)?.into_any()))
            }
            Source::File(reader) => Ok(Some(reader.path().into_pyobject(py)?.into_any())),
            Source::Memory(_) => Ok(None),
        }
    }

    /// Name of the sequence.
    #[getter]
    fn name(&self) -> &str {
        &self.kept_manifest().name
    }

    /// What is said about the sequence as a whole: its origin, its maker, its conventions, its cameras, its noise.
    #[getter]
    fn manifest<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, self.kept_manifest())
    }

    /// The cameras of the manifest: ``camera_id``, ``width``, ``height``, ``fx``, ``fy``, ``cx``, ``cy`` in pixels and more.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, &self.kept_manifest().cameras)
    }

    /// What the step that made the sequence says of itself, as ``os STEP --json`` prints it; ``None`` for one that was opened.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.summary.as_ref().map(|summary| json::to_python(py, summary)).transpose()
    }

    /// Names of the tables that are there, in the order of the specification.
    #[getter]
    fn tables(&self) -> Vec<&'static str> {
        match &self.source {
            Source::File(reader) => reader.tables().iter().map(|stored| stored.table.name).collect(),
            Source::Memory(sequence) => {
                let count = |table: &'static structure::TableInfo| {
                    format::record_batch_of(sequence, table).map_or(0, |rows| rows.num_rows())
                };
                let there = |table: &'static structure::TableInfo| table.name == "frames" || count(table) > 0;
                TABLES.iter().filter(|table| there(table)).map(|table| table.name).collect()
            }
        }
    }

    /// Names of the estimates, sorted: those of trajectories and of maps.
    #[getter]
    fn estimates(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let mut names: Vec<String> =
            self.rows::<structure::TrajectoryPose>(py)?.into_iter().map(|row| row.estimate).collect();
        names.extend(self.rows::<structure::MapPoint>(py)?.into_iter().map(|row| row.estimate));
        names.extend(self.rows::<structure::MapLine>(py)?.into_iter().map(|row| row.estimate));
        names.sort_unstable();
        names.dedup();
        Ok(names)
    }

    /// Names of the factor graphs, sorted.
    #[getter]
    fn graphs(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let graphs = structure::Sequence {
            graph_poses: self.rows(py)?,
            graph_points: self.rows(py)?,
            graph_lines: self.rows(py)?,
            graph_factors: self.rows(py)?,
            ..structure::Sequence::default()
        };
        Ok(FactorGraph::names(&graphs).into_iter().collect())
    }

    /// One table, whole; without rows where the sequence does not have it.
    ///
    /// The names are those of the specification, such as ``point_measurements``.
    fn table(&self, py: Python<'_>, name: &str) -> PyResult<Table> {
        let Some(table) = table_info(name) else {
            let known: Vec<&str> = TABLES.iter().map(|table| table.name).collect();
            return Err(errors::option(format!("expected one of {}, found {name:?}", known.join(", "))));
        };
        let batch = match &self.source {
            Source::File(reader) => work::run(py, errors::of_format, |_| reader.record_batch(table))?,
            Source::Memory(sequence) => {
                work::run(py, errors::of_format, |_| format::record_batch_of(sequence, table))?
            }
        };
        Ok(Table::new(name, batch))
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Table> {
        match table_info(name) {
            Some(_) => self.table(py, name),
            None => Err(PyKeyError::new_err(name.to_owned())),
        }
    }

    // A sequence never changes, so a copy is the same.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, memo: &Bound<'_, PyAny>) -> Py<Self> {
        let _ = memo;
        slf
    }

    /// Every frame in order, with its rows; looks like a list.
    #[getter]
    fn frames(slf: Bound<'_, Self>) -> PyResult<Frames> {
        let rows = slf.get().frame_list(slf.py())?;
        Ok(Frames::new(slf.unbind(), rows.into_iter().map(|frame| frame.frame_id).collect()))
    }

    fn __contains__(&self, table: &Bound<'_, PyAny>) -> bool {
        table.extract::<String>().is_ok_and(|table| self.tables().contains(&table.as_str()))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.frame_list(py)?.len())
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<FrameIterator> {
        FrameIterator::new(py, &self.source)
    }

    /// One frame with its rows, by its id; ``KeyError`` where there is none.
    pub(crate) fn frame(&self, py: Python<'_>, frame_id: i64) -> PyResult<Frame> {
        let id = FrameId(frame_id);
        let bundle = match &self.source {
            Source::File(reader) => work::run(py, errors::of_format, |_| reader.frame(id))?,
            Source::Memory(sequence) => crate::frames::bundle_of(sequence, id),
        };
        bundle.map(Frame::new).ok_or_else(|| PyKeyError::new_err(frame_id))
    }

    /// A path: ids of frames (N,), and their poses ``world_from_camera`` as matrices (N, 4, 4), metres.
    ///
    /// * ``name``: an estimate, or ``truth``; frames without a true pose are left out then.
    #[pyo3(signature = (name = "truth"))]
    fn poses<'py>(&self, py: Python<'py>, name: &str) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let rows: Vec<(FrameId, PoseRow)> = if name == "truth" {
            let frames = self.frame_list(py)?;
            frames.iter().filter_map(|frame| Some((frame.frame_id, frame.world_from_camera()?))).collect()
        } else {
            let rows = self.rows::<structure::TrajectoryPose>(py)?;
            let rows: Vec<_> = rows
                .iter()
                .filter(|row| row.estimate == name)
                .map(|row| (row.frame_id, row.world_from_camera()))
                .collect();
            if rows.is_empty() {
                return Err(errors::option(format!(
                    "expected an estimate {name}, found {}",
                    self.estimates(py)?.join(", ")
                )));
            }
            rows
        };
        let mut numbers = Vec::with_capacity(16 * rows.len());
        for (frame, row) in &rows {
            let pose = row.pose().map_err(|cause| errors::step(format!("{name}, {frame}: {cause}")))?;
            numbers.extend(matrix(&pose));
        }
        let ids = rows.iter().map(|(frame, _)| frame.0);
        let ids = Column::as_numpy(py, Arc::new(arrow::array::Int64Array::from_iter_values(ids)))?;
        let count = numbers.len() / 16;
        let poses = Column::as_numpy(py, Arc::new(arrow::array::Float64Array::from(numbers)))?;
        Ok((ids, poses.call_method1("reshape", (count, 4, 4))?))
    }

    /// Writes the sequence, as an MCAP file where the name ends in ``.mcap``, else as a Parquet folder; gives what was written.
    ///
    /// * ``force``: replace what is there.
    /// * ``foxglove``: add channels that viewers show (MCAP alone).
    #[pyo3(signature = (path, *, force = false, foxglove = false))]
    pub(crate) fn write(&self, py: Python<'_>, path: PathBuf, force: bool, foxglove: bool) -> PyResult<Self> {
        if foxglove && format::Encoding::of_output(&path) != format::Encoding::Mcap {
            return Err(errors::option(format!(
                "foxglove adds channels to an MCAP file; {} would be a Parquet folder",
                path.display()
            )));
        }
        let options = WriteOptions { force, foxglove, ..WriteOptions::default() };
        match &self.source {
            Source::File(reader) => {
                refuse_itself(py, reader.path(), &path)?;
                tell_left_behind(py, reader)?;
                work::run(py, errors::of_format, |watch| {
                    format::copy(reader, &path, options, &|_, _| watch.progress())
                })?;
            }
            Source::Memory(sequence) => {
                work::run(py, errors::of_format, |_| {
                    let mut sequence = structure::Sequence::clone(sequence);
                    structure::registry::SPEC_VERSION.clone_into(&mut sequence.manifest.spec_version);
                    sequence.manifest.tables.clear();
                    format::write(&path, &sequence, options)
                })?;
            }
        }
        Self::opened(py, path)
    }

    /// Holds the sequence against every rule of the specification; gives a report with its findings.
    ///
    /// * ``max_findings``: findings listed of each rule in each table; all are counted.
    #[pyo3(signature = (*, max_findings = 5))]
    fn validate<'py>(&self, py: Python<'py>, max_findings: usize) -> PyResult<Bound<'py, PyAny>> {
        validate::of_source(py, &self.source, max_findings)
    }

    /// The sequence with an estimate of yours: a path, a map, or both.
    ///
    /// * ``name``: what the estimate is called; the registry has names that are taken.
    /// * ``poses``: ids of frames (N,) with ``world_from_camera`` as matrices (N, 4, 4) or (N, 3, 4), or as translation and
    ///   quaternion tx, ty, tz, qx, qy, qz, qw (N, 7), metres; or a table or mapping with the columns of ``trajectories``.
    /// * ``points``: ids (N,) with positions (N, 3) in ``world``, metres; or the columns of ``map_points``.
    /// * ``lines``: ids (N,) with both ends (N, 2, 3) or (N, 6) in ``world``, metres; or the columns of ``map_lines``.
    /// * ``replace``: replace an estimate of the same name.
    ///
    /// Frames have to be those of the sequence, numbers finite, and rotations of unit length within 1e-3.
    #[pyo3(signature = (name, poses = None, *, points = None, lines = None, replace = false))]
    fn with_estimate(
        &self,
        py: Python<'_>,
        name: &str,
        poses: Option<&Bound<'_, PyAny>>,
        points: Option<&Bound<'_, PyAny>>,
        lines: Option<&Bound<'_, PyAny>>,
        replace: bool,
    ) -> PyResult<Self> {
        let entered = estimate::packed(py, name, poses, points, lines)?;
        estimate::enter(py, &*self.in_memory(py)?, entered, replace)
    }

    fn __repr__(&self) -> String {
        match &self.source {
            Source::File(reader) => format!("<Sequence {} at {}>", self.name(), reader.path().display()),
            Source::Memory(_) => format!("<Sequence {} in memory>", self.name()),
        }
    }

    /// Sent to another process, a sequence is its path, and is opened there; one in memory has none.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Sent<'py, (OsString,)> {
        let Source::File(reader) = &self.source else {
            return Err(PyTypeError::new_err(
                "a sequence in memory cannot be sent to another process; send what `write` gives instead",
            ));
        };
        Ok((py.get_type::<Self>().getattr("open")?, (reader.path().as_os_str().to_owned(),)))
    }

    /// The names of the tables, for completion by editors: ``sequence["frames"]``.
    fn _ipython_key_completions_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.tables())
    }
}

/// A pose as a matrix, row by row.
pub(crate) fn matrix(pose: &Pose) -> [f64; 16] {
    let (rotation, [x, y, z]) = (pose.rotation_matrix(), pose.components().0);
    let row = |row: usize, last: f64| [rotation[(row, 0)], rotation[(row, 1)], rotation[(row, 2)], last];
    let rows = [row(0, x), row(1, y), row(2, z), [0.0, 0.0, 0.0, 1.0]];
    std::array::from_fn(|place| rows[place / 4][place % 4])
}

/// Refuses an output that is the input itself.
fn refuse_itself(py: Python<'_>, input: &Path, output: &Path) -> PyResult<()> {
    work::run(py, errors::option, |_| {
        if storage::exists(output) && storage::holds(output, input) {
            return Err(format!("{}: is the input itself, or holds it", output.display()));
        }
        Ok(())
    })
}

/// Warns of what this version does not know, and so does not copy.
fn tell_left_behind(py: Python<'_>, reader: &SequenceReader) -> PyResult<()> {
    let columns = reader.tables().into_iter().flat_map(|stored| {
        let table = stored.table.name;
        stored.unknown_columns.into_iter().map(move |column| format!("column {column} of {table}"))
    });
    for name in reader.passed_over().iter().cloned().chain(columns) {
        let text = format!("{name} is not known to this version and is not copied");
        py.import("warnings")?.call_method1("warn", (text,))?;
    }
    Ok(())
}
