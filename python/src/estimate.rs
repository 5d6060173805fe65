//! An estimate of the user's, into a sequence.

use std::path::PathBuf;

use open_structure::stations;
use open_structure::structure::{
    self, Estimate, FrameId, LineId, MapLine, MapPoint, PointId, TrajectoryPose,
};
use pyo3::prelude::*;
use serde_json::json;

use crate::arguments::Given;
use crate::errors;
use crate::sequence::Sequence;
use crate::work;

/// Ids, numbers of so many columns, and covariances, as `open_structure/_estimate.py` packs them.
type Packed = (Vec<u8>, Vec<u8>, Option<Vec<Option<Vec<f64>>>>);

/// Rows of ids with `N` numbers each.
struct Rows<const N: usize> {
    ids: Vec<i64>,
    numbers: Vec<[f64; N]>,
    covariances: Option<Vec<Option<Vec<f64>>>>,
}

impl<const N: usize> Rows<N> {
    /// Has Python pack what the user gave: arrays, tables, mappings.
    fn of(py: Python<'_>, kind: &str, given: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let Some(given) = given else {
            return Ok(Self { ids: Vec::new(), numbers: Vec::new(), covariances: None });
        };
        let packed = py.import("open_structure._estimate")?.call_method1("packed", (kind, given))?;
        let (ids, numbers, covariances): Packed = packed.extract()?;
        let ids: Vec<i64> = words(&ids).map(i64::from_ne_bytes).collect();
        let all: Vec<f64> = words(&numbers).map(f64::from_ne_bytes).collect();
        let numbers: Vec<[f64; N]> = all.as_chunks::<N>().0.to_vec();
        if ids.len() != numbers.len() || covariances.as_ref().is_some_and(|all| all.len() != ids.len()) {
            return Err(errors::internal("packed rows of different lengths"));
        }
        Ok(Self { ids, numbers, covariances })
    }

    /// Makes rows of the ids, the numbers and the covariances.
    fn map<T>(self, row: impl Fn(i64, [f64; N], Option<Vec<f64>>) -> T) -> Vec<T> {
        let mut covariances = self.covariances.into_iter().flatten();
        let both = self.ids.into_iter().zip(self.numbers);
        both.map(|(id, numbers)| row(id, numbers, covariances.next().flatten())).collect()
    }
}

fn words(bytes: &[u8]) -> impl Iterator<Item = [u8; 8]> + '_ {
    bytes.as_chunks::<8>().0.iter().copied()
}

/// A pose as translation and quaternion tx, ty, tz, qx, qy, qz, qw.
pub(crate) fn pose(what: &str, given: &Bound<'_, PyAny>) -> PyResult<[f64; 7]> {
    given.py().import("open_structure._estimate")?.call_method1("pose", (what, given))?.extract()
}

/// An estimate of what the user gave.
pub(crate) fn packed(
    py: Python<'_>,
    name: &str,
    poses: Option<&Bound<'_, PyAny>>,
    points: Option<&Bound<'_, PyAny>>,
    lines: Option<&Bound<'_, PyAny>>,
) -> PyResult<Estimate> {
    let estimate = name.to_owned();
    Ok(Estimate {
        name: name.to_owned(),
        trajectory: Rows::<7>::of(py, "poses", poses)?.map(|id, numbers, covariance| {
            let row = structure::PoseRow::from_numbers(numbers);
            TrajectoryPose { covariance, ..TrajectoryPose::new(estimate.clone(), FrameId(id), row) }
        }),
        points: Rows::<3>::of(py, "points", points)?.map(|id, [x, y, z], covariance| MapPoint {
            estimate: estimate.clone(),
            point_id: PointId(id),
            x,
            y,
            z,
            covariance,
        }),
        lines: Rows::<6>::of(py, "lines", lines)?.map(
            |id, [start_x, start_y, start_z, end_x, end_y, end_z], covariance| MapLine {
                estimate: estimate.clone(),
                line_id: LineId(id),
                start_x,
                start_y,
                start_z,
                end_x,
                end_y,
                end_z,
                covariance,
            },
        ),
        ..Estimate::default()
    })
}

/// A sequence with an estimate in it.
pub(crate) fn enter(
    py: Python<'_>,
    sequence: &structure::Sequence,
    estimate: Estimate,
    replace: bool,
) -> PyResult<Sequence> {
    let summary = json!({
        "estimate": estimate.name, "poses": estimate.trajectory.len(), "points": estimate.points.len(),
        "lines": estimate.lines.len(),
    });
    let made = work::run(py, errors::of_station, |_| stations::enter(sequence.clone(), estimate, replace))?;
    Ok(Sequence::made(made, summary))
}

/// Writes a sequence with an estimate of yours added; gives what was written.
///
/// As ``Sequence.with_estimate``, and then ``write``: the output is the input with the estimate.
///
/// * ``sequence``: the sequence, or where it lies.
/// * ``path``: output: ``NAME.mcap`` for an MCAP file, any other name for a Parquet folder.
/// * ``name``, ``poses``, ``points``, ``lines``, ``replace``: see ``Sequence.with_estimate``.
/// * ``force``: replace the output if it exists.
#[pyfunction]
#[pyo3(signature = (sequence, path, name, poses = None, *, points = None, lines = None, replace = false, force = false))]
#[expect(clippy::too_many_arguments, reason = "the options of a function of Python, by name")]
pub(crate) fn write_estimate(
    py: Python<'_>,
    sequence: Given<'_>,
    path: PathBuf,
    name: &str,
    poses: Option<&Bound<'_, PyAny>>,
    points: Option<&Bound<'_, PyAny>>,
    lines: Option<&Bound<'_, PyAny>>,
    replace: bool,
    force: bool,
) -> PyResult<Sequence> {
    let entered = packed(py, name, poses, points, lines)?;
    let made = enter(py, &*sequence.rows()?, entered, replace)?;
    made.write(py, path, force, false)
}
