//! A path and a map under one name: what is compared with another of its kind.

use std::fmt::Display;

use nalgebra::Point3;

use super::Error;
use crate::geometry::{Pose, Segment};
use crate::structure::{
    Estimate, Frame, FrameId, LineId, LineLandmark, MapLine, MapPoint, PointId, PointLandmark, PoseRow,
    TrajectoryPose,
};

/// A path and a map: the truth or an estimate, by ascending ids, each id once, all numbers finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reconstruction {
    name: String,
    poses: Vec<(FrameId, Pose)>,
    points: Vec<(PointId, Point3<f64>)>,
    lines: Vec<(LineId, Segment)>,
}

impl Reconstruction {
    /// The name under which the truth of a sequence is a reference.
    pub const TRUTH: &'static str = "truth";

    /// The true poses, points and lines of a sequence; frames without a true pose are left out.
    ///
    /// # Errors
    /// [`Error::Twice`], [`Error::NotFinite`] and [`Error::NoPose`] for rows that cannot be compared.
    pub fn truth(frames: &[Frame], points: &[PointLandmark], lines: &[LineLandmark]) -> Result<Self, Error> {
        Self::new(
            Self::TRUTH,
            frames.iter().filter_map(|frame| Some((frame.frame_id, frame.world_from_camera()?))),
            points.iter().map(|point| (point.point_id, point.position())),
            lines.iter().map(|line| (line.line_id, line.segment())),
        )
    }

    /// The rows of one name among those of all estimates of a sequence.
    ///
    /// # Errors
    /// Those of [`Reconstruction::truth`].
    pub fn named(
        name: &str,
        trajectories: &[TrajectoryPose],
        points: &[MapPoint],
        lines: &[MapLine],
    ) -> Result<Self, Error> {
        Self::new(
            name,
            trajectories
                .iter()
                .filter(|row| row.estimate == name)
                .map(|row| (row.frame_id, row.world_from_camera())),
            points
                .iter()
                .filter(|row| row.estimate == name)
                .map(|row| (row.point_id, Point3::new(row.x, row.y, row.z))),
            lines.iter().filter(|row| row.estimate == name).map(|row| (row.line_id, row.segment())),
        )
    }

    /// What a tracker or an optimiser gave.
    ///
    /// # Errors
    /// Those of [`Reconstruction::truth`].
    pub fn of(estimate: &Estimate) -> Result<Self, Error> {
        Self::new(
            &estimate.name,
            estimate.trajectory.iter().map(|row| (row.frame_id, row.world_from_camera())),
            estimate.points.iter().map(|row| (row.point_id, Point3::new(row.x, row.y, row.z))),
            estimate.lines.iter().map(|row| (row.line_id, row.segment())),
        )
    }

    fn new(
        name: &str,
        poses: impl Iterator<Item = (FrameId, PoseRow)>,
        points: impl Iterator<Item = (PointId, Point3<f64>)>,
        lines: impl Iterator<Item = (LineId, Segment)>,
    ) -> Result<Self, Error> {
        let of = if name == Self::TRUTH { "truth" } else { "estimate" };
        let pose = |(id, row): (FrameId, PoseRow)| match row.pose() {
            Ok(pose) => Ok((id, pose)),
            Err(source) => Err(Error::NoPose { of, id: id.to_string(), source }),
        };
        let poses = poses.map(pose).collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            name: name.to_owned(),
            poses: listed(of, poses, |pose| pose.translation().into())?,
            points: listed(of, points.collect(), |point| point.coords.into())?,
            lines: listed(of, lines.collect(), |line| {
                let (a, b) = (line.start, line.end);
                [a.x, a.y, a.z, b.x, b.y, b.z]
            })?,
        })
    }

    /// Name of the estimate, or [`Reconstruction::TRUTH`].
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Poses, `world_from_camera`, metres.
    #[must_use]
    pub fn poses(&self) -> &[(FrameId, Pose)] {
        &self.poses
    }

    /// Points in `world`, metres.
    #[must_use]
    pub fn points(&self) -> &[(PointId, Point3<f64>)] {
        &self.points
    }

    /// Lines in `world`, metres.
    #[must_use]
    pub fn lines(&self) -> &[(LineId, Segment)] {
        &self.lines
    }
}

/// A list by ascending ids, each id once, all numbers such that their squares are finite.
pub(super) fn listed<I: Copy + Ord + Display, T, const N: usize>(
    of: &'static str,
    mut list: Vec<(I, T)>,
    numbers: impl Fn(&T) -> [f64; N],
) -> Result<Vec<(I, T)>, Error> {
    list.sort_by_key(|(id, _)| *id);
    if let Some(twice) = list.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(Error::Twice { of, id: twice[0].0.to_string() });
    }
    for (id, entry) in &list {
        // A number whose square overflows has no distance either.
        if let Some(found) = numbers(entry).iter().find(|number| !(*number * *number).is_finite()) {
            return Err(Error::NotFinite { of, id: id.to_string(), found: *found });
        }
    }
    Ok(list)
}

/// Entries of two lists by ascending ids that have the same id; how many the first and the second have alone.
pub(super) fn shared<'a, I: Copy + Ord, T>(
    reference: &'a [(I, T)],
    estimate: &'a [(I, T)],
) -> (Vec<(I, &'a T, &'a T)>, usize, usize) {
    let mut both = Vec::with_capacity(reference.len().min(estimate.len()));
    let mut rest = estimate.iter().peekable();
    for (id, one) in reference {
        while rest.next_if(|(other, _)| other < id).is_some() {}
        if let Some((_, other)) = rest.next_if(|(other, _)| other == id) {
            both.push((*id, one, other));
        }
    }
    let (missing, extra) = (reference.len() - both.len(), estimate.len() - both.len());
    (both, missing, extra)
}
