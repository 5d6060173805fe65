//! What a camera sees: the frustum, and what stands in the way.

mod line_index;
mod line_part;
mod occluders;
mod places;
mod point_index;
mod sampled_line;
mod shadow;
mod tree;
mod view;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;
use super::scene::check_numbers;

pub use line_index::LineIndex;
pub use line_part::visible_part;
pub use occluders::{Hit, Occluders};
pub use places::{PlaceSet, Places};
pub use point_index::PointIndex;
pub use sampled_line::sampled_part;
pub use view::{Bounds, View};

/// How it is decided what a frame sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(inline)]
pub struct Visibility {
    /// What hides a landmark.
    pub model: VisibilityModel,
    /// Nearest and farthest depth (z) that is seen, metres; with `frustum` the nearest alone matters.
    #[schemars(extend("x-unit" = "m"))]
    pub depth_range_m: [f64; 2],
    /// Segments whose visible part is shorter than this are not seen, pixels.
    #[schemars(extend("x-unit" = "px"))]
    pub min_length_px: f64,
}

/// What hides a landmark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum VisibilityModel {
    /// The frustum and every face of the scene between the camera and the landmark. Of a segment the longest
    /// part that is in view is seen, and its ends are where it is cut.
    #[default]
    Occlusion,
    /// The frustum alone, tested as the first release does: `z > 0.01 m`, `0 ≤ u ≤ width`, `0 ≤ v ≤ height`;
    /// of 100 places along a segment more than 5 have to be in view, and the first and the last of them
    /// are its ends.
    Frustum,
}

impl Default for Visibility {
    fn default() -> Self {
        Self { model: VisibilityModel::Occlusion, depth_range_m: [0.1, 100.0], min_length_px: 5.0 }
    }
}

impl Visibility {
    /// Looks at the numbers.
    pub(crate) fn check(&self, place: &str) -> Result<(), Error> {
        let range = format!("{place}.depth_range_m");
        check_numbers(&range, &self.depth_range_m, 1e-6, 1e7, "m")?;
        let [near, far] = self.depth_range_m;
        if near >= far {
            return Err(Error::value(range, "near before far", format!("{near} and {far} m")));
        }
        check_numbers(&format!("{place}.min_length_px"), &[self.min_length_px], 0.0, 1e6, "px")
    }

    /// The bounds of what is in view.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        match self.model {
            VisibilityModel::Occlusion => Bounds::whole_pixels(self.depth_range_m),
            VisibilityModel::Frustum => Bounds::first_release(),
        }
    }
}
