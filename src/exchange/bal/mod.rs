//! Bundle Adjustment in the Large: problems of Agarwal et al. 2010, as they are and as our graphs.
//!
//! A camera of BAL has nine numbers of its own: a rotation vector and a translation that take the world into the camera,
//! a focal length and two radial coefficients. It looks along −z, its y points up, its pixels count from the middle of the
//! image:
//!
//! ```text
//! P = R X + t,   p = −(P.x, P.y)/P.z,   pixel = f r(p) p,   r(p) = 1 + k1 |p|² + k2 |p|⁴
//! ```

mod estimate;
mod export;
mod import;
mod problem;
mod radial;
#[cfg(test)]
mod tests;
mod text;

pub use estimate::bal_estimate;
pub use export::to_bal;
pub use import::from_bal;
pub use problem::{BalCamera, BalObservation, BalProblem};
pub use text::{read_bal, write_bal};
