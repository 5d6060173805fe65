//! Pose, camera, line: numbers in, numbers out.
//!
//! A segment, a Plücker line and an orthonormal line are three types with named ways between them:
//! [`Segment::plucker`], [`PluckerLine::orthonormal`] and [`OrthonormalLine::plucker`].
//!
//! ```
//! use nalgebra::{Point2, Point3};
//! use open_structure::geometry::{PinholeCamera, Pose, Segment, line_residual};
//!
//! let camera = PinholeCamera { fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 };
//! let world_from_camera = Pose::from_components([0.1, 0.0, -2.0], [0.0, 0.1, 0.0, 1.0])?;
//! let camera_from_world = world_from_camera.inverse();
//!
//! let segment = Segment { start: Point3::new(-0.5, 0.2, 1.0), end: Point3::new(0.5, 0.3, 1.5) };
//! let line = segment.plucker()?;
//! let ends_px: Option<Vec<Point2<f64>>> =
//!     [segment.start, segment.end].map(|end| camera.project(camera_from_world * end)).into_iter().collect();
//!
//! let ends_px = ends_px.expect("both ends lie in front of the camera");
//! let residual = line_residual(&camera, &camera_from_world, &line, [ends_px[0], ends_px[1]])?;
//! assert!(residual.norm() < 1e-9);
//! # Ok::<(), open_structure::geometry::Error>(())
//! ```

mod absolute_orientation;
mod camera;
mod direction;
mod epnp;
mod error;
mod five_points;
mod landmark_match;
mod least_squares;
mod line_fit;
mod line_residual;
mod orthonormal_line;
mod p3p;
mod parallax;
mod plucker_line;
mod pose;
mod pose_ransac;
mod pose_refinement;
mod product;
mod relative_pose;
mod robust_loss;
mod rotation;
mod segment;
#[cfg(test)]
mod strategies;
mod triangulate_line;
mod triangulate_point;

pub use camera::PinholeCamera;
pub use direction::angle as angle_between;
pub use epnp::epnp;
pub use error::Error;
pub use landmark_match::{LineMatch, MeasuredDepth, PointMatch, Residual};
pub use line_fit::{LineFit, fit_line};
pub use line_residual::line_residual;
pub use orthonormal_line::OrthonormalLine;
pub use p3p::p3p;
pub use plucker_line::PluckerLine;
pub use pose::Pose;
pub use pose_ransac::{PoseConsensus, RansacOptions, ransac_pose};
pub use pose_refinement::{PoseRefinement, refine_pose};
pub(crate) use product::product;
pub use relative_pose::{RelativePose, relative_pose};
pub use robust_loss::RobustLoss;
pub use segment::Segment;
pub use triangulate_line::{LineTriangulation, LineView, triangulate_line};
pub use triangulate_point::{PointView, Triangulation, triangulate_point};
