//! True point and line landmarks.

use std::borrow::Cow;

use nalgebra::Point3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::digest::hex;
use super::id::{LineId, PointId};
use super::record::record;
use super::segment_row::stored_segment;
use crate::geometry::{self, OrthonormalLine, PluckerLine, Segment};

/// A binary descriptor; JSON shows it as lower-case hexadecimal digits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Descriptor(pub Vec<u8>);

impl Serialize for Descriptor {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&hex(&self.0))
    }
}

impl<'de> Deserialize<'de> for Descriptor {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<'de, str>::deserialize(deserializer)?;
        let digits = text.as_bytes();
        if !digits.len().is_multiple_of(2) {
            return Err(de::Error::custom("an odd number of hexadecimal digits"));
        }
        let digit = |byte: u8| (byte as char).to_digit(16).and_then(|value| u8::try_from(value).ok());
        digits
            .chunks_exact(2)
            .map(|pair| Some(digit(pair[0])? << 4 | digit(pair[1])?))
            .collect::<Option<Vec<u8>>>()
            .map(Self)
            .ok_or_else(|| de::Error::custom("not hexadecimal digits"))
    }
}

impl JsonSchema for Descriptor {
    fn schema_name() -> Cow<'static, str> {
        "Descriptor".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "contentEncoding": "base16", "pattern": "^([0-9a-f][0-9a-f])*$" })
    }
}

record! {
    /// A true point of the scene.
    pub struct PointLandmark in point_landmarks (Whole, Optional, key: [point_id]) {
        /// Name of the point.
        ["1", "-"]
        point_id: PointId,
        /// Position, x.
        ["m", "world"]
        x: f64,
        /// Position, y.
        ["m", "world"]
        y: f64,
        /// Position, z.
        ["m", "world"]
        z: f64,
        /// Binary descriptor of the point's appearance; which one, the manifest's generator says.
        ["1", "-"]
        descriptor: Option<Descriptor>,
    }
}

impl PointLandmark {
    /// A point without descriptor.
    #[must_use]
    pub fn new(point_id: PointId, position: Point3<f64>) -> Self {
        Self { point_id, x: position.x, y: position.y, z: position.z, descriptor: None }
    }

    /// Position in `world`, metres.
    #[must_use]
    pub fn position(&self) -> Point3<f64> {
        Point3::new(self.x, self.y, self.z)
    }
}

record! {
    /// A true line of the scene, in the three forms of the paper: two ends, Plücker and orthonormal.
    ///
    /// The three say the same line; readers may use whichever suits.
    pub struct LineLandmark in line_landmarks (Whole, Optional, key: [line_id]) {
        /// Name of the line.
        ["1", "-"]
        line_id: LineId,
        /// First end, x.
        ["m", "world"]
        start_x: f64,
        /// First end, y.
        ["m", "world"]
        start_y: f64,
        /// First end, z.
        ["m", "world"]
        start_z: f64,
        /// Second end, x.
        ["m", "world"]
        end_x: f64,
        /// Second end, y.
        ["m", "world"]
        end_y: f64,
        /// Second end, z.
        ["m", "world"]
        end_z: f64,
        /// Plücker moment n = start × direction, x.
        ["m", "world"]
        moment_x: f64,
        /// Plücker moment, y.
        ["m", "world"]
        moment_y: f64,
        /// Plücker moment, z.
        ["m", "world"]
        moment_z: f64,
        /// Plücker direction d, of unit length, from the first end to the second, x.
        ["1", "world"]
        direction_x: f64,
        /// Plücker direction, y.
        ["1", "world"]
        direction_y: f64,
        /// Plücker direction, z.
        ["1", "world"]
        direction_z: f64,
        /// Orthonormal form: rotation vector of U = [n/|n|, d/|d|, n×d/|n×d|], x.
        ["rad", "world"]
        phi_x: f64,
        /// Orthonormal form: rotation vector of U, y.
        ["rad", "world"]
        phi_y: f64,
        /// Orthonormal form: rotation vector of U, z.
        ["rad", "world"]
        phi_z: f64,
        /// Orthonormal form: angle of W, atan2(|d|, |n|).
        ["rad", "world"]
        varphi: f64,
    }
}

stored_segment!(LineLandmark);

impl LineLandmark {
    /// The three forms of the line through a segment.
    ///
    /// # Errors
    /// Those of [`Segment::plucker`]: ends that coincide or are not finite.
    pub fn from_segment(line_id: LineId, segment: &Segment) -> Result<Self, geometry::Error> {
        let plucker = segment.plucker()?;
        let orthonormal = plucker.orthonormal();
        let (start, end) = (segment.start, segment.end);
        Ok(Self {
            line_id,
            start_x: start.x,
            start_y: start.y,
            start_z: start.z,
            end_x: end.x,
            end_y: end.y,
            end_z: end.z,
            moment_x: plucker.moment.x,
            moment_y: plucker.moment.y,
            moment_z: plucker.moment.z,
            direction_x: plucker.direction.x,
            direction_y: plucker.direction.y,
            direction_z: plucker.direction.z,
            phi_x: orthonormal.phi.x,
            phi_y: orthonormal.phi.y,
            phi_z: orthonormal.phi.z,
            varphi: orthonormal.varphi,
        })
    }

    /// The stored Plücker numbers as they are, unchecked.
    #[must_use]
    pub fn plucker(&self) -> PluckerLine {
        PluckerLine {
            moment: nalgebra::Vector3::new(self.moment_x, self.moment_y, self.moment_z),
            direction: nalgebra::Vector3::new(self.direction_x, self.direction_y, self.direction_z),
        }
    }

    /// The stored orthonormal numbers as they are, unchecked.
    #[must_use]
    pub fn orthonormal(&self) -> OrthonormalLine {
        OrthonormalLine {
            phi: nalgebra::Vector3::new(self.phi_x, self.phi_y, self.phi_z),
            varphi: self.varphi,
        }
    }
}
