//! What of a sequence its cells were made of: they are worth nothing once it is another.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::structure::{ContentDigest, Estimate, Sequence};

/// Digests of what a benchmark takes from a sequence.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Content {
    /// Of truth, observations and measurements, cameras and noise.
    pub(super) measured: String,
    /// Of the estimates that are evaluated, by name.
    #[serde(default)]
    pub(super) estimates: BTreeMap<String, String>,
}

impl Content {
    /// The content of a sequence, with the estimates of some names.
    pub(super) fn of(sequence: &Sequence, estimates: &[String]) -> Self {
        let mut digest = ContentDigest::default();
        digest.update(&sequence.frames);
        digest.update(&sequence.point_landmarks);
        digest.update(&sequence.line_landmarks);
        digest.update(&sequence.structural_groups);
        digest.update(&sequence.point_observations);
        digest.update(&sequence.line_observations);
        digest.update(&sequence.point_measurements);
        digest.update(&sequence.line_measurements);
        let (cameras, noise) = (&sequence.manifest.cameras, &sequence.manifest.noise);
        // A camera and a noise model that cannot be written are not read either.
        let declared = serde_json::to_string(&(cameras, noise)).unwrap_or_default();
        let of_estimate = |name: &String| {
            let estimate = Estimate::of(sequence, name)?;
            let mut digest = ContentDigest::default();
            digest.update(&estimate.trajectory);
            Some((name.clone(), digest.finish()))
        };
        Self {
            measured: format!("{} {declared}", digest.finish()),
            estimates: estimates.iter().filter_map(of_estimate).collect(),
        }
    }
}
