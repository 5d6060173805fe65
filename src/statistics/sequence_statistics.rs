//! The statistics of a whole sequence, as they are given out.

use crate::structure::MotionGrade;
use schemars::JsonSchema;
use serde::Serialize;

use super::covisibility::SharedApart;
use super::difference::Difference;
use super::distribution::{Distribution, TrackBin};

/// What a sequence is like, in numbers.
///
/// A member that does not apply is left out: motion and parallax without true poses, distributions of nothing.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SequenceStatistics {
    /// Name of the sequence.
    pub name: String,
    /// Frames.
    pub frame_count: u64,
    /// Time from the first frame to the last, seconds.
    pub duration_seconds: f64,
    /// Points.
    pub points: FeatureStatistics,
    /// Line segments.
    pub lines: FeatureStatistics,
    /// Cells of 10 × 10 pixels with a point or an end of a segment, by frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occupied_cells: Option<Distribution>,
    /// Cells of the image with a point or any part of a segment, by frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covered_cells: Option<Distribution>,
    /// Cells of the image; left out where cameras differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_cells: Option<u64>,
    /// Independent constraints among the lines of a frame: the sum over groups of (lines in the frame − 1).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub structural_constraints: Option<Distribution>,
    /// For a frame, how many others share at least 15 points with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covisible_frames: Option<Distribution>,
    /// For a point, the widest angle between two rays to it, radians; noise of the pixels is in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_parallax_rad: Option<Distribution>,
    /// For a frame, the median angle between the rays to points that the frame before shows too, radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parallax_to_previous_rad: Option<Distribution>,
    /// How the camera moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionStatistics>,
    /// How far measurements are from observations, where both are there.
    pub noise: NoiseStatistics,
}

/// Features of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct FeatureStatistics {
    /// Table that was counted: measurements, or observations where there are none.
    pub table: &'static str,
    /// Rows.
    pub rows: u64,
    /// Landmarks that are seen.
    pub landmarks: u64,
    /// Features of a frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub per_frame: Option<Distribution>,
    /// Frames that show a landmark.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track_length_frames: Option<Distribution>,
    /// Histogram of the track lengths.
    pub tracks: Vec<TrackBin>,
    /// Landmarks that two frames share, by how far they are apart.
    pub shared: Vec<SharedApart>,
}

/// How the camera moves from frame to frame, by the true poses.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct MotionStatistics {
    /// Steps with true poses at both ends.
    pub steps: u64,
    /// Length of the path, metres.
    pub path_length_m: f64,
    /// Sum of all rotations, radians.
    pub total_rotation_rad: f64,
    /// Distance from one frame to the next, metres.
    pub translation_m: Distribution,
    /// Angle from one frame to the next, radians.
    pub rotation_rad: Distribution,
    /// Median angle from one frame to the next over the steps that turn by 0.01 degrees or more, radians; left out
    /// where none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub typical_rotation_rad: Option<f64>,
    /// Grade of the typical rotation: slow under 1 degree, medium under 5, else sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grade: Option<MotionGrade>,
    /// Speed, metres a second; left out where no time passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_m_per_s: Option<Distribution>,
    /// Turn rate, radians a second; left out where no time passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn_rate_rad_per_s: Option<Distribution>,
}

/// Measurement less observation. A segment may be measured in another part than it is observed in, so its ends count across it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct NoiseStatistics {
    /// Columns and rows of points, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_px: Option<Difference>,
    /// Depths of points, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_depth_m: Option<Difference>,
    /// Distances of the ends of measured segments from the lines of the observed ones, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_px: Option<Difference>,
    /// Depths of ends that are measured within 5 pixels of the observed ones, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_depth_m: Option<Difference>,
}

impl SequenceStatistics {
    /// The JSON Schema (2020-12) of the statistics.
    #[must_use]
    pub fn json_schema() -> serde_json::Value {
        let settings = schemars::generate::SchemaSettings::draft2020_12()
            .with(|settings| settings.inline_subschemas = true);
        settings.into_generator().into_root_schema_for::<Self>().to_value()
    }
}
