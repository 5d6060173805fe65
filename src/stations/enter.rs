//! An estimate that somebody else made, into a sequence.

use std::collections::HashSet;

use super::Error;
use super::named::check_name;
use crate::structure::{Estimate, FrameId, MapLine, MapPoint, Record as _, Sequence, TrajectoryPose};

/// How far the length of a stored quaternion may be from 1: the specification's.
pub const QUATERNION_TOLERANCE: f64 = 1e-3;

/// Puts an estimate into a sequence, after a look at every row.
///
/// Frames have to be those of the sequence, every id stands once, numbers are finite, quaternions have unit length within
/// [`QUATERNION_TOLERANCE`], and the ends of a line lie apart.
///
/// # Errors
/// [`Error::Name`], [`Error::Taken`], [`Error::Missing`] for an estimate without rows, [`Error::Row`] and [`Error::Twice`].
pub fn enter(mut sequence: Sequence, estimate: Estimate, replace: bool) -> Result<Sequence, Error> {
    let taken = Estimate::is_in(&sequence, &estimate.name);
    check_name("an estimate", &estimate.name, taken, replace)?;
    if estimate.trajectory.is_empty() && estimate.points.is_empty() && estimate.lines.is_empty() {
        return Err(Error::Missing {
            missing: "use for an estimate without poses, points and lines",
            remedy: "",
        });
    }
    let frames: HashSet<FrameId> = sequence.frames.iter().map(|frame| frame.frame_id).collect();
    let mut seen = HashSet::new();
    for (row, pose) in estimate.trajectory.iter().enumerate() {
        let table = TrajectoryPose::TABLE.name;
        if !frames.contains(&pose.frame_id) {
            let found = pose.frame_id.to_string();
            return Err(Error::Row { table, row, expected: "a frame of the sequence", found });
        }
        if !seen.insert(pose.frame_id) {
            return Err(Error::Twice { table, row, id: pose.frame_id.to_string() });
        }
        let stored = pose.world_from_camera();
        finite(table, row, &stored.numbers())?;
        let length = stored.rotation_xyzw.iter().map(|part| part * part).sum::<f64>().sqrt();
        // An overflow is further off than anything.
        if (length - 1.0).abs() > QUATERNION_TOLERANCE {
            let expected = "a quaternion of length 1 within 1e-3";
            return Err(Error::Row { table, row, expected, found: format!("length {length:.6}") });
        }
    }
    let mut seen = HashSet::new();
    for (row, point) in estimate.points.iter().enumerate() {
        let table = MapPoint::TABLE.name;
        finite(table, row, &[point.x, point.y, point.z])?;
        if !seen.insert(point.point_id) {
            return Err(Error::Twice { table, row, id: point.point_id.to_string() });
        }
    }
    let mut seen = HashSet::new();
    for (row, line) in estimate.lines.iter().enumerate() {
        let table = MapLine::TABLE.name;
        let segment = line.segment();
        let [start, end] = [segment.start, segment.end];
        finite(table, row, &[start.x, start.y, start.z, end.x, end.y, end.z])?;
        if start == end {
            let expected = "two ends that lie apart";
            return Err(Error::Row {
                table,
                row,
                expected,
                found: format!("twice {:?}", start.coords.as_slice()),
            });
        }
        if !seen.insert(line.line_id) {
            return Err(Error::Twice { table, row, id: line.line_id.to_string() });
        }
    }
    estimate.put(&mut sequence);
    Ok(sequence)
}

fn finite(table: &'static str, row: usize, numbers: &[f64]) -> Result<(), Error> {
    match numbers.iter().find(|number| !number.is_finite()) {
        None => Ok(()),
        Some(found) => Err(Error::Row { table, row, expected: "finite numbers", found: found.to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{CameraId, Frame, PointId, PoseRow};

    fn pose(frame: i64, w: f64) -> TrajectoryPose {
        let row = PoseRow { translation: [0.0; 3], rotation_xyzw: [0.0, 0.0, 0.0, w] };
        TrajectoryPose::new(String::new(), FrameId(frame), row)
    }

    fn entered(trajectory: Vec<TrajectoryPose>, points: Vec<MapPoint>) -> Result<Sequence, String> {
        let frames = (0..3).map(|id| Frame::new(FrameId(id), id, CameraId(0), None)).collect();
        let sequence = Sequence { frames, ..Sequence::default() };
        let estimate = Estimate { name: "mine".to_owned(), trajectory, points, ..Estimate::default() };
        enter(sequence, estimate, false).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_get_the_name_and_their_order() {
        let sequence = entered(vec![pose(2, 1.0), pose(0, -1.0)], Vec::new()).unwrap();
        let found: Vec<_> =
            sequence.trajectories.iter().map(|row| (row.estimate.as_str(), row.frame_id)).collect();
        assert_eq!(found, [("mine", FrameId(0)), ("mine", FrameId(2))]);
        let again =
            Estimate { name: "mine".to_owned(), trajectory: vec![pose(1, 1.0)], ..Estimate::default() };
        assert!(enter(sequence.clone(), again.clone(), false).is_err());
        assert_eq!(enter(sequence, again, true).unwrap().trajectories.len(), 1);
    }

    #[test]
    fn rows_that_no_estimate_can_have_are_refused() {
        let point = |x: f64| MapPoint { point_id: PointId(4), x, ..MapPoint::default() };
        for (trajectory, points, expected) in [
            (
                vec![pose(7, 1.0)],
                vec![],
                "trajectories row 0: expected a frame of the sequence, found frame 7",
            ),
            (vec![pose(1, 1.0), pose(1, 1.0)], vec![], "trajectories row 1: frame 1 stands there twice"),
            (vec![pose(1, 0.9)], vec![], "length 0.900000"),
            (vec![pose(1, f64::NAN)], vec![], "expected finite numbers, found NaN"),
            (vec![], vec![point(f64::INFINITY)], "map_points row 0: expected finite numbers, found inf"),
            (vec![], vec![point(1.0), point(2.0)], "map_points row 1: point 4 stands there twice"),
            (vec![], vec![], "without poses"),
        ] {
            let found = entered(trajectory, points).unwrap_err();
            assert!(found.contains(expected), "{found}");
        }
    }
}
