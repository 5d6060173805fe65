//! Counting what each frame sees: the paper's statistical analysis.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::Vector3;

use super::cells::{self, ImageCells};
use super::{
    Camera, CameraId, Frame, FrameBundle, FrameStatistics, GroupId, LineId, Sequence, StructuralGroup,
};
use crate::geometry::{PinholeCamera, Pose};

/// Side of a cell, pixels (paper, section II-B).
pub const CELL_SIZE_PX: f64 = 10.0;

/// Counts what frames see, one at a time.
///
/// Measurements are counted; observations where the sequence has no measurement of the kind. A cell is
/// occupied when a point or an end of a segment lies in it, and covered when a point or any part of a segment
/// does; cells are aligned with the image's origin. A line that is in no group adds no constraint.
///
/// # Source
/// Open-Structure (Li et al. 2024), section II-B.
#[derive(Clone, Debug)]
pub struct FrameCounter {
    groups_of: HashMap<LineId, Vec<GroupId>>,
    cameras: HashMap<CameraId, (PinholeCamera, Option<ImageCells>)>,
    measured_points: bool,
    measured_lines: bool,
}

impl FrameCounter {
    /// A counter for the frames of one sequence.
    ///
    /// * `cameras` — those of the manifest; frames of other cameras have no covered cells and no parallax.
    /// * `measured_points`, `measured_lines` — whether the sequence has any measurement of the kind;
    ///   observations are counted where it has none.
    #[must_use]
    pub fn new(
        groups: &[StructuralGroup],
        cameras: &[Camera],
        measured_points: bool,
        measured_lines: bool,
    ) -> Self {
        let mut groups_of: HashMap<LineId, Vec<GroupId>> = HashMap::new();
        // What is made of groups ties no line that they do not tie.
        for group in groups.iter().filter(|group| !group.is_made_of_groups()) {
            for line in &group.line_ids {
                groups_of.entry(*line).or_default().push(group.group_id);
            }
        }
        let cameras = cameras
            .iter()
            .map(|camera| {
                (camera.camera_id, (camera.projection(), ImageCells::new(camera.width, camera.height)))
            })
            .collect();
        Self { groups_of, cameras, measured_points, measured_lines }
    }

    /// Statistics of a frame.
    ///
    /// * `previous` — the frame before it in the table `frames`, with its rows; `None` for the first.
    #[must_use]
    pub fn count(&self, previous: Option<&FrameBundle>, frame: &FrameBundle) -> FrameStatistics {
        let camera = self.cameras.get(&frame.frame.camera_id);
        let mut tally = Tally { image: camera.and_then(|camera| camera.1.clone()), ..Tally::default() };
        let points = self.points(frame);
        for (_, pixel) in &points {
            tally.point(*pixel);
        }
        let mut lines = Vec::new();
        self.each_line(frame, |line, start, end| {
            tally.line(start, end);
            for group in self.groups_of.get(&line).into_iter().flatten() {
                *tally.groups.entry(*group).or_default() += 1;
            }
            lines.push((line, ()));
        });
        let count = |number: usize| i64::try_from(number).unwrap_or(i64::MAX);
        let mut statistics = FrameStatistics {
            frame_id: frame.frame.frame_id,
            point_count: count(points.len()),
            line_count: count(lines.len()),
            occupied_cells: count(tally.cells.len()),
            structural_constraints: tally.groups.values().map(|lines| lines - 1).sum(),
            covered_cells: tally.image.map(|image| count(image.covered())),
            ..FrameStatistics::default()
        };
        let Some(previous) = previous else { return statistics };
        let mut lines_before = Vec::new();
        self.each_line(previous, |line, _, _| lines_before.push((line, ())));
        statistics.lines_shared_with_previous = Some(count(shared(lines_before, lines).len()));
        let shared_points = shared(self.points(previous), points);
        statistics.points_shared_with_previous = Some(count(shared_points.len()));
        let poses = [previous, frame].map(|bundle| world_from_camera(&bundle.frame));
        let [Some(before), Some(here)] = poses else { return statistics };
        (statistics.rotation_since_previous, statistics.translation_since_previous) = motion(&before, &here);
        let before_camera = self.cameras.get(&previous.frame.camera_id);
        if let (Some((before_camera, _)), Some((camera, _))) = (before_camera, camera) {
            let mut angles: Vec<f64> = shared_points
                .into_iter()
                .map(|(from, to)| {
                    let from = before.rotation() * ray(before_camera, from);
                    angle(&from, &(here.rotation() * ray(camera, to)))
                })
                .collect();
            statistics.median_parallax_to_previous = median(&mut angles);
        }
        statistics
    }

    /// Points of a frame that count, with their pixels.
    fn points(&self, frame: &FrameBundle) -> Vec<(super::PointId, [f64; 2])> {
        macro_rules! points {
            ($rows:expr) => {
                $rows.iter().map(|row| (row.point_id, [row.u, row.v])).collect()
            };
        }
        if self.measured_points {
            points!(frame.point_measurements)
        } else {
            points!(frame.point_observations)
        }
    }

    /// Visits the lines of a frame that count, with their ends.
    fn each_line(&self, frame: &FrameBundle, mut visit: impl FnMut(LineId, [f64; 2], [f64; 2])) {
        macro_rules! lines {
            ($rows:expr) => {
                for row in $rows {
                    visit(row.line_id, [row.start_u, row.start_v], [row.end_u, row.end_v]);
                }
            };
        }
        if self.measured_lines {
            lines!(&frame.line_measurements);
        } else {
            lines!(&frame.line_observations);
        }
    }
}

#[derive(Default)]
struct Tally {
    cells: HashSet<(i64, i64)>,
    image: Option<ImageCells>,
    groups: BTreeMap<GroupId, i64>,
}

impl Tally {
    fn occupy(&mut self, [u, v]: [f64; 2]) {
        self.cells.insert((cells::index(u), cells::index(v)));
    }

    fn point(&mut self, pixel: [f64; 2]) {
        self.occupy(pixel);
        if let Some(image) = &mut self.image {
            image.cover_point(pixel);
        }
    }

    fn line(&mut self, start: [f64; 2], end: [f64; 2]) {
        self.occupy(start);
        self.occupy(end);
        if let Some(image) = &mut self.image {
            image.cover_segment(start, end);
        }
    }
}

/// The true pose of a frame; `None` where it is not known or is none.
fn world_from_camera(frame: &Frame) -> Option<Pose> {
    frame.world_from_camera()?.pose().ok()
}

/// Angle (radians) and distance (metres) between two poses; `None` for what is not finite.
fn motion(before: &Pose, here: &Pose) -> (Option<f64>, Option<f64>) {
    let finite = |number: f64| Some(number).filter(|number| number.is_finite());
    let turn = Pose::new(before.rotation().inverse() * here.rotation(), Vector3::zeros());
    (finite(turn.rotation_angle()), finite((here.translation() - before.translation()).norm()))
}

/// The direction in which a pixel looks, in the camera, of any length.
pub(crate) fn ray(camera: &PinholeCamera, [u, v]: [f64; 2]) -> Vector3<f64> {
    Vector3::new((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0)
}

/// Angle between two directions, radians in `[0, π]`.
pub(crate) fn angle(one: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    libm::atan2(one.cross(other).norm(), one.dot(other))
}

/// The values of those names that are in both lists; of a name that comes twice in one, its first value.
pub(crate) fn shared<N: Ord, T: Copy>(mut one: Vec<(N, T)>, mut other: Vec<(N, T)>) -> Vec<(T, T)> {
    for list in [&mut one, &mut other] {
        if !list.is_sorted_by(|a, b| a.0 < b.0) {
            list.sort_by(|a, b| a.0.cmp(&b.0));
            list.dedup_by(|a, b| a.0 == b.0);
        }
    }
    let mut other = other.into_iter().peekable();
    one.into_iter()
        .filter_map(|(name, value)| {
            while other.next_if(|(next, _)| *next < name).is_some() {}
            other.next_if(|(next, _)| *next == name).map(|(_, found)| (value, found))
        })
        .collect()
}

/// The median of the finite numbers, the mean of the middle two where their count is even; `None` without any.
pub(crate) fn median(numbers: &mut Vec<f64>) -> Option<f64> {
    numbers.retain(|number| number.is_finite());
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    let high = numbers.get(middle)?;
    Some(if numbers.len().is_multiple_of(2) { 0.5 * (numbers[middle - 1] + high) } else { *high })
}

/// Statistics of every frame of a sequence, in table order; see [`FrameCounter`].
#[must_use]
pub fn frame_statistics(sequence: &Sequence) -> Vec<FrameStatistics> {
    let counter = FrameCounter::new(
        &sequence.structural_groups,
        &sequence.manifest.cameras,
        !sequence.point_measurements.is_empty(),
        !sequence.line_measurements.is_empty(),
    );
    let mut previous: Option<FrameBundle> = None;
    sequence
        .bundles()
        .map(|frame| {
            let statistics = counter.count(previous.as_ref(), &frame);
            previous = Some(frame);
            statistics
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{FrameId, LineMeasurement, PointId, PointMeasurement, PoseRow, registry};
    use proptest::prelude::*;

    const CAMERA: PinholeCamera =
        PinholeCamera { fx: 500.0, fy: 480.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };

    fn counter() -> FrameCounter {
        FrameCounter::new(&[], &[Camera::pinhole(CameraId(0), &CAMERA, registry::PIXEL_CENTER)], true, true)
    }

    /// A frame at (x, 0, 0), turned about y, that looks at points 2 m ahead.
    fn frame(id: i64, x: f64, turn: f64, points: &[(i64, [f64; 2])]) -> FrameBundle {
        let rotation_xyzw = [0.0, (0.5 * turn).sin(), 0.0, (0.5 * turn).cos()];
        let pose = PoseRow { translation: [x, 0.0, 0.0], rotation_xyzw };
        let frame_id = FrameId(id);
        let point_measurements = points
            .iter()
            .map(|(id, [u, v])| PointMeasurement {
                frame_id,
                point_id: PointId(*id),
                u: *u,
                v: *v,
                depth: None,
            })
            .collect();
        FrameBundle {
            frame: Frame::new(frame_id, 0, CameraId(0), Some(pose)),
            point_measurements,
            ..FrameBundle::default()
        }
    }

    proptest! {
        #[test]
        fn motion_is_the_angle_and_the_distance_by_which_the_camera_moved(
            turn in -3.0..3.0_f64, x in -100.0..100.0_f64,
        ) {
            let counted = counter().count(Some(&frame(0, 1.0, 0.2, &[])), &frame(1, 1.0 + x, 0.2 + turn, &[]));
            // Rounding of a few products of numbers near one, and of sums of lengths of up to 100 m.
            prop_assert!((counted.rotation_since_previous.unwrap() - turn.abs()).abs() < 1e-14);
            prop_assert!((counted.translation_since_previous.unwrap() - x.abs()).abs() < 1e-13);
        }

        #[test]
        fn a_camera_that_only_turns_sees_no_parallax(turn in -0.5..0.5_f64) {
            let seen = CAMERA.project(nalgebra::Point3::new(turn.tan(), 0.0, 1.0)).unwrap();
            let (before, here) =
                (frame(0, 0.0, turn, &[(3, [320.0, 240.0])]), frame(1, 0.0, 0.0, &[(3, [seen.x, seen.y])]));
            // An angle from a cross product of unit rays is good to rounding.
            prop_assert!(counter().count(Some(&before), &here).median_parallax_to_previous.unwrap() < 1e-14);
        }
    }

    #[test]
    fn parallax_is_the_angle_under_which_a_point_sees_both_cameras() {
        // A point 2 m ahead of the first camera, which then moves 1 m aside.
        let before = frame(0, 0.0, 0.0, &[(3, [320.0, 240.0]), (4, [0.0, 0.0])]);
        let here = frame(1, 1.0, 0.0, &[(1, [5.0, 5.0]), (3, [70.0, 240.0])]);
        let counted = counter().count(Some(&before), &here);
        assert!((counted.median_parallax_to_previous.unwrap() - 0.5_f64.atan()).abs() < 1e-15);
        assert_eq!(counted.points_shared_with_previous, Some(1));
        assert_eq!(counted.lines_shared_with_previous, Some(0));
    }

    #[test]
    fn what_is_not_known_is_absent() {
        let mut before = frame(0, 0.0, 0.0, &[(3, [1.0, 1.0])]);
        let mut here = frame(1, 1.0, 0.0, &[(3, [2.0, 2.0])]);
        let first = counter().count(None, &here);
        assert_eq!((first.points_shared_with_previous, first.rotation_since_previous), (None, None));
        assert_eq!(first.covered_cells, Some(1));
        before.frame.world_from_camera_qx = None;
        let counted = counter().count(Some(&before), &here);
        assert_eq!(counted.points_shared_with_previous, Some(1));
        assert_eq!((counted.rotation_since_previous, counted.translation_since_previous), (None, None));
        assert_eq!(counted.median_parallax_to_previous, None);
        here.frame.camera_id = CameraId(9);
        assert_eq!(counter().count(None, &here).covered_cells, None);
    }

    #[test]
    fn ends_occupy_and_the_whole_segment_covers() {
        let mut here = frame(0, 0.0, 0.0, &[(0, [25.0, 5.0]), (1, [-5.0, 5.0])]);
        here.line_measurements = vec![LineMeasurement {
            start_u: 5.0,
            start_v: 5.0,
            end_u: 45.0,
            end_v: 5.0,
            ..LineMeasurement::default()
        }];
        let counted = counter().count(None, &here);
        // Ends, the point on the segment, the point outside the image; five cells of the segment, the second with the point.
        assert_eq!((counted.occupied_cells, counted.covered_cells), (4, Some(5)));
    }

    #[test]
    fn rows_out_of_order_and_twice_are_shared_once() {
        assert_eq!(
            shared(vec![(3, 'a'), (1, 'b'), (3, 'c')], vec![(3, 'd'), (2, 'e'), (3, 'f')]),
            [('a', 'd')]
        );
        assert_eq!(shared(vec![(1, 'a'), (2, 'b')], vec![(1, 'c'), (2, 'd')]), [('a', 'c'), ('b', 'd')]);
    }

    #[test]
    fn a_median_of_an_even_number_is_the_mean_of_the_middle_two() {
        assert_eq!(median(&mut vec![5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&mut vec![4.0, 1.0, f64::NAN, 3.0, 9.0]), Some(3.5));
        assert_eq!(median(&mut vec![f64::NAN]), None);
    }
}
