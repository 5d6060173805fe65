//! What is said about a sequence as a whole.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::camera::Camera;
use super::id::CameraId;
use super::provenance::{Exclusion, Generator, Recovery, Source};
use super::registry;

/// What is said about a sequence as a whole: identity, origin, cameras, conventions, noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Manifest {
    /// Version of the specification that the sequence follows, as `major.minor.patch`.
    pub spec_version: String,
    /// Name of the sequence.
    pub name: String,
    /// What the sequence shows, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// The data from which the sequence was made.
    pub source: Source,
    /// The tool that made the sequence.
    pub generator: Generator,
    /// Conventions and units of every number in the sequence.
    pub conventions: Conventions,
    /// Where the time stamps come from.
    pub clock: Clock,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Noise of the measurement tables; absent when there are none or nothing is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Values that the source lacks and that were computed from the rest of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recovered: Vec<Recovery>,
    /// Source data that could not be used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excluded: Vec<Exclusion>,
    /// Row count and digest of every table; in an MCAP file these are messages of their own, after the data.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<TableSummary>,
}

/// Conventions and units; version 1 has one permitted value for each.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Conventions {
    /// Direction of stored poses: `world_from_camera`.
    pub pose: String,
    /// Quaternions: `hamilton-xyzw`.
    pub rotation: String,
    /// Depth: `z`, the distance along the optical axis.
    pub depth: String,
    /// Unit of length: `m`.
    pub length: String,
    /// Unit of angle: `rad`.
    pub angle: String,
    /// Unit of image positions: `px`.
    pub image: String,
    /// Unit of time: `ns`.
    pub time: String,
}

impl Default for Conventions {
    fn default() -> Self {
        Self {
            pose: "world_from_camera".to_owned(),
            rotation: "hamilton-xyzw".to_owned(),
            depth: "z".to_owned(),
            length: "m".to_owned(),
            angle: "rad".to_owned(),
            image: "px".to_owned(),
            time: "ns".to_owned(),
        }
    }
}

/// Where time stamps come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Clock {
    /// `recorded`: the sensor's stamps since the Unix epoch. `synthetic`: made from a frame rate, starting anywhere.
    pub kind: String,
    /// Frame rate of a synthetic clock, hertz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "Hz"))]
    pub rate_hz: Option<f64>,
}

/// Noise between observations and measurements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Noise {
    /// Noise model; the registry gives its formula and its parameters.
    pub model: String,
    /// Seed of the noise, where it was drawn by the generator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Parameters by the registry's names, whose suffix says the unit, such as `sigma_px` and `sigma_depth_m`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
}

/// Row count and digest of one table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TableSummary {
    /// Table name.
    pub table: String,
    /// Rows.
    pub rows: u64,
    /// SHA-256 over the canonical bytes of the rows, as 64 lower-case hexadecimal digits.
    pub sha256: String,
}

impl Manifest {
    /// The camera of an id.
    #[must_use]
    pub fn camera(&self, camera_id: CameraId) -> Option<&Camera> {
        self.cameras.iter().find(|camera| camera.camera_id == camera_id)
    }

    /// The summary of a table.
    #[must_use]
    pub fn table(&self, name: &str) -> Option<&TableSummary> {
        self.tables.iter().find(|summary| summary.table == name)
    }
}

impl Default for Manifest {
    fn default() -> Self {
        Self {
            spec_version: registry::SPEC_VERSION.to_owned(),
            name: String::new(),
            description: None,
            source: Source::default(),
            generator: Generator::default(),
            conventions: Conventions::default(),
            clock: Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: None },
            cameras: Vec::new(),
            noise: None,
            recovered: Vec::new(),
            excluded: Vec::new(),
            tables: Vec::new(),
        }
    }
}
