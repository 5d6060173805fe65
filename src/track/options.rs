//! Which tracker, and how it works.

use std::collections::BTreeMap;

use super::classic::ClassicTracker;
use super::landmark_tracker::{LandmarkTracker, Memory};
use super::{Error, Tracker};
use crate::geometry::{PinholeCamera, Pose};
use crate::structure::{Camera, CameraId, DepthNoise, MeasurementNoise};

/// What a frame is aligned to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The frame before: errors add up.
    FrameToFrame,
    /// A map of all landmarks seen so far.
    #[default]
    MapToFrame,
}

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sensor {
    /// Pixels and depth, with the noise that is declared.
    #[default]
    Rgbd,
    /// Pixels and depth by disparity over a baseline.
    Stereo {
        /// Distance of the two cameras, metres.
        baseline_m: f64,
    },
    /// Pixels alone; depth is not looked at.
    Monocular,
}

/// Options of the built-in trackers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackOptions {
    /// What a frame is aligned to.
    pub method: Method,
    /// The paper's plain variant: `EPnP` over points with depth, no outlier is sought, nothing is refined, landmarks are averages.
    pub classic: bool,
    /// What is measured.
    pub sensor: Sensor,
    /// Seed of random samples.
    pub seed: u64,
}

impl TrackOptions {
    /// A tracker at its first frame.
    ///
    /// * `cameras` — of the manifest; frames name them.
    /// * `noise` — as declared; [`TrackOptions::sensor`] may change what it says of depth.
    /// * `first` — pose of the first frame, `world_from_camera`: the gauge.
    ///
    /// # Errors
    /// [`Error::Camera`] and [`Error::Value`].
    pub fn tracker(
        &self,
        cameras: &[Camera],
        noise: MeasurementNoise,
        first: Pose,
    ) -> Result<Box<dyn Tracker>, Error> {
        if !(noise.sigma_px > 0.0 && noise.sigma_px.is_finite()) {
            let expected = "a positive number";
            return Err(Error::Value { what: "sigma of pixels", expected, found: noise.sigma_px });
        }
        let mut known = BTreeMap::new();
        for camera in cameras {
            let projection = camera.projection();
            let found = [projection.fx, projection.fy, projection.cx, projection.cy];
            let whole = found.iter().all(|number| number.is_finite()) && found[0] != 0.0 && found[1] != 0.0;
            if !whole {
                return Err(Error::Camera { camera: camera.camera_id, found });
            }
            known.insert(camera.camera_id, (projection, self.noise(noise, &projection)?));
        }
        let setting = Setting { cameras: known, first, seed: self.seed };
        Ok(match (self.classic, self.method) {
            (true, method) => Box::new(ClassicTracker::new(setting, method)),
            (false, Method::FrameToFrame) => Box::new(LandmarkTracker::new(setting, Memory::LastFrame)),
            (false, Method::MapToFrame) => Box::new(LandmarkTracker::new(setting, Memory::Whole)),
        })
    }

    /// The noise of a camera's measurements.
    fn noise(&self, noise: MeasurementNoise, camera: &PinholeCamera) -> Result<MeasurementNoise, Error> {
        Ok(match self.sensor {
            Sensor::Rgbd => noise,
            Sensor::Monocular => MeasurementNoise { depth: DepthNoise::Unknown, ..noise },
            Sensor::Stereo { baseline_m } => {
                if !(baseline_m > 0.0 && baseline_m.is_finite()) {
                    let expected = "a positive number of metres";
                    return Err(Error::Value { what: "baseline", expected, found: baseline_m });
                }
                noise.stereo(camera.fx, baseline_m)
            }
        })
    }
}

/// What every built-in tracker is given.
#[derive(Clone, Debug)]
pub(super) struct Setting {
    /// Projection and noise of each camera.
    pub(super) cameras: BTreeMap<CameraId, (PinholeCamera, MeasurementNoise)>,
    /// Pose of the first frame, `world_from_camera`.
    pub(super) first: Pose,
    /// Seed of random samples.
    pub(super) seed: u64,
}
