//! A sequence made of images, while its rows are not yet written.

use std::path::Path;

use nalgebra::Point3;
use open_structure::format::{self, Outline, WriteOptions, Written, write_two_pass};
use open_structure::geometry::{Pose, Segment};
use open_structure::structure::{
    Descriptor, Exclusion, Frame, FrameBundle, GroupId, LineId, LineLandmark, LineObservation, Manifest,
    MapLine, PointId, PointLandmark, PointObservation, PoseRow, StructuralGroup, registry,
};

use super::describe::manifest;
use super::first_pass::look;
use super::second_pass::{Landmarks, Seen, SeenLine, find};
use super::{Error, Ledger, Options, Progress};
use crate::associate::{Group, LineCandidate, LineMap, LineOptions, PointCandidate, PointMap, group_lines};
use crate::ordered::ordered;
use crate::rgbd::{self, RawFrame, RawSequence};

/// Frames that are decoded ahead for each thread.
const AHEAD: usize = 2;
/// Rows of frames that are made at once while writing.
const CHUNK: usize = 8;

/// A sequence made of images: landmarks, groups, and what each frame sees of them.
///
/// Observations are made when they are asked for; of each, four bytes are kept, and twenty for a line.
#[derive(Clone, Debug)]
pub struct Generated {
    manifest: Manifest,
    options: Options,
    frames: Vec<Frame>,
    cameras_from_world: Vec<Pose>,
    points: Vec<PointLandmark>,
    segments: Vec<Segment>,
    lines: Vec<LineLandmark>,
    unrefined: Vec<MapLine>,
    groups: Vec<StructuralGroup>,
    seen: Vec<Seen>,
    ledger: Ledger,
}

/// Makes a sequence of the images of a dataset.
///
/// * `name` — of the sequence.
/// * `threads` — that detect; what comes out does not depend on it.
/// * `keep_going` — whether a frame whose images cannot be used is left out and counted, rather than an error.
///
/// # Errors
/// [`Error::Raw`] for an image that cannot be used, [`Error::Nothing`] where no frame or no landmark is left.
pub fn generate(
    raw: &RawSequence,
    name: &str,
    options: &Options,
    threads: usize,
    keep_going: bool,
    progress: &Progress<'_>,
) -> Result<Generated, Error> {
    options.check()?;
    let raw = &options.depth.applied(raw);
    let raster = raw.raster();
    let total = raw.frames.len() as u64;
    let mut ledger = Ledger::default();
    let mut excluded: Vec<Exclusion> = Vec::new();
    let mut points = PointMap::new(options.point_landmarks);
    // Where true poses are off, so is one view of a line from another.
    let fuse_distance_m = options.lines.fuse_distance_m + raw.pose_sigma_m;
    let mut lines = LineMap::new(&LineOptions { fuse_distance_m, ..options.lines.clone() });
    let mut usable: Vec<&RawFrame> = Vec::with_capacity(raw.frames.len());
    ordered(
        raw.frames.len(),
        threads,
        AHEAD * threads,
        |index| look(raw, &raster, options, &raw.frames[index]),
        |index, shown| {
            match shown {
                Ok(shown) => {
                    let frame = u32::try_from(usable.len()).unwrap_or(u32::MAX);
                    ledger.add(&shown.ledger);
                    points.add_frame(frame, &shown.points);
                    lines.add(frame, &shown.lines);
                    usable.push(&raw.frames[index]);
                }
                Err(error) if keep_going => excluded.push(unusable(&raw.frames[index], &error)),
                Err(error) => return Err(error),
            }
            progress("detecting", index as u64 + 1, total);
            Ok::<(), Error>(())
        },
    )?;
    if usable.is_empty() {
        let reason = excluded.first().map_or_else(
            || "the lists name none".to_owned(),
            |first| format!("{}: {}", first.file, first.reason),
        );
        return Err(Error::Nothing { what: "frames", frames: raw.frames.len(), reason });
    }

    let before = points.len() as u64;
    let points = points.finish();
    ledger.leave_out("point landmark that too few frames detect", before - points.len() as u64);
    let before = lines.len() as u64;
    let mut lines = lines.finish();
    lines.retain(|line| line.frames.len() >= options.lines.min_detections.max(1) as usize);
    ledger.leave_out("line landmark that too few frames detect", before.saturating_sub(lines.len() as u64));
    let mut segments: Vec<Segment> = lines.iter().map(|line| line.segment).collect();
    let groups = group_lines(&mut segments, &options.groups);

    let positions: Vec<Point3<f64>> = points.iter().map(|point| point.position).collect();
    let landmarks = Landmarks { points: &positions, lines: &segments };
    let mut seen: Vec<Seen> = Vec::with_capacity(usable.len());
    let total = usable.len() as u64;
    ordered(
        usable.len(),
        threads,
        AHEAD * threads,
        |index| find(raw, &raster, options, usable[index], landmarks),
        |index, found| {
            seen.push(found?);
            progress("finding", index as u64 + 1, total);
            Ok::<(), Error>(())
        },
    )?;
    let found = Found { points, lines, segments, groups, seen };
    found.sequence(raw, name, options, &usable, excluded, ledger)
}

fn unusable(frame: &RawFrame, error: &Error) -> Exclusion {
    // Without the folder, which tells nothing of the dataset and, of an archive, is another each time.
    let (path, reason) = match error {
        Error::Raw(rgbd::Error::Image { path, expected, found }) => {
            (path, format!("expected {expected}, found {found}"))
        }
        Error::Raw(rgbd::Error::Io { path, cause }) => (path, cause.to_string()),
        Error::Detect { path, cause } => (path, cause.to_string()),
        other => (&frame.colour, other.to_string()),
    };
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Exclusion { file, reason, count: 1, first_line: None }
}

/// Landmarks, and who sees them, before those are left out that too few frames see.
struct Found {
    points: Vec<PointCandidate>,
    lines: Vec<LineCandidate>,
    segments: Vec<Segment>,
    groups: Vec<Group>,
    seen: Vec<Seen>,
}

impl Found {
    fn sequence(
        mut self,
        raw: &RawSequence,
        name: &str,
        options: &Options,
        usable: &[&RawFrame],
        excluded: Vec<Exclusion>,
        mut ledger: Ledger,
    ) -> Result<Generated, Error> {
        let points = self.names_of_points(options, &mut ledger);
        let lines = self.names_of_lines(options, &mut ledger);
        for seen in &mut self.seen {
            seen.points = seen.points.iter().filter_map(|place| points[*place as usize]).collect();
            seen.lines = seen
                .lines
                .iter()
                .filter_map(|line| Some(SeenLine { line: lines[line.line as usize]?, ..*line }))
                .collect();
            seen.absent_points = Vec::new();
            seen.points.shrink_to_fit();
            seen.lines.shrink_to_fit();
        }
        let kept = |names: &[Option<u32>], place: usize| names[place].is_some();
        let (mut segments, mut unrefined, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let stay = self.segments.iter().enumerate().filter(|(place, _)| kept(&lines, *place));
        for (line_id, (place, segment)) in (0..).map(LineId).zip(stay) {
            let row = LineLandmark::from_segment(line_id, segment)
                .map_err(|cause| Error::Line { line_id, cause })?;
            rows.push(row);
            segments.push(*segment);
            let before = &self.lines[place].segment;
            unrefined.push(MapLine::new(registry::UNREFINED.to_owned(), line_id, before));
        }
        let points: Vec<PointLandmark> = (0..)
            .zip(self.points.iter().enumerate().filter(|(place, _)| kept(&points, *place)))
            .map(|(id, (_, point))| PointLandmark {
                descriptor: Some(Descriptor(point.descriptor.to_vec())),
                ..PointLandmark::new(PointId(id), point.position)
            })
            .collect();
        if points.is_empty() && rows.is_empty() {
            let most = ledger.left_out.iter().max_by_key(|(_, count)| **count);
            let reason = most.map_or_else(
                || "nothing was detected".to_owned(),
                |(reason, count)| format!("left out most often: {count} times {reason}"),
            );
            return Err(Error::Nothing { what: "landmarks", frames: usable.len(), reason });
        }
        let camera_id = raw.camera.camera_id;
        let frames = usable
            .iter()
            .map(|frame| {
                let (translation, rotation_xyzw) = frame.world_from_camera.components();
                let pose = PoseRow { translation, rotation_xyzw };
                Frame::new(frame.frame_id, frame.stamp_nanos, camera_id, Some(pose))
            })
            .collect();
        // The pose as it is stored, so that a reader finds the very same positions.
        let cameras_from_world = usable.iter().map(|frame| frame.world_from_camera.inverse()).collect();
        Ok(Generated {
            manifest: manifest(raw, name, options, excluded),
            options: options.clone(),
            frames,
            cameras_from_world,
            points,
            segments,
            lines: rows,
            unrefined,
            groups: groups_of(&self.groups, &lines, options.groups.least),
            seen: self.seen,
            ledger,
        })
    }

    /// New names of the points that stay.
    fn names_of_points(&self, options: &Options, ledger: &mut Ledger) -> Vec<Option<u32>> {
        let mut counts = vec![[0_u32; 2]; self.points.len()];
        for seen in &self.seen {
            seen.points.iter().for_each(|place| counts[*place as usize][0] += 1);
            seen.absent_points.iter().for_each(|place| counts[*place as usize][1] += 1);
        }
        let options = &options.point_landmarks;
        let mut next = 0;
        let names = counts.into_iter().map(|[seen, absent]| {
            if f64::from(absent) > options.max_absent * f64::from(seen + absent) {
                ledger.leave_out("point landmark where depth maps show nothing", 1);
            } else if seen < options.min_observations.max(1) {
                ledger.leave_out("point landmark that too few frames see", 1);
            } else {
                next += 1;
                return Some(next - 1);
            }
            None
        });
        names.collect()
    }

    /// New names of the lines that stay.
    fn names_of_lines(&self, options: &Options, ledger: &mut Ledger) -> Vec<Option<u32>> {
        let mut counts = vec![0_u32; self.lines.len()];
        self.seen.iter().flat_map(|seen| &seen.lines).for_each(|seen| counts[seen.line as usize] += 1);
        let mut next = 0;
        let names = counts.into_iter().map(|seen| {
            if seen < options.lines.min_observations.max(1) {
                ledger.leave_out("line landmark that too few frames see", 1);
                return None;
            }
            next += 1;
            Some(next - 1)
        });
        names.collect()
    }
}

/// Groups of the lines that stay.
///
/// Parallel groups that fell below `least` lines are no groups any more, and what was made of them is as long as three are left.
fn groups_of(groups: &[Group], names: &[Option<u32>], least: usize) -> Vec<StructuralGroup> {
    let ids = |group: &Group| {
        let mut ids: Vec<LineId> =
            group.members.iter().filter_map(|place| names[*place]).map(|name| LineId(name.into())).collect();
        ids.sort_unstable();
        ids
    };
    let is_parallel = |group: &&Group| group.kind == registry::PARALLEL;
    let row = |group: &Group, line_ids: Vec<LineId>| StructuralGroup {
        group_id: GroupId(0),
        kind: group.kind.to_owned(),
        direction_x: Some(group.direction.x),
        direction_y: Some(group.direction.y),
        direction_z: Some(group.direction.z),
        line_ids,
    };
    let mut rows: Vec<StructuralGroup> = groups
        .iter()
        .filter(is_parallel)
        .map(|group| row(group, ids(group)))
        .filter(|row| row.line_ids.len() >= least.max(2))
        .collect();
    for group in groups.iter().filter(|group| !is_parallel(group)) {
        let all = ids(group);
        let within = |row: &&StructuralGroup| row.line_ids.iter().all(|id| all.binary_search(id).is_ok());
        let parts: Vec<&StructuralGroup> =
            rows.iter().filter(|row| row.kind == registry::PARALLEL).filter(within).collect();
        let axis_stays = parts.iter().any(|row| row.direction() == Some(group.direction));
        if parts.len() >= 3 && axis_stays {
            let mut line_ids: Vec<LineId> =
                parts.iter().flat_map(|row| row.line_ids.iter().copied()).collect();
            line_ids.sort_unstable();
            rows.push(row(group, line_ids));
        }
    }
    for (id, row) in (0..).zip(&mut rows) {
        row.group_id = GroupId(id);
    }
    rows
}

impl Generated {
    /// What is said about the sequence as a whole.
    #[must_use]
    pub const fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// What became of everything that was detected.
    #[must_use]
    pub const fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// The frames with their true poses.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Points, lines and groups.
    #[must_use]
    pub fn landmarks(&self) -> (&[PointLandmark], &[LineLandmark], &[StructuralGroup]) {
        (&self.points, &self.lines, &self.groups)
    }

    /// Observations of points and of lines.
    #[must_use]
    pub fn observations(&self) -> [u64; 2] {
        let count = |of: fn(&Seen) -> usize| self.seen.iter().map(|seen| of(seen) as u64).sum();
        [count(|seen| seen.points.len()), count(|seen| seen.lines.len())]
    }

    /// A frame with its rows; `None` past the last.
    ///
    /// Observations are the projections of the landmarks, measurements are drawn from them as `os measure` draws them.
    #[must_use]
    pub fn frame(&self, index: usize) -> Option<FrameBundle> {
        let (frame, seen) = (self.frames.get(index)?, self.seen.get(index)?);
        let camera = self.manifest.camera(frame.camera_id)?;
        let (projection, camera_from_world) = (camera.projection(), &self.cameras_from_world[index]);
        let frame_id = frame.frame_id;
        let project = |point: Point3<f64>| {
            let in_camera = camera_from_world * point;
            Some((projection.project(in_camera)?, in_camera.z))
        };
        let point_observations: Vec<PointObservation> = seen
            .points
            .iter()
            .filter_map(|place| {
                let landmark = &self.points[*place as usize];
                let (pixel, depth) = project(landmark.position())?;
                let point_id = landmark.point_id;
                Some(PointObservation { frame_id, point_id, u: pixel.x, v: pixel.y, depth: Some(depth) })
            })
            .collect();
        let line_observations: Vec<LineObservation> = seen
            .lines
            .iter()
            .filter_map(|seen| {
                let segment = &self.segments[seen.line as usize];
                let along = segment.end - segment.start;
                let [start, end] = seen.part.map(|part| project(segment.start + along * part));
                let ((start, start_depth), (end, end_depth)) = (start?, end?);
                Some(LineObservation {
                    frame_id,
                    line_id: LineId(seen.line.into()),
                    start_u: start.x,
                    start_v: start.y,
                    start_depth: Some(start_depth),
                    end_u: end.x,
                    end_v: end.y,
                    end_depth: Some(end_depth),
                })
            })
            .collect();
        let (point_measurements, line_measurements) = self.options.noise.measure(
            camera,
            frame_id,
            &point_observations,
            &line_observations,
            self.options.seed,
        );
        Some(FrameBundle {
            frame: frame.clone(),
            point_observations,
            line_observations,
            point_measurements,
            line_measurements,
        })
    }

    /// Writes the sequence.
    ///
    /// # Errors
    /// Those of writing; nothing is left behind then.
    pub fn write(
        &self,
        output: &Path,
        options: WriteOptions,
        progress: &Progress<'_>,
    ) -> Result<Written, format::Error> {
        let outline = Outline { manifest: &self.manifest, frames: &self.frames, groups: &self.groups };
        write_two_pass(
            output,
            outline,
            options,
            |writer| {
                writer.append(&self.points)?;
                writer.append(&self.lines)?;
                writer.append(&self.unrefined)?;
                writer.append(&self.groups)
            },
            || Ok(self.bundles().map(Ok)),
            progress,
        )
    }

    /// Every frame with its rows, in order; made on all cores, a few at a time.
    fn bundles(&self) -> impl Iterator<Item = FrameBundle> + '_ {
        use rayon::prelude::*;
        (0..self.frames.len()).step_by(CHUNK).flat_map(move |begin| {
            let end = (begin + CHUNK).min(self.frames.len());
            (begin..end).into_par_iter().filter_map(|index| self.frame(index)).collect::<Vec<_>>()
        })
    }
}
