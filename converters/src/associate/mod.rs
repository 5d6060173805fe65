//! From features of single frames to landmarks of the world, and back to every frame that sees them.

mod groups;
mod line_lift;
mod line_map;
mod line_options;
mod line_sight;
mod orthogonal;
mod scatter;

pub use groups::{Group, GroupOptions, group_lines};
pub use line_lift::{LiftedLine, Rejected, lift};
pub use line_map::{Became, LineCandidate, LineMap};
pub use line_options::{LineOptions, Rims};
pub use line_sight::visible_part;
pub use scatter::Scatter;
