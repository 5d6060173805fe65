//! Names of things: an id is given by the file, comes in any order and never changes.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

macro_rules! id {
    ($(#[doc = $doc:literal])* $name:ident, $word:literal) => {
        $(#[doc = $doc])*
        #[derive(
            Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
        )]
        #[serde(transparent)]
        #[schemars(inline)]
        pub struct $name(pub i64);

        impl fmt::Display for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, concat!($word, " {}"), self.0)
            }
        }
    };
}

id! {
    /// Name of one exposure of one camera.
    FrameId, "frame"
}
id! {
    /// Name of a point landmark.
    PointId, "point"
}
id! {
    /// Name of a line landmark.
    LineId, "line"
}
id! {
    /// Name of a structural group.
    GroupId, "group"
}
id! {
    /// Name of a camera of the manifest.
    CameraId, "camera"
}
