//! Graphs in the text format of g2o: pose graphs in the plane and in space, and bundle adjustment.
//!
//! | what | vertices | edges and parameters | read | written |
//! |---|---|---|---|---|
//! | pose graph in the plane | `VERTEX_SE2` | `EDGE_SE2` | yes | yes |
//! | pose graph in space | `VERTEX_SE3:QUAT` | `EDGE_SE3:QUAT` | yes | yes |
//! | points, pixels alone | `VERTEX_CAM`, `VERTEX_TRACKXYZ` | `EDGE_PROJECT_P2MC` | yes | yes |
//! | points, with depth or relative poses | `VERTEX_SE3:QUAT`, `VERTEX_TRACKXYZ` | `EDGE_PROJECT_DEPTH`, `PARAMS_CAMERACALIB` | yes | yes |
//! | points, one focal length | `VERTEX_SE3:EXPMAP`, `VERTEX_XYZ` | `EDGE_PROJECT_XYZ2UV:EXPMAP`, `PARAMS_CAMERAPARAMETERS` | yes | no |
//!
//! `VERTEX_XYZ`, `VERTEX_POINT_XYZ` and `VERTEX_TRACKXYZ` are one thing. `FIX` names vertices that are held. Pose
//! vertices are `world_from_camera` in the file, `VERTEX_SE3:EXPMAP` too, although g2o holds its inverse in memory.
//! Information of edges between poses is taken per radian, over `[t; 2 vec q]` of `Z⁻¹ Xᵢ⁻¹ Xⱼ` and over `[x y θ]`, as those
//! who publish such files mean it; the program g2o leaves out the 2.
//! `EDGE_SE3_PROJECT_XYZ:EXPMAP` carries no intrinsics in a file and is passed over, like every tag not named here;
//! passed-over lines are counted.

mod element;
mod estimated;
mod export;
mod import;
mod information;
#[cfg(test)]
mod tests;
mod text;

pub use element::{G2oElement, G2oGraph, G2oKind};
pub use estimated::with_estimate;
pub use export::{G2oForm, to_g2o};
pub use import::from_g2o;
pub use text::{read_g2o, write_g2o};
