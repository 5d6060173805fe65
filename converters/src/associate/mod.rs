//! From what images show to landmarks of the world, and back to every frame that sees them.

mod point_lift;
mod point_map;

pub use point_lift::{LiftedPoint, PointLandmarkOptions, PointRejection, Rims, lift_point};
pub use point_map::{PointCandidate, PointMap};
