//! Every threshold of a conversion.

use open_structure::simulate::noise::{NoiseModel, NoiseRecipe};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;
use crate::associate::{GroupOptions, LineOptions, PointLandmarkOptions};
use crate::detect::{PointOptions, SegmentOptions};
use crate::rgbd::{DepthNoise, RawSequence};

/// Every threshold of a conversion; what a configuration leaves out has its default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// Seed of everything random: of noise, and of the pairs that are tried as lines.
    pub seed: u64,
    /// The depth maps.
    pub depth: DepthOptions,
    /// Detection of points: ORB.
    pub points: PointOptions,
    /// Detection of segments.
    pub segments: SegmentOptions,
    /// Landmarks of points.
    pub point_landmarks: PointLandmarkOptions,
    /// Landmarks of lines.
    pub lines: LineOptions,
    /// Groups of parallel lines.
    pub groups: GroupOptions,
    /// Noise between observations and measurements.
    pub noise: NoiseRecipe,
}

/// What is thought of depth maps; what is left out, the dataset says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DepthOptions {
    /// Nearest depth that is believed, metres.
    pub nearest_m: Option<f64>,
    /// Farthest depth that is believed, metres.
    pub farthest_m: Option<f64>,
    /// Standard deviation of depth, by its distance.
    pub noise: Option<DepthNoise>,
    /// Standard deviation of true positions, metres: the motion capture system, and its clock.
    pub pose_sigma_m: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            depth: DepthOptions::default(),
            points: PointOptions::default(),
            segments: SegmentOptions::default(),
            point_landmarks: PointLandmarkOptions::default(),
            lines: LineOptions::default(),
            groups: GroupOptions::default(),
            // What the measurements of the first release have.
            noise: NoiseRecipe::new(NoiseModel::Gaussian),
        }
    }
}

impl Options {
    /// Options from the text of a configuration, in TOML.
    ///
    /// # Errors
    /// [`Error::Option`] for text that is not TOML, a name that there is not, or a number out of range.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let options: Self = toml::from_str(text).map_err(|error| Error::Option {
            place: "configuration".to_owned(),
            expected: "TOML with the names that --print-config shows".to_owned(),
            found: error.to_string().trim_end().to_owned(),
        })?;
        options.check()?;
        Ok(options)
    }

    /// Holds every number against its range.
    ///
    /// # Errors
    /// [`Error::Option`] with the place of the first that is outside.
    pub fn check(&self) -> Result<(), Error> {
        const PX: [f64; 2] = [0.0, 1e4];
        const METRES: [f64; 2] = [0.0, 1e4];
        const PART: [f64; 2] = [0.0, 1.0];
        let Self { depth, points, segments, point_landmarks, lines, groups, .. } = self;
        let noise = depth.noise.unwrap_or(DepthNoise { constant_m: 0.0, linear: 0.0, quadratic_per_m: 0.0 });
        let numbers = [
            ("depth.nearest_m", depth.nearest_m.unwrap_or(0.0), METRES),
            ("depth.farthest_m", depth.farthest_m.unwrap_or(1.0), [1e-3, 1e6]),
            ("depth.pose_sigma_m", depth.pose_sigma_m.unwrap_or(0.0), [0.0, 10.0]),
            ("depth.noise.constant_m", noise.constant_m, [0.0, 10.0]),
            ("depth.noise.linear", noise.linear, PART),
            ("depth.noise.quadratic_per_m", noise.quadratic_per_m, PART),
            ("points.max_features", points.max_features.into(), [0.0, 1e5]),
            ("points.scale_factor", points.scale_factor.into(), [1.01_f32.into(), 4.0]),
            ("points.levels", points.levels.into(), [1.0, 16.0]),
            ("points.fast_threshold", points.fast_threshold.into(), [1.0, 255.0]),
            ("points.min_distance_px", points.min_distance_px, PX),
            ("segments.piece_px", segments.piece_px, PX),
            ("segments.length_px", segments.length_px, PX),
            ("segments.straightness_px", segments.straightness_px, [0.01, 100.0]),
            ("segments.canny[0]", segments.canny[0], [1e-3, 1e4]),
            ("segments.canny[1]", segments.canny[1], [1e-3, 1e4]),
            ("segments.merge_angle_deg", segments.merge_angle_deg, [0.0, 90.0]),
            ("segments.merge_distance_px", segments.merge_distance_px, PX),
            ("segments.merge_gap_px", segments.merge_gap_px, [-1e4, 1e4]),
            ("segments.most", segments.most as f64, [0.0, 1e5]),
            ("point_landmarks.sigma_px", point_landmarks.sigma_px, [1e-3, 100.0]),
            ("point_landmarks.radius_px", point_landmarks.radius_px, [0.0, 1e3]),
            ("point_landmarks.max_radius_m", point_landmarks.max_radius_m, METRES),
            ("point_landmarks.max_hamming", point_landmarks.max_hamming.into(), [0.0, 256.0]),
            ("point_landmarks.max_absent", point_landmarks.max_absent, PART),
            ("lines.step_px", lines.step_px, [0.1, 100.0]),
            ("lines.most_places", lines.most_places as f64, [4.0, 1e4]),
            ("lines.depth_part", lines.depth_part, PART),
            ("lines.rim_part", lines.rim_part, PART),
            ("lines.straight_sigmas", lines.straight_sigmas, [0.0, 100.0]),
            ("lines.straight_px", lines.straight_px, [0.0, 100.0]),
            ("lines.trials", lines.trials as f64, [1.0, 1e5]),
            ("lines.straight_part", lines.straight_part, PART),
            ("lines.length_m", lines.length_m, METRES),
            ("lines.fuse_angle_deg", lines.fuse_angle_deg, [0.0, 90.0]),
            ("lines.fuse_distance_m", lines.fuse_distance_m, METRES),
            ("lines.fuse_widths", lines.fuse_widths, [0.0, 100.0]),
            ("lines.fuse_gap_m", lines.fuse_gap_m, METRES),
            ("lines.nearest_m", lines.nearest_m, [1e-3, 1e4]),
            ("lines.sight_step_px", lines.sight_step_px, [0.1, 100.0]),
            ("lines.sight_gap_px", lines.sight_gap_px, PX),
            ("lines.sight_length_px", lines.sight_length_px, PX),
            ("lines.sight_part", lines.sight_part, PART),
        ];
        for (place, value, [least, most]) in numbers {
            within(place, value, least, most)?;
        }
        if let (Some(nearest_m), Some(farthest_m)) = (depth.nearest_m, depth.farthest_m) {
            within("depth.farthest_m", farthest_m, nearest_m, 1e6)?;
        }
        within("groups.angle_deg", groups.angle_deg, 0.0, 45.0)?;
        within("groups.shift_m", groups.shift_m, 0.0, 1e3)?;
        within("groups.least", groups.least as f64, 2.0, 1e6)?;
        within("groups.orthogonal_deg", groups.orthogonal_deg, 0.0, 20.0)?;
        self.noise.check().map_err(|error| Error::Option {
            place: "noise".to_owned(),
            expected: "a noise model with its parameters".to_owned(),
            found: error.to_string(),
        })
    }
}

impl DepthOptions {
    /// A sequence with what the configuration says in place of what the dataset does.
    pub(super) fn applied(&self, raw: &RawSequence) -> RawSequence {
        let mut raw = raw.clone();
        raw.camera.depth_min = self.nearest_m.or(raw.camera.depth_min);
        raw.camera.depth_max = self.farthest_m.or(raw.camera.depth_max);
        raw.depth_noise = self.noise.unwrap_or(raw.depth_noise);
        raw.pose_sigma_m = self.pose_sigma_m.unwrap_or(raw.pose_sigma_m);
        raw
    }
}

fn within(place: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::Option {
        place: place.to_owned(),
        expected: format!("a number from {least} to {most}"),
        found: value.to_string(),
    })
}
