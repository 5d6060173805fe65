//! From what single frames show to landmarks of the world, and back to every frame that sees them.

mod groups;
mod line_lift;
mod line_map;
mod line_options;
mod line_sight;
mod orthogonal;
mod point_lift;
mod point_map;
mod rims;
mod scatter;

pub use groups::{Group, GroupOptions, group_lines};
pub use line_lift::{LiftedLine, Rejected, lift};
pub use line_map::{Became, LineCandidate, LineMap};
pub use line_options::LineOptions;
pub use line_sight::visible_part;
pub use point_lift::{LiftedPoint, PointLandmarkOptions, PointRejection, lift_point};
pub use point_map::{PointCandidate, PointMap};
pub use rims::Rims;
pub use scatter::Scatter;
