//! A tracker, a factor and a parametrisation of one's own: see the README.

pub mod bearing;
pub mod refine;
pub mod seen;
pub mod tracker;
