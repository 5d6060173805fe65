//! The noise models by name, with their parameters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::structure::registry;

/// A noise model of the registry (section 4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseModel {
    /// Measurements equal observations.
    None,
    /// Independent Gaussian noise on pixels and depth.
    #[default]
    Gaussian,
    /// What the first release's code did: Gaussian noise, large depth noise of line ends replaced.
    FirstRelease,
    /// The paper's equations, literally, depth in centimetres.
    Paper,
    /// Kinect disparities: noise on the disparity, whole steps, and a lateral shift of where depth is read.
    KinectDisparity,
}

impl NoiseModel {
    /// Every model.
    pub const ALL: [Self; 5] =
        [Self::None, Self::Gaussian, Self::FirstRelease, Self::Paper, Self::KinectDisparity];

    /// The registry's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => registry::NOISE_NONE,
            Self::Gaussian => registry::NOISE_GAUSSIAN,
            Self::FirstRelease => registry::NOISE_FIRST_RELEASE,
            Self::Paper => registry::NOISE_PAPER,
            Self::KinectDisparity => registry::NOISE_KINECT_DISPARITY,
        }
    }

    /// The model of a name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.name() == name)
    }

    /// The model's parameters with their defaults: the paper's, the release's, or those of Barron and Malik.
    #[must_use]
    pub const fn parameters(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::None => &[],
            Self::Gaussian | Self::FirstRelease => &[("sigma_px", 1.0), ("sigma_depth_m", 0.05)],
            Self::Paper => &[("sigma_px", 1.0), ("m", 35130.0), ("sigma_d", 1.0 / 6.0)],
            Self::KinectDisparity => &[
                ("sigma_px", 1.0),
                ("m", 35130.0),
                ("sigma_disparity", 1.0 / 6.0),
                ("sigma_lateral_px", 0.5),
            ],
        }
    }
}
