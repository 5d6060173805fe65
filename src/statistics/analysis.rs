//! Statistics of a sequence, gathered one frame at a time.

use super::covisibility::Covisibility;
use super::difference::Differences;
use super::distribution::{Distribution, track_bins};
use super::sequence_statistics::{FeatureStatistics, MotionStatistics, NoiseStatistics, SequenceStatistics};
use super::widest_parallax::WidestParallax;
use crate::structure::{
    FrameBundle, FrameCounter, FrameStatistics, ImageCells, LineMeasurement, LineObservation, Manifest,
    PointMeasurement, PointObservation, Record, Sequence, StructuralGroup, grade_of, ray, shared,
    typical_rotation,
};

/// Which rows are counted: measurements, or observations where a sequence has no measurement of the kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted {
    /// Whether point measurements are counted.
    pub measured_points: bool,
    /// Whether line measurements are counted.
    pub measured_lines: bool,
}

impl Counted {
    /// What is counted of a sequence in memory.
    #[must_use]
    pub fn of(sequence: &Sequence) -> Self {
        Self {
            measured_points: !sequence.point_measurements.is_empty(),
            measured_lines: !sequence.line_measurements.is_empty(),
        }
    }
}

/// The statistics of a sequence and of each of its frames.
#[derive(Clone, Debug)]
pub struct Analysed {
    /// Of the sequence.
    pub sequence: SequenceStatistics,
    /// Of each frame, in table order.
    pub frames: Vec<FrameStatistics>,
}

/// Gathers the statistics of a sequence, one frame at a time.
///
/// Keeps eight bytes for each row that is counted, and about a hundred for each landmark and each frame.
#[derive(Clone, Debug)]
pub struct Analysis {
    name: String,
    image_cells: Option<u64>,
    cameras: Vec<crate::structure::Camera>,
    counter: FrameCounter,
    counted: Counted,
    previous: Option<FrameBundle>,
    frames: Vec<FrameStatistics>,
    stamps: Vec<i64>,
    points: Covisibility,
    lines: Covisibility,
    /// By index of the point.
    parallax: Vec<Option<WidestParallax>>,
    noise: [Differences; 4],
}

impl Analysis {
    /// An analysis of a sequence whose frames are to come.
    #[must_use]
    pub fn new(manifest: &Manifest, groups: &[StructuralGroup], counted: Counted) -> Self {
        let cameras = &manifest.cameras;
        let sizes = |camera: &crate::structure::Camera| (camera.width, camera.height);
        let alike = cameras.windows(2).all(|pair| sizes(&pair[0]) == sizes(&pair[1]));
        let cells = cameras.first().filter(|_| alike).map(sizes);
        Self {
            name: manifest.name.clone(),
            image_cells: cells
                .and_then(|(width, height)| ImageCells::new(width, height))
                .map(|cells| cells.len() as u64),
            cameras: cameras.clone(),
            counter: FrameCounter::new(groups, cameras, counted.measured_points, counted.measured_lines),
            counted,
            previous: None,
            frames: Vec::new(),
            stamps: Vec::new(),
            points: Covisibility::default(),
            lines: Covisibility::default(),
            parallax: Vec::new(),
            noise: [Differences::default(); 4],
        }
    }

    /// Adds a frame with its rows; frames come in the order of the table `frames`.
    pub fn add(&mut self, frame: FrameBundle) {
        self.frames.push(self.counter.count(self.previous.as_ref(), &frame));
        self.stamps.push(frame.frame.stamp_nanos);
        self.add_points(&frame);
        macro_rules! lines {
            ($rows:expr) => {
                for row in $rows {
                    self.lines.show(row.line_id.0);
                }
            };
        }
        if self.counted.measured_lines {
            lines!(&frame.line_measurements);
        } else {
            lines!(&frame.line_observations);
        }
        self.points.end_frame();
        self.lines.end_frame();
        self.add_noise(&frame);
        self.previous = Some(frame);
    }

    fn add_points(&mut self, frame: &FrameBundle) {
        let camera = self.cameras.iter().find(|camera| camera.camera_id == frame.frame.camera_id);
        let pose = frame.frame.world_from_camera().and_then(|pose| pose.pose().ok());
        let sight = camera.zip(pose).map(|(camera, pose)| (camera.projection(), pose.rotation_matrix()));
        macro_rules! points {
            ($rows:expr) => {
                for row in $rows {
                    let Some(index) = self.points.show(row.point_id.0) else { continue };
                    let Some((camera, rotation)) = &sight else { continue };
                    let ray = rotation * ray(camera, [row.u, row.v]);
                    if !ray.iter().all(|part| part.is_finite()) {
                        continue;
                    }
                    if self.parallax.len() <= index as usize {
                        self.parallax.resize(index as usize + 1, None);
                    }
                    match &mut self.parallax[index as usize] {
                        Some(found) => found.add(ray),
                        none => *none = Some(WidestParallax::new(ray)),
                    }
                }
            };
        }
        if self.counted.measured_points {
            points!(&frame.point_measurements);
        } else {
            points!(&frame.point_observations);
        }
    }

    fn add_noise(&mut self, frame: &FrameBundle) {
        let [point_px, point_depth, line_px, line_depth] = &mut self.noise;
        macro_rules! points {
            ($rows:expr) => {
                $rows.iter().map(|row| (row.point_id, ([row.u, row.v], row.depth))).collect()
            };
        }
        let points = shared(points!(frame.point_measurements), points!(frame.point_observations));
        for ((pixel, depth), (true_pixel, true_depth)) in points {
            point_px.add(pixel[0] - true_pixel[0]);
            point_px.add(pixel[1] - true_pixel[1]);
            if let Some((depth, true_depth)) = depth.zip(true_depth) {
                point_depth.add(depth - true_depth);
            }
        }
        macro_rules! lines {
            ($rows:expr) => {
                $rows
                    .iter()
                    .map(|row| {
                        let start = ([row.start_u, row.start_v], row.start_depth);
                        (row.line_id, [start, ([row.end_u, row.end_v], row.end_depth)])
                    })
                    .collect()
            };
        }
        for (ends, truth) in shared(lines!(frame.line_measurements), lines!(frame.line_observations)) {
            let [start, other_end] = truth;
            let apart =
                |truth: [End; 2]| ends.iter().zip(truth).map(|(end, truth)| square(*end, truth)).sum::<f64>();
            let truth = if apart([other_end, start]) < apart(truth) { [other_end, start] } else { truth };
            for (end, truth_end) in ends.into_iter().zip(truth) {
                line_px.add(distance_from_line(end.0, [start.0, other_end.0]));
                let depths =
                    end.1.zip(truth_end.1).filter(|_| square(end, truth_end) <= SAME_END_PX * SAME_END_PX);
                if let Some((depth, true_depth)) = depths {
                    line_depth.add(depth - true_depth);
                }
            }
        }
    }

    /// What was gathered.
    #[must_use]
    pub fn finish(self) -> Analysed {
        let of = |number: fn(&FrameStatistics) -> i64| {
            Distribution::new(self.frames.iter().map(|frame| number(frame) as f64))
        };
        let span = self.stamps.iter().max().zip(self.stamps.iter().min());
        let sequence = SequenceStatistics {
            name: self.name,
            frame_count: self.frames.len() as u64,
            duration_seconds: span.map_or(0.0, |(last, first)| last.saturating_sub(*first) as f64 * 1e-9),
            points: features(
                if self.counted.measured_points { PointMeasurement::TABLE } else { PointObservation::TABLE }
                    .name,
                of(|frame| frame.point_count),
                &self.points,
            ),
            lines: features(
                if self.counted.measured_lines { LineMeasurement::TABLE } else { LineObservation::TABLE }
                    .name,
                of(|frame| frame.line_count),
                &self.lines,
            ),
            occupied_cells: of(|frame| frame.occupied_cells),
            covered_cells: Distribution::new(
                self.frames.iter().filter_map(|frame| frame.covered_cells).map(|cells| cells as f64),
            ),
            image_cells: self.image_cells,
            structural_constraints: of(|frame| frame.structural_constraints),
            covisible_frames: self.points.covisible_frames(),
            point_parallax_rad: Distribution::new(self.parallax.iter().flatten().map(WidestParallax::widest)),
            parallax_to_previous_rad: Distribution::new(
                self.frames.iter().filter_map(|frame| frame.median_parallax_to_previous),
            ),
            motion: motion(&self.frames, &self.stamps),
            noise: NoiseStatistics {
                point_px: self.noise[0].finish(),
                point_depth_m: self.noise[1].finish(),
                line_px: self.noise[2].finish(),
                line_depth_m: self.noise[3].finish(),
            },
        };
        Analysed { sequence, frames: self.frames }
    }
}

/// Ends of a measured and an observed segment are of the same place up to this distance, pixels: a segment may be seen in another part.
const SAME_END_PX: f64 = 5.0;

/// Pixel and depth of an end.
type End = ([f64; 2], Option<f64>);

/// Signed distance of a pixel from the endless line through two others, pixels; not finite where these are one.
fn distance_from_line([u, v]: [f64; 2], [start, end]: [[f64; 2]; 2]) -> f64 {
    let (along_u, along_v) = (end[0] - start[0], end[1] - start[1]);
    let length = (along_u * along_u + along_v * along_v).sqrt();
    (along_u * (v - start[1]) - along_v * (u - start[0])) / length
}

/// Squared distance of two ends, square pixels.
fn square((one, _): End, (other, _): End) -> f64 {
    let (u, v) = (one[0] - other[0], one[1] - other[1]);
    u * u + v * v
}

fn features(
    table: &'static str,
    per_frame: Option<Distribution>,
    covisibility: &Covisibility,
) -> FeatureStatistics {
    let tracks = covisibility.tracks();
    FeatureStatistics {
        table,
        rows: tracks.iter().map(|track| u64::from(*track)).sum(),
        landmarks: tracks.len() as u64,
        per_frame,
        track_length_frames: Distribution::new(tracks.iter().copied().map(f64::from)),
        tracks: track_bins(tracks.iter().copied()),
        shared: covisibility.shared_apart(),
    }
}

fn motion(frames: &[FrameStatistics], stamps: &[i64]) -> Option<MotionStatistics> {
    let seconds = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0]) as f64 * 1e-9);
    let steps: Vec<(f64, f64, f64)> = frames
        .iter()
        .skip(1)
        .zip(seconds)
        .filter_map(|(frame, seconds)| {
            Some((frame.translation_since_previous?, frame.rotation_since_previous?, seconds))
        })
        .collect();
    let typical = typical_rotation(steps.iter().map(|step| step.1));
    let timed = steps.iter().filter(|(_, _, seconds)| *seconds > 0.0);
    Some(MotionStatistics {
        steps: steps.len() as u64,
        path_length_m: steps.iter().map(|step| step.0).sum(),
        total_rotation_rad: steps.iter().map(|step| step.1).sum(),
        translation_m: Distribution::new(steps.iter().map(|step| step.0))?,
        rotation_rad: Distribution::new(steps.iter().map(|step| step.1))?,
        typical_rotation_rad: typical,
        grade: typical.map(grade_of),
        speed_m_per_s: Distribution::new(timed.clone().map(|(metres, _, seconds)| metres / seconds)),
        turn_rate_rad_per_s: Distribution::new(timed.map(|(_, angle, seconds)| angle / seconds)),
    })
}
