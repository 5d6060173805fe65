//! `track`: measurements into poses and a map.

use open_structure::geometry::Pose;
use open_structure::stations::{self, TrackRequest};
use open_structure::structure;
use open_structure::track::{Method, Sensor};
use pyo3::prelude::*;

use crate::arguments::{Given, choice};
use crate::errors;
use crate::estimate;
use crate::sequence::Sequence;
use crate::work;

/// What is measured, by name.
#[derive(Clone, Copy)]
enum SensorName {
    Monocular,
    Stereo,
    Rgbd,
}

/// The sequence with the path of its camera and a map, from measurements alone; options as of ``os track``.
///
/// By default outliers are found and left out, poses follow from points and lines by least squares, and landmarks are fused by
/// their covariances, all by the noise that the sequence declares. Ground truth is not looked at, but for the first pose.
/// ``summary`` of what comes back says how many frames were tracked; the table ``tracking`` says it of each.
///
/// * ``method``: ``map-to-frame`` or ``frame-to-frame``.
/// * ``classic``: the paper's plain variant.
/// * ``sensor``: ``monocular``, ``stereo`` or ``rgbd``; by default what the measurements have.
/// * ``baseline``: distance of the two cameras of ``stereo``, metres.
/// * ``first_pose``: ``world_from_camera`` of the first frame, a matrix (4, 4) or seven numbers tx, ty, tz, qx, qy, qz, qw; by default its true
///   one where the sequence has it, else the identity.
/// * ``seed``: seed of random samples.
/// * ``name``: name of the estimate; by default that of the method, with ``-classic`` for ``classic``.
/// * ``replace``: replace an estimate of the same name.
#[pyfunction]
#[pyo3(signature = (sequence, *, method = "map-to-frame", classic = false, sensor = None, baseline = None, first_pose = None, seed = 0, name = None, replace = false))]
#[expect(clippy::too_many_arguments, reason = "the options of a command, by name")]
pub(crate) fn track(
    py: Python<'_>,
    sequence: Given<'_>,
    method: &str,
    classic: bool,
    sensor: Option<&str>,
    baseline: Option<f64>,
    first_pose: Option<&Bound<'_, PyAny>>,
    seed: u64,
    name: Option<String>,
    replace: bool,
) -> PyResult<Sequence> {
    let method = choice(
        "method",
        method,
        &[("frame-to-frame", Method::FrameToFrame), ("map-to-frame", Method::MapToFrame)],
    )?;
    let names =
        [("monocular", SensorName::Monocular), ("stereo", SensorName::Stereo), ("rgbd", SensorName::Rgbd)];
    let sensor = match (sensor.map(|sensor| choice("sensor", sensor, &names)).transpose()?, baseline) {
        (Some(SensorName::Stereo), Some(baseline_m)) => Some(Sensor::Stereo { baseline_m }),
        (Some(SensorName::Stereo), None) => return Err(errors::option("sensor `stereo` takes a baseline")),
        (_, Some(_)) => return Err(errors::option("baseline goes with sensor `stereo`")),
        (Some(SensorName::Monocular), None) => Some(Sensor::Monocular),
        (Some(SensorName::Rgbd), None) => Some(Sensor::Rgbd),
        (None, None) => None,
    };
    let first_pose = first_pose.map(|given| {
        let [tx, ty, tz, qx, qy, qz, qw] = estimate::pose("first_pose", given)?;
        Pose::from_components([tx, ty, tz], [qx, qy, qz, qw])
            .map_err(|cause| errors::option(format!("first_pose: {cause}")))
    });
    let request =
        TrackRequest { method, classic, sensor, first_pose: first_pose.transpose()?, seed, name, replace };
    let input = sequence.rows()?;
    let (made, summary) = work::run(py, errors::of_station, |watch| {
        stations::track(structure::Sequence::clone(&input), &request, &|_, _| watch.progress())
    })?;
    let summary = serde_json::to_value(&summary).map_err(|cause| errors::internal(&cause.to_string()))?;
    Ok(Sequence::made(made, summary))
}
