//! What a SLAM system is given of a frame: measurements, and no truth.

use super::id::{CameraId, FrameId};
use super::measurement::{LineMeasurement, PointMeasurement};
use super::sequence::Sequence;

/// One frame's measurements, without its true pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredFrame {
    /// The frame.
    pub frame_id: FrameId,
    /// When it was exposed, nanoseconds.
    pub stamp_nanos: i64,
    /// Camera that exposed it.
    pub camera_id: CameraId,
    /// Measured points, by ascending id.
    pub points: Vec<PointMeasurement>,
    /// Measured segments, by ascending id.
    pub lines: Vec<LineMeasurement>,
}

impl MeasuredFrame {
    /// Every frame of a sequence in the order of stamps and ids; frames without measurements are among them.
    ///
    /// Rows of frames that are not in the table `frames` are passed over.
    #[must_use]
    pub fn of(sequence: &Sequence) -> Vec<Self> {
        let mut frames: Vec<Self> = sequence
            .frames
            .iter()
            .map(|frame| Self {
                frame_id: frame.frame_id,
                stamp_nanos: frame.stamp_nanos,
                camera_id: frame.camera_id,
                ..Self::default()
            })
            .collect();
        frames.sort_by_key(|frame| frame.frame_id);
        let place = |frame_id: FrameId, frames: &[Self]| {
            frames.binary_search_by_key(&frame_id, |frame| frame.frame_id).ok()
        };
        for row in &sequence.point_measurements {
            if let Some(place) = place(row.frame_id, &frames) {
                frames[place].points.push(row.clone());
            }
        }
        for row in &sequence.line_measurements {
            if let Some(place) = place(row.frame_id, &frames) {
                frames[place].lines.push(row.clone());
            }
        }
        for frame in &mut frames {
            frame.points.sort_by_key(|row| row.point_id);
            frame.lines.sort_by_key(|row| row.line_id);
        }
        frames.sort_by_key(|frame| (frame.stamp_nanos, frame.frame_id));
        frames
    }
}
